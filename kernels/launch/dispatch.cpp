#include "kernels/launch/launch.h"

#include <initializer_list>

namespace ringlet::kernels {

#define RINGLET_DECLARE(isa)                       \
  namespace isa {                                  \
  extern const KernelTable<float> float_kernels;   \
  extern const KernelTable<double> double_kernels; \
  }
RINGLET_DECLARE(generic)
RINGLET_DECLARE(avx2)
RINGLET_DECLARE(avx512)
#undef RINGLET_DECLARE

InstructionSet best_instruction_set() {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
    return InstructionSet::kAvx512;
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return InstructionSet::kAvx2;
  return InstructionSet::kGeneric;
}

const char* name_of(InstructionSet set) {
  switch (set) {
    case InstructionSet::kAvx512:
      return "avx512";
    case InstructionSet::kAvx2:
      return "avx2";
    case InstructionSet::kGeneric:
      break;
  }
  return "generic";
}

template <>
const KernelTable<float>& cpu_kernels<float>(InstructionSet set) {
  if (set == InstructionSet::kAvx512) return avx512::float_kernels;
  return set == InstructionSet::kAvx2 ? avx2::float_kernels : generic::float_kernels;
}
template <>
const KernelTable<double>& cpu_kernels<double>(InstructionSet set) {
  if (set == InstructionSet::kAvx512) return avx512::double_kernels;
  return set == InstructionSet::kAvx2 ? avx2::double_kernels : generic::double_kernels;
}

}  // namespace ringlet::kernels
