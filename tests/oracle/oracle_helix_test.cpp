// The reference strand against the figures known for the helix: what is right about it is right about the
// equations.
#include <gtest/gtest.h>

#include <string>

#include "oracle/helix.h"

namespace ringlet::oracle {
namespace {

#define EXPECT_FIGURE(measured, figure)                                                                   \
  EXPECT_TRUE((figure).matches(measured))                                                                 \
      << #measured " = " << (measured) << ", expected " << (figure).value << " within " << (figure).lower \
      << " to " << (figure).upper

class HelixAtRest : public testing::TestWithParam<RestCase> {};

TEST_P(HelixAtRest, EndsAsKnown) {
  const RestCase& c = GetParam();
  const HelixOutcome outcome = run_helix(helix_strand(c.variant), kStill, kRestSteps, 1, advance);
  EXPECT_FIGURE(outcome.distance, c.distance);
  EXPECT_FIGURE(outcome.speed, c.speed);
  EXPECT_FIGURE(outcome.strain, c.strain);
}

INSTANTIATE_TEST_SUITE_P(Oracle, HelixAtRest, testing::ValuesIn(rest_cases()),
                         [](const auto& info) { return std::string(info.param.name); });

class HelixShaken : public testing::TestWithParam<ShakeCase> {};

TEST_P(HelixShaken, StrainsAsKnown) {
  const ShakeCase& c = GetParam();
  const HelixOutcome outcome =
      run_helix(helix_strand(c.variant), kViolentShake, kRestSteps, c.substeps, advance);
  EXPECT_FIGURE(outcome.strain, c.strain);
}

INSTANTIATE_TEST_SUITE_P(Oracle, HelixShaken, testing::ValuesIn(shake_cases()),
                         [](const auto& info) { return std::string(info.param.name); });

class HelixConverges : public testing::TestWithParam<ConvergenceCase> {};

TEST_P(HelixConverges, WithTheSubstepAsKnown) {
  const ConvergenceCase& c = GetParam();
  const auto end = [&](int substeps) -> Points {
    const Strand strand = helix_strand(c.variant);
    return run_helix(strand, kConvergenceShake, kConvergenceSteps, substeps, advance).end.position;
  };
  const Points reference = end(kReferenceSubsteps);
  for (size_t k = 0; k < kSubsteps.size(); ++k) {
    const double error = (end(kSubsteps[k]) - reference).colwise().norm().maxCoeff();
    EXPECT_TRUE(c.error[k].matches(error))
        << kSubsteps[k] << " substeps: " << error << ", expected " << c.error[k].value;
  }
}

INSTANTIATE_TEST_SUITE_P(Oracle, HelixConverges, testing::ValuesIn(convergence_cases()),
                         [](const auto& info) { return std::string(info.param.name); });

// A straight hinged strand of 0.58 m let go from the horizontal, until its tip passes below the root: energy
// lost, of 85 J, is 62 J with geometric stiffness and 3 J without (kinetic and gravitational; the springs'
// jitter not counted), 17 J either way with the lengths projected every step.
struct FallCase {
  const char* name;
  bool geometric_stiffness, project;
  double lost;
};

class FallingStrand : public testing::TestWithParam<FallCase> {};

TEST_P(FallingStrand, LosesTheKnownEnergy) {
  const FallCase& c = GetParam();
  Points rest = Points::Zero(3, 30);
  rest.row(0).setLinSpaced(0, 0.58);
  Strand strand = make_strand(rest, {1e6, 1e6, 1e6, 0, 0});
  strand.geometric_stiffness = c.geometric_stiffness;
  State state = rest_state(strand);
  const Step step{{}, {}, kHelixStep};
  for (int k = 0; k < 60 && state.position(0, 29) >= 0; ++k) {
    state = advance(strand, state, step);
    if (c.project) {
      state = with_projected(state, project_lengths_successively(strand, state.position, 1e-4, 8), step.h);
    }
  }
  ASSERT_LT(state.position(0, 29), 0);
  const double drop = 9.81 * -state.position.row(1).sum();
  EXPECT_NEAR(drop, 85, 2);
  EXPECT_NEAR(drop - 0.5 * state.velocity.squaredNorm(), c.lost, 0.5);
}

INSTANTIATE_TEST_SUITE_P(Oracle, FallingStrand,
                         testing::Values(FallCase{"geometric_stiffness", true, false, 62},
                                         FallCase{"frozen_directions", false, false, 3},
                                         FallCase{"geometric_stiffness_projected", true, true, 17},
                                         FallCase{"frozen_directions_projected", false, true, 17}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace ringlet::oracle
