// Hair against hair: which instruction set's grid, its pressure alone and contacts a processor gets.
#include "kernels/launch/hair_contacts.h"
#include "kernels/launch/hair_grid.h"
#include "kernels/launch/pressure.h"

namespace ringlet::kernels {

#define RINGLET_DECLARE(isa)                                                                         \
  namespace isa {                                                                                    \
  HairGrid<float>* new_float_grid(HostThreads threads);                                              \
  HairGrid<double>* new_double_grid(HostThreads threads);                                            \
  HairContacts<float>* new_float_contacts(HostThreads threads);                                      \
  HairContacts<double>* new_double_contacts(HostThreads threads);                                    \
  PressureFigures solve_float_pressure(HostThreads threads, const PressureProblem<float>& problem,   \
                                       double residual, int most_iterations, double* answer);        \
  PressureFigures solve_double_pressure(HostThreads threads, const PressureProblem<double>& problem, \
                                        double residual, int most_iterations, double* answer);       \
  }
RINGLET_DECLARE(generic)
RINGLET_DECLARE(avx2)
RINGLET_DECLARE(avx512)
#undef RINGLET_DECLARE

// Here and not in the classes: they must not be compiled for an instruction set.
template <class T>
HairGrid<T>::~HairGrid() = default;
template class HairGrid<float>;
template class HairGrid<double>;
template <class T>
HairContacts<T>::~HairContacts() = default;
template class HairContacts<float>;
template class HairContacts<double>;

namespace {

template <class Function>
Function choose(InstructionSet set, Function generic, Function avx2, Function avx512) {
  return set == InstructionSet::kAvx512 ? avx512 : set == InstructionSet::kAvx2 ? avx2 : generic;
}

template <class Made>
using Maker = Made* (*)(HostThreads threads);

template <class Made>
std::unique_ptr<Made> make(InstructionSet set, HostThreads threads, Maker<Made> generic, Maker<Made> avx2,
                           Maker<Made> avx512) {
  return std::unique_ptr<Made>(choose(set, generic, avx2, avx512)(threads));
}

}  // namespace

template <>
std::unique_ptr<HairGrid<float>> make_hair_grid(InstructionSet set, HostThreads threads) {
  return make<HairGrid<float>>(set, threads, generic::new_float_grid, avx2::new_float_grid,
                               avx512::new_float_grid);
}
template <>
std::unique_ptr<HairGrid<double>> make_hair_grid(InstructionSet set, HostThreads threads) {
  return make<HairGrid<double>>(set, threads, generic::new_double_grid, avx2::new_double_grid,
                                avx512::new_double_grid);
}
template <>
std::unique_ptr<HairContacts<float>> make_hair_contacts(InstructionSet set, HostThreads threads) {
  return make<HairContacts<float>>(set, threads, generic::new_float_contacts, avx2::new_float_contacts,
                                   avx512::new_float_contacts);
}
template <>
std::unique_ptr<HairContacts<double>> make_hair_contacts(InstructionSet set, HostThreads threads) {
  return make<HairContacts<double>>(set, threads, generic::new_double_contacts, avx2::new_double_contacts,
                                    avx512::new_double_contacts);
}

template <>
PressureFigures solve_pressure(InstructionSet set, HostThreads threads, const PressureProblem<float>& problem,
                               double residual, int most_iterations, double* pressure) {
  const auto solve =
      choose(set, generic::solve_float_pressure, avx2::solve_float_pressure, avx512::solve_float_pressure);
  return solve(threads, problem, residual, most_iterations, pressure);
}
template <>
PressureFigures solve_pressure(InstructionSet set, HostThreads threads,
                               const PressureProblem<double>& problem, double residual, int most_iterations,
                               double* pressure) {
  const auto solve =
      choose(set, generic::solve_double_pressure, avx2::solve_double_pressure, avx512::solve_double_pressure);
  return solve(threads, problem, residual, most_iterations, pressure);
}

}  // namespace ringlet::kernels
