// What hair against hair shares with the rest: radii, lengths held after it, the wind that gets through it.
#include <gtest/gtest.h>

#include <cmath>

#include "effects/lengths.h"
#include "effects/wind/wind_stage.h"

namespace ringlet::effects {
namespace {

// Straight strands of 2, 3, ... particles, 1 cm apart, 40 in all.
state::StrandInput straight_strands() {
  state::StrandInput input;
  for (int s = 0; s < 40; ++s) {
    input.counts.push_back(2 + s % 7);
    for (int i = 0; i < input.counts.back(); ++i) input.rest.emplace_back(0.01 * i, 0, 0.1 * s);
  }
  return input;
}

struct Hair {
  explicit Hair(state::StrandInput input = straight_strands())
      : model(input), state(model), executor(make_cpu_executor<double>(model, "")) {
    for (std::size_t s = 0; s < model.layout.strands(); ++s)
      roots.push_back({Mat3::Identity(), {0, 0, 0.1 * s}});
    state::pose_at_rest<double>(state, model, roots);
    scene.model.clamped_particles = 1, scene.model.substeps = 4;
    scene.limits = {1, 50};
    report.strain.assign(model.layout.strands(), -1.0f);
  }
  double& position(std::size_t strand, int particle, int c) {
    return state.position[model.layout.at(strand, particle, 3, c)];
  }
  double& velocity(std::size_t strand, int particle, int c) {
    return state.velocity[model.layout.at(strand, particle, 3, c)];
  }

  state::StrandModel<double> model;
  state::StrandState<double> state;
  std::unique_ptr<Executor<double>> executor;
  std::vector<Pose> roots;
  scene::Scene scene{};
  FrameReport report;
};

constexpr Substep kMiddle{2, 0, 0.01, 0.01, false, false, 4}, kLast{2, 0, 0.01, 0.01, false, true, 4};

TEST(Radius, IsThatOfEveryParticleAndTakesNothingWhereNothingAsks) {
  state::StrandInput input = straight_strands();
  const state::StrandModel<float> without(input);
  for (std::size_t i = 0; i < input.rest.size(); ++i) input.radius.push_back(1e-5f * static_cast<float>(i));
  state::StrandModel<float> with(input);
  EXPECT_TRUE(without.radius.empty());
  EXPECT_EQ(with.bytes() - without.bytes(), with.layout.rows() * kernels::kLanes * sizeof(float));
  const auto expect_radii = [&] {
    std::size_t particle = 0;
    for (std::size_t s = 0; s < input.counts.size(); ++s)
      for (int i = 0; i < input.counts[s]; ++i, ++particle)
        EXPECT_EQ(with.radius[with.layout.at(s, i, 1, 0)], input.radius[particle]) << s << " " << i;
  };
  expect_radii();
  const std::vector<Vec3> cut = {Vec3::Zero(), Vec3(0.004, 0, 0)};
  with.set_shape(6, cut);
  expect_radii();
}

TEST(Lengths, AreHeldWithTheScenesToleranceAndTold) {
  Hair run;
  run.scene.effects.inextensible = {1e-6, 8, scene::LengthMetric::kMass, scene::Cadence::kSubstep};
  run.position(3, 2, 0) += 0.002;
  run.velocity(5, 1, 1) = 7;
  Lengths<double> lengths(run.scene, run.model, run.state);
  lengths.hold(*run.executor, kMiddle, 0.04, run.report);
  const double last = run.position(3, 2, 0) - run.position(3, 1, 0);
  EXPECT_NEAR(last, 0.01, 1e-8);
  EXPECT_NEAR(run.velocity(3, 2, 0), (run.position(3, 2, 0) - 0.022) / 0.04, 1e-12) << "over 0.04 s";
  for (std::size_t s = 0; s < run.report.strain.size(); ++s)
    EXPECT_TRUE(run.report.strain[s] >= 0 && run.report.strain[s] <= 1e-6) << s;
  EXPECT_EQ(run.report.speed, 7);
  EXPECT_EQ(run.report.length_iterations, 0) << "those are the strand step's";
  EXPECT_EQ(lengths.diverged_strand(), -1);
}

TEST(Lengths, AreLeftAloneWhereTheSceneDoesNotHoldThemNow) {
  for (const bool at_frame_end : {false, true}) {
    Hair run;
    if (at_frame_end)
      run.scene.effects.inextensible = {1e-6, 8, scene::LengthMetric::kMass, scene::Cadence::kFrame};
    run.position(3, 2, 0) += 0.002;
    const auto before = run.state.position;
    Lengths<double> lengths(run.scene, run.model, run.state);
    lengths.hold(*run.executor, kMiddle, 0.04, run.report);
    EXPECT_EQ(run.state.position, before);
    EXPECT_NEAR(run.report.strain[3], 0.2, 1e-6);
    lengths.hold(*run.executor, kLast, 0.04, run.report);
    EXPECT_EQ(run.state.position != before, at_frame_end);
  }
}

TEST(Lengths, NameTheFirstStrandThatDiverged) {
  Hair run;
  run.scene.effects.inextensible = {1e-4, 8, scene::LengthMetric::kMass, scene::Cadence::kSubstep};
  Lengths<double> lengths(run.scene, run.model, run.state);
  run.velocity(21, 1, 1) = 51, run.position(30, 1, 2) = std::nan("");
  lengths.hold(*run.executor, kMiddle, 0.04, run.report);
  EXPECT_EQ(lengths.diverged_strand(), 21);
  run.velocity(21, 1, 1) = 0;
  lengths.hold(*run.executor, kMiddle, 0.04, run.report);
  EXPECT_EQ(lengths.diverged_strand(), 30);
}

TEST(WindThroughHair, IsTheShareThatItsShelterSays) {
  Hair run;
  run.scene.effects.wind.emplace();
  run.scene.effects.wind->keys = {{1, {2, -1, 4}}};
  run.scene.frames = {1, 10, 24, 0};
  const auto stage = make_wind_stage<double>(run.scene, nullptr, Vec3::Zero(), run.model, run.state);
  const auto expect_air = [&](const auto& share) {
    stage->run(*run.executor, kLast, run.report);
    for (std::size_t s = 0; s < run.model.layout.strands(); ++s)
      for (int i = 0; i + 1 < run.model.layout.count(s); ++i)
        for (int c = 0; c < 3; ++c)
          EXPECT_EQ(run.state.air[run.model.layout.at(s, i, 3, c)], share(s, i) * Vec3(2, -1, 4)[c]) << s;
  };
  expect_air([](std::size_t, int) { return 1.0; });
  EXPECT_EQ(run.state.wind, Vec3(2, -1, 4));
  const auto share = [](std::size_t s, int i) { return 1 / (1.0 + static_cast<double>(s) + i); };
  run.state.shelter.assign(run.state.position.size() / 3, 1.0);
  for (std::size_t s = 0; s < run.model.layout.strands(); ++s)
    for (int i = 0; i < run.model.layout.count(s); ++i)
      run.state.shelter[run.model.layout.at(s, i, 1, 0)] = share(s, i);
  expect_air(share);
  state::pose_at_rest<double>(run.state, run.model, run.roots);
  expect_air([](std::size_t, int) { return 1.0; });
}

}  // namespace
}  // namespace ringlet::effects
