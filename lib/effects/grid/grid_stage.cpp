#include "effects/grid/grid_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/log.h"
#include "effects/grid/moving_axes.h"
#include "effects/lengths.h"
#include "kernels/grid/hair_grid.h"

namespace ringlet::effects {
namespace {

template <class T>
class GridStage : public Stage<T> {
 public:
  GridStage(const scene::Scene& scene, std::vector<solids::Solid>& solids, const state::StrandModel<T>& model,
            state::StrandState<T>& state, Executor<T>& executor)
      : scene_(scene),
        options_(*scene.effects.hair_hair->grid),
        solids_(solids),
        model_(model),
        state_(state),
        views_(solids.size()),
        lengths_(scene, model, state),
        grid_(executor.make_hair_grid()) {
    if (options_.shelter) state_.shelter.assign(state_.position.size() / 3, T(1));
  }

  const char* name() const override { return "grid"; }
  std::size_t bytes() const override {
    return grid_->bytes() + lengths_.bytes() + views_.size() * sizeof(kernels::SolidView);
  }
  // Of the lengths: how many the grid has depends on what it finds.
  Launches launches(int substeps) const override { return {0, each_substep() ? substeps : 1}; }
  std::int64_t diverged_strand() const override { return diverged_; }

  void at_rest(Executor<T>& executor, const state::StrandState<T>& rest) override {
    grid_ = executor.make_hair_grid();  // the executor may be another than before
    const double side = longest_side(model_, rest, moving_axes(model_, rest, 1, 1));
    cell_ = side > 0 ? side / options_.resolution : 1;
    kernels::GridStep<T> step =
        step_of(1 / (scene_.frames.fps * scene_.model.substeps), scene_.model.substeps);
    step.axes = moving_axes(model_, rest, cell_, step.substep);
    state::StrandState<T> posed = rest;  // only read
    step.state = posed.view();
    step.root_points = rest.root_points.data();
    step.solid_count = 0;  // they take no part in the rest state
    grid_->at_rest(step);
  }

  void run(Executor<T>& executor, const Substep& substep, FrameReport& report) override {
    diverged_ = -1;
    if (!substep.last_of_frame && !each_substep()) return;
    for (std::size_t k = 0; k < solids_.size(); ++k)
      views_[k] = solids_[k].at(substep.time_before, substep.time);
    kernels::GridStep<T> step = step_of(substep.step, substep.substeps);
    step.axes = moving_axes(model_, state_, cell_, substep.step);
    step.frame = substep.frame;
    const kernels::GridFigures figures = grid_->run(step);
    if (options_.shelter) find_shelter();
    if (figures.moved) {
      lengths_.hold(executor, substep, step.interval, report);
      diverged_ = lengths_.diverged_strand();
    }
    gather(figures, report);
    if (figures.residual > options_.residual && !told_)
      log_info(fmt::format(
          "frame {}: the grid's pressure has a residual of {:.2g} left after {} iterations, asked "
          "for {:.2g}: more max_iterations would do",
          substep.frame, figures.residual, options_.max_iterations, options_.residual));
    told_ = told_ || figures.residual > options_.residual;
  }

 private:
  bool each_substep() const { return options_.cadence == scene::Cadence::kSubstep; }

  kernels::GridStep<T> step_of(double substep, int substeps) {
    kernels::GridStep<T> step{};
    step.batches = model_.view();
    step.state = state_.view();
    step.root_points = state_.root_points.data();
    const int runs = each_substep() ? substeps : 1;  // a frame
    step.interval = substep * substeps / runs;
    step.substep = substep;
    step.pic = static_cast<T>(1 - std::pow(1 - options_.pic, 1.0 / runs));
    step.residual = options_.residual;
    step.most_iterations = options_.max_iterations;
    step.passes = options_.passes;
    step.clamped = scene_.model.clamped_particles;
    step.solids = views_.data();
    step.solid_count = static_cast<std::int32_t>(views_.size());
    return step;
  }

  void find_shelter() {
    kernels::HairShelter<T> shelter{};
    for (int c = 0; c < 3; ++c) shelter.wind[c] = state_.wind[c];
    shelter.strength = *options_.shelter;
    shelter.radius = mean_radius(model_);
    shelter.share = state_.shelter.data();
    grid_->shelter(shelter);
  }

  void gather(const kernels::GridFigures& figures, FrameReport& report) const {
    report.grid_solves += figures.solves, report.grid_iterations += figures.iterations;
    report.grid_residual = std::max(report.grid_residual, figures.residual);
    report.grid_density = figures.density;
    report.grid_cells = std::max(report.grid_cells, figures.cells);
  }

  const scene::Scene& scene_;
  const scene::HairGrid& options_;
  std::vector<solids::Solid>& solids_;
  const state::StrandModel<T>& model_;
  state::StrandState<T>& state_;
  std::vector<kernels::SolidView> views_;
  Lengths<T> lengths_;
  std::unique_ptr<kernels::HairGrid<T>> grid_;
  double cell_ = 1;  // [m]
  std::int64_t diverged_ = -1;
  bool told_ = false;  // that a residual was left
};

}  // namespace

template <class T>
std::unique_ptr<Stage<T>> make_grid_stage(const scene::Scene& scene, std::vector<solids::Solid>& solids,
                                          const state::StrandModel<T>& model, state::StrandState<T>& state,
                                          Executor<T>& executor) {
  return std::make_unique<GridStage<T>>(scene, solids, model, state, executor);
}

template std::unique_ptr<Stage<float>> make_grid_stage(const scene::Scene&, std::vector<solids::Solid>&,
                                                       const state::StrandModel<float>&,
                                                       state::StrandState<float>&, Executor<float>&);
template std::unique_ptr<Stage<double>> make_grid_stage(const scene::Scene&, std::vector<solids::Solid>&,
                                                        const state::StrandModel<double>&,
                                                        state::StrandState<double>&, Executor<double>&);

}  // namespace ringlet::effects
