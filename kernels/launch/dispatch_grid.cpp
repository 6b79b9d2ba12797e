#include "kernels/launch/hair_grid.h"

namespace ringlet::kernels {

#define RINGLET_DECLARE(isa)                              \
  namespace isa {                                         \
  HairGrid<float>* new_float_grid(HostThreads threads);   \
  HairGrid<double>* new_double_grid(HostThreads threads); \
  }
RINGLET_DECLARE(generic)
RINGLET_DECLARE(avx2)
RINGLET_DECLARE(avx512)
#undef RINGLET_DECLARE

// Here and not in the class: it must not be compiled for an instruction set.
template <class T>
HairGrid<T>::~HairGrid() = default;
template class HairGrid<float>;
template class HairGrid<double>;

template <>
std::unique_ptr<HairGrid<float>> make_hair_grid(InstructionSet set, HostThreads threads) {
  const auto make = set == InstructionSet::kAvx512 ? avx512::new_float_grid
                    : set == InstructionSet::kAvx2 ? avx2::new_float_grid
                                                   : generic::new_float_grid;
  return std::unique_ptr<HairGrid<float>>(make(threads));
}
template <>
std::unique_ptr<HairGrid<double>> make_hair_grid(InstructionSet set, HostThreads threads) {
  const auto make = set == InstructionSet::kAvx512 ? avx512::new_double_grid
                    : set == InstructionSet::kAvx2 ? avx2::new_double_grid
                                                   : generic::new_double_grid;
  return std::unique_ptr<HairGrid<double>>(make(threads));
}

}  // namespace ringlet::kernels
