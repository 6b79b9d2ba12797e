// Which instruction set's check of values a processor gets.
#include "kernels/launch/finite.h"

namespace ringlet::kernels {

#define RINGLET_DECLARE(isa)                                     \
  namespace isa {                                                \
  bool finite_floats(const float* values, std::int64_t count);   \
  bool finite_doubles(const double* values, std::int64_t count); \
  }
RINGLET_DECLARE(generic)
RINGLET_DECLARE(avx2)
RINGLET_DECLARE(avx512)
#undef RINGLET_DECLARE

template <>
FiniteCheck<float> finite_check(InstructionSet set) {
  if (set == InstructionSet::kAvx512) return avx512::finite_floats;
  return set == InstructionSet::kAvx2 ? avx2::finite_floats : generic::finite_floats;
}
template <>
FiniteCheck<double> finite_check(InstructionSet set) {
  if (set == InstructionSet::kAvx512) return avx512::finite_doubles;
  return set == InstructionSet::kAvx2 ? avx2::finite_doubles : generic::finite_doubles;
}

}  // namespace ringlet::kernels
