#include "effects/solids/contact_stage.h"

#include <algorithm>

#include "kernels/solid/response.h"

namespace ringlet::effects {
namespace {

using kernels::kLanes;

template <class T>
class ContactStage : public Stage<T> {
 public:
  ContactStage(const scene::Scene& scene, std::vector<solids::Solid>& solids, const Skin& skin,
               const state::StrandModel<T>& model, state::StrandState<T>& state)
      : scene_(scene),
        solids_(solids),
        model_(model),
        state_(state),
        views_(solids.size()),
        home_(skin.home),
        skin_(static_cast<std::size_t>(model.layout.batches()) * kLanes, kernels::kNoSkin),
        figures_(static_cast<std::size_t>(model.layout.batches()) * kernels::kContactFigures * kLanes) {
    if (scene.effects.hair_hair && scene.effects.hair_hair->contacts)
      state_.touches.assign(model.layout.rows() * kernels::kTouchReals * kLanes, T(0));
    for (std::size_t strand = 0; strand < skin.triangles.size(); ++strand)
      skin_[model.layout.at_strand(strand, 1, 0)] = skin.triangles[strand];
  }

  const char* name() const override { return "solids"; }
  std::size_t bytes() const override {
    std::size_t total = skin_.size() * sizeof skin_[0] + figures_.size() * sizeof(T);
    for (const solids::Solid& solid : solids_) total += solid.bytes();
    return total;
  }
  Launches launches(int substeps) const override { return {substeps, substeps}; }
  std::int64_t diverged_strand() const override { return diverged_; }

  void run(Executor<T>& executor, const Substep& substep, FrameReport& report) override {
    for (std::size_t k = 0; k < solids_.size(); ++k)
      views_[k] = solids_[k].at(substep.time_before, substep.time);
    kernels::ContactStep<T> step{};
    step.batches = model_.view();
    step.state = state_.view();
    step.root_points = state_.root_points.data();
    step.skin = skin_.data();
    step.home = home_;
    step.solids = views_.data();
    step.solid_count = static_cast<std::int32_t>(views_.size());
    step.step = static_cast<T>(substep.step);
    step.clamped = scene_.model.clamped_particles;
    step.rounds = scene_.effects.collision.iterations;
    const auto& lengths = scene_.effects.inextensible;
    const bool project = lengths && (lengths->cadence == scene::Cadence::kSubstep || substep.last_of_frame);
    step.length_iterations = project ? lengths->max_iterations : 0;
    step.length_tolerance = project ? static_cast<T>(lengths->tolerance) : T(0);
    step.skipped_substeps = lengths && lengths->cadence == scene::Cadence::kFrame ? substep.substeps - 1 : 0;
    step.strain_limit = static_cast<T>(scene_.limits.edge_strain);
    step.speed_limit = static_cast<T>(scene_.limits.speed);
    step.figures = figures_.data();
    step.touches = state_.touches.empty() ? nullptr : state_.touches.data();
    executor.contact_step(step, substep.frame);
    gather(substep, report);
  }

 private:
  T figure(std::size_t strand, int which) const {
    return figures_[model_.layout.at_strand(strand, kernels::kContactFigures, which)];
  }

  void gather(const Substep& substep, FrameReport& report) {
    diverged_ = -1;
    for (std::size_t strand = 0; strand < model_.layout.strands(); ++strand) {
      report.swept += figure(strand, kernels::kSwept);
      if (!(figure(strand, kernels::kTouched) > T(0))) continue;
      report.moved[strand] = 1;
      report.speed = std::max(report.speed, static_cast<double>(figure(strand, kernels::kContactSpeed)));
      if (diverged_ < 0 && figure(strand, kernels::kContactDiverged) > T(0))
        diverged_ = static_cast<std::int64_t>(strand);
      report.strain[strand] = static_cast<float>(figure(strand, kernels::kContactStrain));
      report.contact_rounds =
          std::max(report.contact_rounds, static_cast<double>(figure(strand, kernels::kRounds)));
      if (substep.last_of_frame)
        report.pushed = std::max(report.pushed, static_cast<double>(figure(strand, kernels::kPushed)));
    }
  }

  const scene::Scene& scene_;
  std::vector<solids::Solid>& solids_;
  const state::StrandModel<T>& model_;
  state::StrandState<T>& state_;
  std::vector<kernels::SolidView> views_;
  std::int32_t home_;
  state::AlignedVector<std::int32_t> skin_;
  state::AlignedVector<T> figures_;
  std::int64_t diverged_ = -1;
};

}  // namespace

template <class T>
std::unique_ptr<Stage<T>> make_contact_stage(const scene::Scene& scene, std::vector<solids::Solid>& solids,
                                             const Skin& skin, const state::StrandModel<T>& model,
                                             state::StrandState<T>& state) {
  return std::make_unique<ContactStage<T>>(scene, solids, skin, model, state);
}

template std::unique_ptr<Stage<float>> make_contact_stage(const scene::Scene&, std::vector<solids::Solid>&,
                                                          const Skin&, const state::StrandModel<float>&,
                                                          state::StrandState<float>&);
template std::unique_ptr<Stage<double>> make_contact_stage(const scene::Scene&, std::vector<solids::Solid>&,
                                                           const Skin&, const state::StrandModel<double>&,
                                                           state::StrandState<double>&);

}  // namespace ringlet::effects
