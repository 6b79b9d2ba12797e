// Hair against hair: which instruction set's grid and contacts a processor gets.
#include "kernels/launch/hair_contacts.h"
#include "kernels/launch/hair_grid.h"

namespace ringlet::kernels {

#define RINGLET_DECLARE(isa)                                      \
  namespace isa {                                                 \
  HairGrid<float>* new_float_grid(HostThreads threads);           \
  HairGrid<double>* new_double_grid(HostThreads threads);         \
  HairContacts<float>* new_float_contacts(HostThreads threads);   \
  HairContacts<double>* new_double_contacts(HostThreads threads); \
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

template <class Made>
using Maker = Made* (*)(HostThreads threads);

template <class Made>
std::unique_ptr<Made> make(InstructionSet set, HostThreads threads, Maker<Made> generic, Maker<Made> avx2,
                           Maker<Made> avx512) {
  const Maker<Made> maker = set == InstructionSet::kAvx512 ? avx512
                            : set == InstructionSet::kAvx2 ? avx2
                                                           : generic;
  return std::unique_ptr<Made>(maker(threads));
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

}  // namespace ringlet::kernels
