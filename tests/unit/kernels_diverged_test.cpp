// Which strands a step calls diverged: those that are not finite or beyond the limits, and no others.
#include <gtest/gtest.h>

#include <limits>

#include "kernels_support.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

constexpr int kStrands = 19, kSick = 7;

template <class Machine>
class KernelDiverged : public OnMachine<Machine> {
 protected:
  // One step of strands that lie at rest, after `harm` to one of them.
  template <class Harm>
  void expect_only_the_sick_one(const std::string& what, Harm&& harm) {
    const oracle::Strand strand = oracle::make_strand(oracle::helix(), {});
    StrandRun<Machine> run(std::vector<oracle::Strand>(kStrands, strand), std::vector<RootPose>(kStrands),
                           true);
    run.parameters.length_iterations = 8;
    run.parameters.strain_limit = 1, run.parameters.speed_limit = 50;
    oracle::State state = run.get(kSick);
    harm(run, state);
    run.set(kSick, state);
    run.step(std::vector<RootPose>(kStrands), 1.0 / 240);
    for (int k = 0; k < kStrands; ++k) {
      EXPECT_EQ(run.figure(k, kernels::kDiverged), k == kSick ? 1 : 0) << what << ", strand " << k;
      if (k != kSick) {
        EXPECT_TRUE(run.get(k).velocity.norm() <= this->either(1e-12, 1e-3)) << what;
      }
    }
  }
};
TYPED_TEST_SUITE(KernelDiverged, Machines, MachineNames);

TYPED_TEST(KernelDiverged, IsTheStrandThatIsNotFinite) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {kNaN, kInfinity, -kInfinity})
    for (const int particle : {1, 13, 29}) {
      this->expect_only_the_sick_one("position",
                                     [&](auto&, oracle::State& s) { s.position(1, particle) = bad; });
      this->expect_only_the_sick_one("velocity",
                                     [&](auto&, oracle::State& s) { s.velocity(2, particle) = bad; });
    }
}

TYPED_TEST(KernelDiverged, IsTheStrandBeyondALimit) {
  this->expect_only_the_sick_one("too fast",
                                 [](auto&, oracle::State& s) { s.velocity.row(2).setConstant(2e4); });
  this->expect_only_the_sick_one("too long", [](auto& run, oracle::State& s) {
    run.parameters.length_iterations = 0;
    s.position.rightCols(29) *= 4;
  });
}

}  // namespace
}  // namespace ringlet::kernels_testing
