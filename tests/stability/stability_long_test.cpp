// 100,000 steps of a still scene: hair stays where it is.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "stability/suite.h"

namespace ringlet::stability {
namespace {

constexpr double kSeconds = 100000 * kStep;

class Still : public testing::TestWithParam<std::tuple<Model, Machine, const char*>> {};

TEST_P(Still, NeitherDriftsNorGainsEnergy) {
  const auto& [model, machine, stiffness] = GetParam();
  // Mass springs hold nothing up: a strand that hangs straight down soon comes to rest. Two clamped
  // particles hold its turn about itself too, which nothing else does.
  const std::vector<Strand> hair = model == Model::kAms
                                       ? std::vector<Strand>{helix(Vec3::Zero(), Vec3(1, -1, 0), 6),
                                                             straight(Vec3::Zero(), Vec3::UnitX(), 4)}
                                       : std::vector<Strand>{straight(Vec3::Zero(), -Vec3::UnitY(), 4)};
  Scenario scenario{.model = model, .machine = machine, .hair = hair, .seconds = kSeconds};
  for (const char* coupling : {"edge", "bend", "twist"})
    scenario.set.push_back(fmt::format("/model/stiffness/{}={}", coupling, stiffness));
  if (model == Model::kMassSpring)
    scenario.set.insert(scenario.set.end(), {"/model/drag=2", "/model/clamped_particles=2"});
  const Outcome outcome = run(scenario);
  scenario.seconds = 0.5 * kSeconds;
  const Outcome halfway = run(scenario);
  ASSERT_EQ(outcome.diverged + halfway.diverged, "");
  double moved = 0;
  for (std::size_t i = 0; i < outcome.last.size(); ++i)
    moved = std::max(moved, (outcome.last[i] - halfway.last[i]).norm());
  // A hundred roundings of the strand's length; mass springs tremble.
  const double rounding = 100 * kLength * (in_double(machine) ? 0x1p-52 : 0x1p-23);
  const double trembling = at_rest(scenario, scene_of(scenario));
  const double drift = model == Model::kAms ? rounding : trembling * kStep;
  RecordProperty("drift", fmt::format("{:.6g}", moved));
  RecordProperty("drift_bound", fmt::format("{:.6g}", drift));
  RecordProperty("energy", fmt::format("{:.6g}", outcome.energy));
  RecordProperty("speed", fmt::format("{:.6g}", outcome.last_speed));
  const double speed = model == Model::kAms ? rounding / kStep : trembling;
  RecordProperty("speed_bound", fmt::format("{:.6g}", speed));
  // The second half reaches no energy that the first did not, but for what rounded places make of that of a
  // spring: sqrt(2 kappa E) for each metre.
  const double place = kLength * (in_double(machine) ? 0x1p-52 : 0x1p-23);
  const double most = halfway.energy + std::sqrt(2 * std::stod(stiffness) * std::abs(halfway.energy)) * place;
  RecordProperty("energy_bound", fmt::format("{:.6g}", most));
  EXPECT_TRUE(outcome.energy <= most) << outcome.energy << " after " << halfway.energy;
  EXPECT_TRUE(moved <= drift) << "drifted by " << moved << " m";
  EXPECT_TRUE(outcome.last_speed <= speed) << "moves at " << outcome.last_speed << " m/s";
  EXPECT_EQ(outcome.frames, 100000 / 8 + 1);
}

INSTANTIATE_TEST_SUITE_P(HundredThousandSteps, Still,
                         testing::Combine(testing::ValuesIn(kStrandModels), testing::ValuesIn(kPrecisions),
                                          testing::Values("1e6", "1e9")),
                         [](const auto& info) {
                           return name_of(std::get<0>(info.param)) + "_" + name_of(std::get<1>(info.param)) +
                                  "_" + std::get<2>(info.param);
                         });

}  // namespace
}  // namespace ringlet::stability
