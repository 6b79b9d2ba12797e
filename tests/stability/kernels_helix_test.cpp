// The kernels against the figures known for the helix (oracle/helix.h), in double and in float.
#include <gtest/gtest.h>

#include <map>

#include "kernels_support.h"

namespace ringlet::kernels_testing {
namespace {

using namespace oracle;

#define EXPECT_FIGURE(measured, figure)                                                                   \
  EXPECT_TRUE((figure).matches(measured))                                                                 \
      << #measured " = " << (measured) << ", expected " << (figure).value << " within " << (figure).lower \
      << " to " << (figure).upper

template <class Machine>
HelixOutcome outcome_of(const HelixVariant& variant, const Shake& shake, int steps, int substeps) {
  const Strand strand = helix_strand(variant);
  StrandRun<Machine> run({strand}, {shake.at(0)}, variant.preload);
  return run_helix_on(run, strand, shake, steps, substeps);
}

template <class Machine>
class KernelHelix : public OnMachine<Machine> {};
TYPED_TEST_SUITE(KernelHelix, MachinesOf<double>, MachineNames);

TYPED_TEST(KernelHelix, RestsAsKnown) {
  for (const RestCase& c : rest_cases()) {
    SCOPED_TRACE(c.name);
    const HelixOutcome outcome = outcome_of<TypeParam>(c.variant, kStill, kRestSteps, 1);
    EXPECT_FIGURE(outcome.distance, c.distance);
    EXPECT_FIGURE(outcome.speed, c.speed);
    EXPECT_FIGURE(outcome.strain, c.strain);
  }
}

TYPED_TEST(KernelHelix, StrainsWhenShakenAsKnown) {
  for (const ShakeCase& c : shake_cases()) {
    SCOPED_TRACE(c.name);
    const HelixOutcome outcome = outcome_of<TypeParam>(c.variant, kViolentShake, kRestSteps, c.substeps);
    EXPECT_FIGURE(outcome.strain, c.strain);
  }
}

TYPED_TEST(KernelHelix, ConvergesWithTheSubstepAsKnown) {
  for (const ConvergenceCase& c : convergence_cases()) {
    SCOPED_TRACE(c.name);
    const auto end = [&](int substeps) -> Points {
      return outcome_of<TypeParam>(c.variant, kConvergenceShake, kConvergenceSteps, substeps).end.position;
    };
    const Points reference = end(kReferenceSubsteps);
    std::array<double, kSubsteps.size()> error;
    for (std::size_t k = 0; k < kSubsteps.size(); ++k) {
      error[k] = (end(kSubsteps[k]) - reference).colwise().norm().maxCoeff();
      EXPECT_FIGURE(error[k], c.error[k]);
    }
    // Order 1: halving the substep halves the error, to which the reference's own error adds a little.
    const double order = std::log2(error[3] / error[5]) / 2;
    EXPECT_TRUE(order > 0.9 && order < 1.15) << "order of convergence " << order;
  }
}

// In float the preloaded helix drifts from its ghost in 4 s [m]; softer than 1e11 the pivots stay positive.
template <class Machine>
class KernelHelixInFloat : public OnMachine<Machine> {};
TYPED_TEST_SUITE(KernelHelixInFloat, MachinesOf<float>, MachineNames);

TYPED_TEST(KernelHelixInFloat, DriftsNoMoreThanKnown) {
  const std::map<double, double> drift = {{1e6, 3e-8}, {1e9, 7e-7}, {1e10, 4e-4}};
  for (const auto& [stiffness, known] : drift) {
    Strand strand = make_strand(helix(), {stiffness, stiffness, stiffness, 1e2, 1e2});
    preload_gravity(strand);
    StrandRun<TypeParam> run({strand}, {RootPose{}}, true);
    const HelixOutcome outcome = run_helix_on(run, strand, kStill, kRestSteps, 1);
    EXPECT_TRUE(outcome.distance <= 3 * known)
        << "drift " << outcome.distance << " m at stiffness " << stiffness << ", known " << known;
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
