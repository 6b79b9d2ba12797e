#include "effects/strands/strand_stage.h"

#include <Eigen/Core>
#include <algorithm>

#include "effects/strands/tension_curve.h"

namespace ringlet::effects {

using kernels::kLanes;

template <class T>
kernels::StrandParameters<T> strand_parameters(const scene::Scene& scene) {
  const scene::Model& model = scene.model;
  const Vec3 gravity = scene.effects.gravity.value_or(Vec3::Zero());
  kernels::StrandParameters<T> p{};
  for (int c = 0; c < 3; ++c) p.gravity[c] = static_cast<T>(gravity[c]);
  p.stiffness[kernels::kEdge] = static_cast<T>(model.stiffness.edge);
  p.stiffness[kernels::kBend] = static_cast<T>(model.stiffness.bend);
  p.stiffness[kernels::kTwist] = static_cast<T>(model.stiffness.twist);
  p.stiffness[kernels::kIntegrity] = static_cast<T>(model.stiffness.integrity);
  p.stiffness[kernels::kAngular] = static_cast<T>(model.stiffness.angular);
  p.drag = static_cast<T>(model.drag);
  p.damping = static_cast<T>(model.material_damping);
  p.geometric_stiffness = model.geometric_stiffness ? T(1) : T(0);
  p.consistent_angular = model.angular_tangent == scene::AngularTangent::kConsistent;
  p.exact_integrity = model.integrity_tangent == scene::IntegrityTangent::kExact;
  p.clamped = model.clamped_particles;
  if (const auto& lengths = scene.effects.inextensible) {
    p.length_iterations = lengths->max_iterations;
    p.length_tolerance = static_cast<T>(lengths->tolerance);
    const bool asked = lengths->metric == scene::LengthMetric::kStep ||
                       (lengths->metric == scene::LengthMetric::kAuto && model.substep_choice);
    // Once a frame the displacement is that of many steps, and none has its matrix.
    p.lengths_in_step = asked && lengths->cadence == scene::Cadence::kSubstep;
  }
  p.strain_limit = static_cast<T>(scene.limits.edge_strain);
  p.speed_limit = static_cast<T>(scene.limits.speed);
  return p;
}

namespace {

// The drag law of the scene's wind, without the air.
template <class T>
kernels::Air<T> drag_law(const scene::Scene& scene) {
  kernels::Air<T> air{};
  if (!scene.effects.wind) return air;
  const scene::Wind& wind = *scene.effects.wind;
  const double per_density = 1 / (wind.linear_density * scene.model.particle_mass);
  air.normal[0] = static_cast<T>(wind.normal.linear * per_density);
  air.normal[1] = static_cast<T>(wind.normal.quadratic * per_density);
  air.tangential[0] = static_cast<T>(wind.tangential.linear * per_density);
  air.tangential[1] = static_cast<T>(wind.tangential.quadratic * per_density);
  return air;
}

template <class T>
class StrandStage : public Stage<T> {
 public:
  StrandStage(const scene::Scene& scene, const state::StrandModel<T>& model, state::StrandState<T>& state)
      : model_(model),
        state_(state),
        parameters_(strand_parameters<T>(scene)),
        lengths_at_frame_end_(scene.effects.inextensible &&
                              scene.effects.inextensible->cadence == scene::Cadence::kFrame),
        air_(drag_law<T>(scene)),
        figures_(static_cast<std::size_t>(model.layout.batches()) * kernels::kFigures * kLanes) {
    if (const auto& softening = scene.effects.non_hookean) {
      state_.elongation.assign(state_.position.size() / 3, T(0));
      elongation_ = {nullptr, tension_curve<T>(softening->curve),
                     softening->memory == scene::Memory::kPermanent};
    }
  }

  const char* name() const override { return "strands"; }
  std::size_t bytes() const override { return model_.bytes() + state_.bytes() + figures_.size() * sizeof(T); }
  Launches launches(int substeps) const override { return {substeps, substeps}; }
  std::int64_t diverged_strand() const override { return diverged_; }

  void run(Executor<T>& executor, const Substep& substep, FrameReport& report) override {
    kernels::StrandStep<T> step{model_.view(), state_.view(), state_.root_motion.data(), parameters_,
                                figures_.data()};
    step.parameters.step = static_cast<T>(substep.step);
    if (lengths_at_frame_end_ && !substep.last_of_frame) step.parameters.length_iterations = 0;
    if (lengths_at_frame_end_) step.parameters.skipped_substeps = substep.substeps - 1;
    step.elongation = elongation_, step.air = air_;
    if (!state_.elongation.empty()) step.elongation.memory = state_.elongation.data();
    if (!state_.air.empty()) step.air.velocity = state_.air.data();
    executor.strand_step(step);
    gather(substep, report);
  }

 private:
  using Lanes = Eigen::Map<const Eigen::Array<T, kLanes, 1>, Eigen::Aligned64>;

  // A batch at a time: lanes without a strand have figures of zero.
  void gather(const Substep& substep, FrameReport& report) {
    bool diverged = false;
    for (std::int32_t batch = 0; batch < model_.layout.batches(); ++batch) {
      const auto figure = [&](int which) {
        return Lanes(figures_.data() + (batch * std::size_t{kernels::kFigures} + which) * kLanes);
      };
      const Lanes iterations = figure(kernels::kIterations);
      report.length_iterations += static_cast<double>(iterations.sum());  // small integers: exact
      report.most_length_iterations =
          std::max(report.most_length_iterations, static_cast<double>(iterations.maxCoeff()));
      const Lanes pieces = figure(kernels::kSubdivisions);
      if (pieces.maxCoeff() > T(1)) report.subdivided += static_cast<double>((pieces > T(1)).count());
      report.speed = std::max(report.speed, static_cast<double>(figure(kernels::kSpeed).maxCoeff()));
      diverged = diverged || figure(kernels::kDiverged).maxCoeff() > T(0);
    }
    diverged_ = -1;
    if (!diverged && !substep.last_of_frame) return;
    for (std::size_t strand = 0; strand < model_.layout.strands(); ++strand) {
      const auto figure = [&](int which) {
        return figures_[model_.layout.at_strand(strand, kernels::kFigures, which)];
      };
      report.strain[strand] = static_cast<float>(figure(kernels::kStrain));
      if (diverged_ < 0 && figure(kernels::kDiverged) > T(0)) diverged_ = static_cast<std::int64_t>(strand);
    }
  }

  const state::StrandModel<T>& model_;
  state::StrandState<T>& state_;
  kernels::StrandParameters<T> parameters_;
  bool lengths_at_frame_end_;
  kernels::Elongation<T> elongation_{};
  kernels::Air<T> air_;
  state::AlignedVector<T> figures_;
  std::int64_t diverged_ = -1;
};

}  // namespace

template <class T>
std::unique_ptr<Stage<T>> make_strand_stage(const scene::Scene& scene, const state::StrandModel<T>& model,
                                            state::StrandState<T>& state) {
  return std::make_unique<StrandStage<T>>(scene, model, state);
}

template kernels::StrandParameters<float> strand_parameters(const scene::Scene&);
template kernels::StrandParameters<double> strand_parameters(const scene::Scene&);
template std::unique_ptr<Stage<float>> make_strand_stage(const scene::Scene&,
                                                         const state::StrandModel<float>&,
                                                         state::StrandState<float>&);
template std::unique_ptr<Stage<double>> make_strand_stage(const scene::Scene&,
                                                          const state::StrandModel<double>&,
                                                          state::StrandState<double>&);

}  // namespace ringlet::effects
