// The contacts of hair against hair for one instruction set: compiled once for each, with RINGLET_ISA naming
// it (kernels/CMakeLists.txt).
#include "kernels/backend/host.h"
#include "kernels/contact/contact_solver.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

HairContacts<float>* new_float_contacts(HostThreads threads) {
  return new ContactSolver<Host, FloatPack, FloatPack>(threads);
}
HairContacts<double>* new_double_contacts(HostThreads threads) {
  return new ContactSolver<Host, FloatPack, DoublePack>(threads);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
