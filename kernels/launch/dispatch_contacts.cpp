#include "kernels/launch/contacts.h"

namespace ringlet::kernels {

#define RINGLET_DECLARE(isa)                                      \
  namespace isa {                                                 \
  HairContacts<float>* new_float_contacts(HostThreads threads);   \
  HairContacts<double>* new_double_contacts(HostThreads threads); \
  }
RINGLET_DECLARE(generic)
RINGLET_DECLARE(avx2)
RINGLET_DECLARE(avx512)
#undef RINGLET_DECLARE

// Here and not in the class: it must not be compiled for an instruction set.
template <class T>
HairContacts<T>::~HairContacts() = default;
template class HairContacts<float>;
template class HairContacts<double>;

template <>
std::unique_ptr<HairContacts<float>> make_hair_contacts(InstructionSet set, HostThreads threads) {
  const auto make = set == InstructionSet::kAvx512 ? avx512::new_float_contacts
                    : set == InstructionSet::kAvx2 ? avx2::new_float_contacts
                                                   : generic::new_float_contacts;
  return std::unique_ptr<HairContacts<float>>(make(threads));
}
template <>
std::unique_ptr<HairContacts<double>> make_hair_contacts(InstructionSet set, HostThreads threads) {
  const auto make = set == InstructionSet::kAvx512 ? avx512::new_double_contacts
                    : set == InstructionSet::kAvx2 ? avx2::new_double_contacts
                                                   : generic::new_double_contacts;
  return std::unique_ptr<HairContacts<double>>(make(threads));
}

}  // namespace ringlet::kernels
