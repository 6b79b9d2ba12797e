// The kernels for one instruction set: compiled once for each, with RINGLET_ISA naming it
// (kernels/CMakeLists.txt).
#include "kernels/backend/pack.h"
#include "kernels/launch/launch.h"
#include "kernels/solid/response.h"
#include "kernels/strand/length_step.h"
#include "kernels/strand/strand_models.h"
#include "kernels/wind/shelter.h"
#include "kernels/wind/wind_step.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {
namespace {

static_assert(kStepReals <= kMostScratchReals && kMassSpringReals <= kMostScratchReals &&
              kContactReals <= kMostScratchReals && kLengthReals <= kMostScratchReals);

template <class R>
void strand_step(const StrandStep<Scalar<R>>& step, int begin, int end, Scalar<R>* scratch) {
  constexpr int kWidth = Traits<R>::kWidth;
  with_strand_model(step, [&](auto model) {
    using Model = typename decltype(model)::template For<R>;
    for (int batch = begin; batch < end; ++batch)
      for (int lane = 0; lane < kLanes; lane += kWidth)
        step_strands<Model, R>(step, batch, lane, scratch, kWidth);
  });
}

template <class R>
void contact_step(const ContactStep<Scalar<R>>& step, int begin, int end, Scalar<R>* scratch) {
  constexpr int kWidth = Traits<R>::kWidth;
  for (int batch = begin; batch < end; ++batch)
    for (int lane = 0; lane < kLanes; lane += kWidth) collide_strands<R>(step, batch, lane, scratch, kWidth);
}

template <class R>
void wind_step(const WindStep<Scalar<R>>& step, int begin, int end, Scalar<R>*) {
  for (int batch = begin; batch < end; ++batch)
    for (int lane = 0; lane < kLanes; lane += Traits<R>::kWidth) blow<R>(step, batch, lane);
}

template <class T>
void shelter_step(const ShelterStep<T>& step, int begin, int end, T*) {
  for (int batch = begin; batch < end; ++batch)
    for (int lane = 0; lane < kLanes; ++lane) shelter_strand(step, batch, lane);
}

template <class R>
void length_step(const LengthStep<Scalar<R>>& step, int begin, int end, Scalar<R>* scratch) {
  constexpr int kWidth = Traits<R>::kWidth;
  for (int batch = begin; batch < end; ++batch)
    for (int lane = 0; lane < kLanes; lane += kWidth) hold_lengths<R>(step, batch, lane, scratch, kWidth);
}

}  // namespace

extern const KernelTable<float> float_kernels;
extern const KernelTable<double> double_kernels;
const KernelTable<float> float_kernels = {strand_step<FloatPack>, contact_step<FloatPack>,
                                          wind_step<FloatPack>, shelter_step<float>, length_step<FloatPack>};
const KernelTable<double> double_kernels = {strand_step<DoublePack>, contact_step<DoublePack>,
                                            wind_step<DoublePack>, shelter_step<double>,
                                            length_step<DoublePack>};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
