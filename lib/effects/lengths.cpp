#include "effects/lengths.h"

#include <algorithm>

#include "kernels/strand/length_step.h"

namespace ringlet::effects {

template <class T>
Lengths<T>::Lengths(const scene::Scene& scene, const state::StrandModel<T>& model,
                    state::StrandState<T>& state)
    : scene_(scene),
      model_(model),
      state_(state),
      figures_(static_cast<std::size_t>(model.layout.batches()) * kernels::kLengthFigures * kernels::kLanes) {
}

template <class T>
void Lengths<T>::hold(Executor<T>& executor, const Substep& substep, double seconds, FrameReport& report) {
  kernels::LengthStep<T> step{};
  step.batches = model_.view();
  step.state = state_.view();
  step.step = static_cast<T>(seconds);
  step.clamped = scene_.model.clamped_particles;
  const auto& lengths = scene_.effects.inextensible;
  if (lengths && (lengths->cadence == scene::Cadence::kSubstep || substep.last_of_frame)) {
    step.iterations = lengths->max_iterations;
    step.tolerance = static_cast<T>(lengths->tolerance);
  }
  step.figures = figures_.data();
  step.strain_limit = static_cast<T>(scene_.limits.edge_strain);
  step.speed_limit = static_cast<T>(scene_.limits.speed);
  executor.length_step(step);

  diverged_ = -1;
  for (std::size_t strand = 0; strand < model_.layout.strands(); ++strand) {
    const auto figure = [&](int which) {
      return figures_[model_.layout.at_strand(strand, kernels::kLengthFigures, which)];
    };
    report.strain[strand] = static_cast<float>(figure(kernels::kLengthStrain));
    report.speed = std::max(report.speed, static_cast<double>(figure(kernels::kLengthSpeed)));
    if (diverged_ < 0 && figure(kernels::kLengthDiverged) > T(0))
      diverged_ = static_cast<std::int64_t>(strand);
  }
}

template class Lengths<float>;
template class Lengths<double>;

}  // namespace ringlet::effects
