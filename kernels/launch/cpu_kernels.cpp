// The kernels for one instruction set: compiled once for each, with RINGLET_ISA naming it
// (kernels/CMakeLists.txt).
#include "kernels/backend/pack.h"
#include "kernels/launch/launch.h"
#include "kernels/solid/response.h"
#include "kernels/strand/strand_step.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {
namespace {

template <class R>
void strand_step(const StrandStep<Scalar<R>>& step, int begin, int end, Scalar<R>* scratch) {
  constexpr int kWidth = Traits<R>::kWidth;
  for (int batch = begin; batch < end; ++batch)
    for (int lane = 0; lane < kLanes; lane += kWidth) step_strands<R>(step, batch, lane, scratch, kWidth);
}

template <class R>
void contact_step(const ContactStep<Scalar<R>>& step, int begin, int end, Scalar<R>* scratch) {
  constexpr int kWidth = Traits<R>::kWidth;
  for (int batch = begin; batch < end; ++batch)
    for (int lane = 0; lane < kLanes; lane += kWidth) collide_strands<R>(step, batch, lane, scratch, kWidth);
}

}  // namespace

extern const KernelTable<float> float_kernels;
extern const KernelTable<double> double_kernels;
const KernelTable<float> float_kernels = {strand_step<FloatPack>, contact_step<FloatPack>};
const KernelTable<double> double_kernels = {strand_step<DoublePack>, contact_step<DoublePack>};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
