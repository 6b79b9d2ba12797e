// Grooms and a solid for comparing the CUDA kernels with the same source run on the host, strand by strand.
#pragma once
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "kernels/solid/response.h"
#include "kernels/strand/strand_models.h"
#include "state/strand_model.h"

namespace ringlet::cuda_testing {

using kernels::kContactFigures;
using kernels::kFigures;
using kernels::kLanes;

inline kernels::StrandParameters<float> default_parameters() {
  return {.step = 1.0f / 240,
          .gravity = {0, -9.81f, 0},
          .stiffness = {1e6f, 1e6f, 1e6f, 1e2f, 1e2f},
          .drag = 0.5f,
          .damping = 1.0f / 240,
          .geometric_stiffness = 1,
          .consistent_angular = true,
          .exact_integrity = true,
          .clamped = 1,
          .length_iterations = 3,
          .length_tolerance = 1e-4f,
          .lengths_in_step = true,
          .skipped_substeps = 0,
          .strain_limit = 10,
          .speed_limit = 1000};
}

// What a groom is made of: `strands` helices, or strands of random shape and stiffness with 1 to 64
// particles.
inline state::StrandInput helices(int strands) {
  state::StrandInput input;
  input.preload = Vec3(0, -9.81, 0);
  constexpr int kParticles = 30;
  for (int s = 0; s < strands; ++s) {
    input.counts.push_back(kParticles);
    input.first_rotation.push_back(Mat3::Identity());
    for (int i = 0; i < kParticles; ++i) {
      const double t = i / (kParticles - 1.0), angle = (4 + 0.1 * s) * 2 * std::numbers::pi * t;
      input.rest.emplace_back(0.3 * t, 0.02 * (std::cos(angle) - 1), 0.02 * std::sin(angle));
    }
  }
  return input;
}
inline state::StrandInput mixed_strands(int strands, unsigned seed) {
  state::StrandInput input;
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto random_vector = [&] { return Vec3(uniform(generator), uniform(generator), uniform(generator)); };
  for (int s = 0; s < strands; ++s) {
    const int count = std::uniform_int_distribution<int>(1, 64)(generator);
    input.counts.push_back(count);
    input.first_rotation.push_back(Mat3::Identity());
    Vec3 at = random_vector();
    for (int i = 0; i < count; ++i) {
      input.rest.push_back(at);
      at += Vec3(0.01, 0, 0) + 0.005 * random_vector();
      for (const double stiffness : {1e6, 1e6, 1e6, 1e2, 1e2})
        input.stiffness.push_back(static_cast<float>(stiffness * (1 + 0.5 * uniform(generator))));
    }
  }
  return input;
}

// A groom in motion on the host, stepped by the kernels' source with R = float, one lane after the other.
struct HostGroom {
  state::StrandModel<float> model;
  state::StrandState<float> state;
  state::AlignedVector<float> strand_figures, contact_figures;
  state::AlignedVector<std::int32_t> skin;
  kernels::Elongation<float> elongation{};
  kernels::Air<float> air{};
  int substep = 0;

  explicit HostGroom(const state::StrandInput& input)
      : model(input),
        state(model),
        strand_figures(lanes() * kFigures),
        contact_figures(lanes() * kContactFigures),
        skin(lanes(), kernels::kNoSkin),
        scratch_(static_cast<std::size_t>(model.layout.longest()) *
                 std::max(kernels::kMassSpringReals, kernels::kContactReals)) {
    pose_at_rest(state, model, roots(0));
  }

  std::size_t lanes() const { return static_cast<std::size_t>(model.layout.batches()) * kLanes; }

  // Every root turns and travels on its own.
  std::vector<Pose> roots(double time) const {
    std::vector<Pose> poses(model.layout.strands());
    for (std::size_t s = 0; s < poses.size(); ++s) {
      const double swing = std::sin(9 * time + 0.1 * s);
      const Vec3 axis = Vec3(1, 0.3 * (s % 7), 0.2 * (s % 5)).normalized();
      poses[s].rotation = Eigen::AngleAxisd(0.5 * swing, axis).toRotationMatrix();
      poses[s].position = Vec3(0.05 * swing, 0.02 * (s % 11), 0.01 * swing + 0.03 * (s % 3));
    }
    return poses;
  }
  // From now on integrity softens and breaks (the input asks for elongation), and air drags that moves with
  // another velocity at every segment.
  void soften_and_blow() {
    state.elongation.assign(state.position.size() / 3, 0.0f);
    elongation = {state.elongation.data(), {1, 0.005f, 0.02f, {0.005f}, {{0.005f, 1, -20, 0}}}, true};
    state.air.resize(state.position.size());
    for (std::size_t k = 0; k < state.air.size(); ++k) state.air[k] = static_cast<float>(k % 17) - 8;
    air = {state.air.data(), {46, 9.6f}, {22, 0.1f}};
  }
  // The next substep's root motion, into the state.
  void move_roots(double h) {
    const std::vector<Pose> before = roots(substep * h), after = roots((substep + 1) * h);
    for (std::size_t s = 0; s < before.size(); ++s)
      set_root_motion(state, model.layout, s, before[s], after[s]);
    ++substep;
  }

  kernels::StrandStep<float> strand_step(const kernels::StrandParameters<float>& parameters) {
    return {model.view(), state.view(), state.root_motion.data(), parameters, strand_figures.data(),
            elongation,   air};
  }
  void step(const kernels::StrandParameters<float>& parameters) {
    for_each_lane([&, step = strand_step(parameters)](int batch, int lane) {
      kernels::with_strand_model(step, [&](auto model) {
        using Model = typename decltype(model)::template For<float>;
        kernels::step_strands<Model, float>(step, batch, lane, scratch_.data(), 1);
      });
    });
  }

  kernels::ContactStep<float> contact_step(std::span<const kernels::SolidView> solids, float h) {
    return {.batches = model.view(),
            .state = state.view(),
            .root_points = state.root_points.data(),
            .skin = skin.data(),
            .solids = solids.data(),
            .solid_count = static_cast<std::int32_t>(solids.size()),
            .home = 0,
            .step = h,
            .clamped = 1,
            .rounds = 4,
            .length_iterations = 3,
            .length_tolerance = 1e-4f,
            .figures = contact_figures.data(),
            .strain_limit = 10,
            .speed_limit = 1000,
            .skipped_substeps = 0,
            .touches = state.touches.empty() ? nullptr : state.touches.data()};
  }
  void collide(std::span<const kernels::SolidView> solids, float h) {
    for_each_lane([&, step = contact_step(solids, h)](int batch, int lane) {
      kernels::collide_strands<float>(step, batch, lane, scratch_.data(), 1);
    });
  }

 private:
  template <class Function>
  void for_each_lane(const Function& function) {
    for (int batch = 0; batch < model.layout.batches(); ++batch)
      for (int lane = 0; lane < kLanes; ++lane) function(batch, lane);
  }

  std::vector<float> scratch_;
};

}  // namespace ringlet::cuda_testing
