#include "kernels/launch/contacts.h"

namespace ringlet::kernels {

#define RINGLET_DECLARE(isa)                                  \
  namespace isa {                                             \
  extern const HairContactTable<float> float_hair_contacts;   \
  extern const HairContactTable<double> double_hair_contacts; \
  }
RINGLET_DECLARE(generic)
RINGLET_DECLARE(avx2)
RINGLET_DECLARE(avx512)
#undef RINGLET_DECLARE

template <>
const HairContactTable<float>& cpu_hair_contacts<float>(InstructionSet set) {
  if (set == InstructionSet::kAvx512) return avx512::float_hair_contacts;
  return set == InstructionSet::kAvx2 ? avx2::float_hair_contacts : generic::float_hair_contacts;
}
template <>
const HairContactTable<double>& cpu_hair_contacts<double>(InstructionSet set) {
  if (set == InstructionSet::kAvx512) return avx512::double_hair_contacts;
  return set == InstructionSet::kAvx2 ? avx2::double_hair_contacts : generic::double_hair_contacts;
}

}  // namespace ringlet::kernels
