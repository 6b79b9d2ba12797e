// The contacts of hair against hair for one instruction set: compiled once for each, with RINGLET_ISA naming
// it (kernels/CMakeLists.txt).
#include "kernels/contact/hair_contacts.h"
#include "kernels/launch/contacts.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {
namespace {

template <class R>
struct Contacts {
  using On = HairContacts<Host, FloatPack, R>;

  static On* of(HairContactMemory* memory) { return reinterpret_cast<On*>(memory); }
  static HairContactMemory* make(HostThreads threads) {
    return reinterpret_cast<HairContactMemory*>(new On(threads));
  }
  static void destroy(HairContactMemory* memory) { delete of(memory); }
  static std::size_t bytes(const HairContactMemory* memory) {
    return reinterpret_cast<const On*>(memory)->bytes();
  }
  static HairContactFigures begin(HairContactMemory* memory, const HairContactStep<Scalar<R>>& step) {
    return of(memory)->begin(step);
  }
  static void pass(HairContactMemory* memory, const HairContactStep<Scalar<R>>& step,
                   HairContactFigures& figures) {
    of(memory)->pass(step, figures);
  }
  static constexpr HairContactTable<Scalar<R>> kTable = {make, destroy, bytes, begin, pass};
};

}  // namespace

extern const HairContactTable<float> float_hair_contacts;
extern const HairContactTable<double> double_hair_contacts;
const HairContactTable<float> float_hair_contacts = Contacts<FloatPack>::kTable;
const HairContactTable<double> double_hair_contacts = Contacts<DoublePack>::kTable;

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
