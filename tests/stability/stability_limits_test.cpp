// What cannot be held is refused or reported: stiffness that single precision cannot tell, and runs that
// leave the scene's limits. No frame is handed on after that.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pipeline/precision.h"
#include "stability/suite.h"

namespace ringlet::stability {
namespace {

using testing::HasSubstr;

class TooStiff : public testing::TestWithParam<std::tuple<const char*, double, Model>> {};

TEST_P(TooStiff, IsRefusedInSinglePrecision) {
  const auto& [coupling, stiffness, model] = GetParam();
  Scenario scenario{.model = model, .machine = Machine::kFloat, .seconds = 0.1};
  scenario.set = {fmt::format("/model/stiffness/{}={}", coupling, stiffness)};
  try {
    run(scenario);
    FAIL() << "the run was not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_THAT(error.what(), HasSubstr(fmt::format("/model/stiffness/{}", coupling)));
    EXPECT_THAT(error.what(), HasSubstr("--precision double"));
  }
  scenario.machine = Machine::kDouble;
  EXPECT_EQ(run(scenario).diverged, "");
}

INSTANTIATE_TEST_SUITE_P(Springs, TooStiff,
                         testing::Combine(testing::Values("edge", "bend", "twist", "integrity", "angular"),
                                          testing::Values(1.1e9, 1e12), testing::ValuesIn(kStrandModels)),
                         [](const auto& info) {
                           return fmt::format("{}_{}_{}", std::get<0>(info.param),
                                              std::get<1>(info.param) < 1e10 ? "11e8" : "1e12",
                                              name_of(std::get<2>(info.param)));
                         });

TEST(TooStiffByCurve, IsRefusedInSinglePrecision) {
  Scenario scenario{.machine = Machine::kFloat, .seconds = 0.1};
  scenario.set = {"/groom/stiffness=[{\"coupling\": \"bend\", \"curve\": [[0, 1], [1, 2000]]}]"};
  EXPECT_THROW(run(scenario), Error);
  scenario.set.push_back("/model/stiffness/bend=5e5");
  EXPECT_EQ(run(scenario).diverged, "");
}

// Lengths asked for more finely than float tells them are held as float can, which double does not need.
class FineLengths : public testing::TestWithParam<std::tuple<Model, int>> {};

TEST_P(FineLengths, AreHeldAsThePrecisionCan) {
  const auto& [model, particles] = GetParam();
  const double finest = pipeline::kFinestStrainInFloat * (particles - 1);
  Scenario scenario{.model = model, .hair = few_strands(0.2, particles), .seconds = 0.5};
  scenario.set = {fmt::format("/effects/inextensible={{\"tolerance\": {}}}", 0.3 * finest)};
  EXPECT_LE(run(scenario).strain, 0.3 * finest);
  scenario.machine = Machine::kFloat;
  const Outcome outcome = run(scenario);
  EXPECT_EQ(outcome.diverged, "");
  EXPECT_LE(outcome.strain, finest);
}

INSTANTIATE_TEST_SUITE_P(Lengths, FineLengths,
                         testing::Combine(testing::ValuesIn(kStrandModels), testing::Values(16, 100, 500)),
                         [](const auto& info) {
                           return fmt::format("{}_{}_particles", name_of(std::get<0>(info.param)),
                                              std::get<1>(info.param));
                         });

// The papers' scheme without its mends, shaken: it stays within the limits or says where it left them.
class Papers : public testing::TestWithParam<std::tuple<Model, Machine, int, int>> {};

TEST_P(Papers, StaysWithinTheLimitsOrDiverges) {
  const auto& [model, machine, power, substeps] = GetParam();
  Scenario scenario{.model = model, .machine = machine, .seconds = 3};
  scenario.driven = speed_of_shake(0.3, 3);
  scenario.set = {"/model/scheme=\"paper\"", "/effects/inextensible=null",
                  "/limits={\"edge_strain\": 10, \"speed\": 100}",
                  fmt::format("/model/substeps={}", substeps), shaken_roots(0.3, 3, 1)};
  for (const char* coupling : {"edge", "bend", "twist"})
    scenario.set.push_back(fmt::format("/model/stiffness/{}=1e{}", coupling, power));
  const Outcome outcome = run(scenario);
  EXPECT_TRUE(outcome.finite);
  EXPECT_TRUE(outcome.strain <= 10) << "a frame of strain " << outcome.strain << " was handed on";
  EXPECT_TRUE(outcome.speed <= 100) << "a frame of speed " << outcome.speed << " was handed on";
  if (outcome.diverged.empty()) {
    EXPECT_EQ(outcome.frames, 73);
  } else {
    EXPECT_THAT(outcome.diverged, HasSubstr("stage `strands`, strand "));
    EXPECT_LT(outcome.frames, 73);
  }
  RecordProperty("diverged", outcome.diverged.empty() ? "no" : "yes");
}

INSTANTIATE_TEST_SUITE_P(Shaken, Papers,
                         testing::Combine(testing::ValuesIn(kStrandModels), testing::ValuesIn(kPrecisions),
                                          testing::Values(3, 6, 9), testing::Values(1, 8)),
                         [](const auto& info) {
                           return fmt::format("{}_{}_1e{}_{}_substeps", name_of(std::get<0>(info.param)),
                                              name_of(std::get<1>(info.param)), std::get<2>(info.param),
                                              std::get<3>(info.param));
                         });

}  // namespace
}  // namespace ringlet::stability
