// One implicit step of the kernels against the dense reference: the velocities as a solution of its linear
// system, and the positions they lead to.
#include <gtest/gtest.h>

#include "kernels_support.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

using oracle::AngularTangent;
using oracle::IntegrityTangent;
using oracle::RandomStrand;

template <class Machine>
class KernelStep : public OnMachine<Machine> {
 protected:
  using T = typename Machine::T;

  // Steps `random` once, alone in its batch, and compares with the reference's system for the same rounded
  // input.
  void compare(RandomStrand random, bool preload, const std::string& what) {
    random.strand = rounded<T>(random.strand);
    random.strand.preload.setZero();
    if (preload) preload_gravity(random.strand, random.step.before);
    StrandRun<Machine> run({random.strand}, {random.step.before}, preload);
    run.set(0, random.state);
    random.state = run.get(0);
    random.step.h = static_cast<T>(random.step.h);
    const oracle::LinearSystem system = assemble(random.strand, random.state, random.step);
    run.step({random.step.after}, random.step.h);
    const oracle::State end = run.get(0);

    const int held = std::min(random.strand.clamped, random.strand.size());
    const Eigen::VectorXd solution = end.velocity.rightCols(random.strand.size() - held).reshaped();
    const double backward = oracle::backward_error(system, solution);
    EXPECT_TRUE(backward <= this->either(1e-14, 1e-6)) << what << ": backward error " << backward;
    worst_ = std::max(worst_, backward);

    const oracle::State expected = advance(random.strand, random.state, random.step);
    const double moved = (end.position - random.state.position - random.step.h * end.velocity).norm();
    EXPECT_TRUE(moved <= this->either(1e-15, 1e-6)) << what << ": x + h v is off by " << moved << " m";
    const double apart = (end.position - expected.position).template lpNorm<Eigen::Infinity>();
    EXPECT_TRUE(apart <= this->either(1e-12, 2e-6)) << what << ": positions are " << apart << " m apart";
    const double driven =
        (end.velocity - expected.velocity).leftCols(held).norm() / (1 + expected.velocity.norm());
    EXPECT_TRUE(driven <= this->either(1e-12, 1e-5)) << what << ": clamped velocities are off by " << driven;
  }

  double worst_ = 0;
};
TYPED_TEST_SUITE(KernelStep, Machines, MachineNames);

TYPED_TEST(KernelStep, SolvesTheReferencesSystemForEveryLength) {
  std::mt19937 generator(1);
  for (int count = 1; count <= 64; ++count)
    for (int clamped : {0, 1, 2}) {
      const RandomStrand random = oracle::random_strand(generator, count, clamped);
      this->compare(random, true,
                    std::to_string(count) + " particles, " + std::to_string(clamped) + " clamped");
    }
  this->RecordProperty("worst_backward_error", std::to_string(this->worst_ * 1e16) + "e-16");
}

TYPED_TEST(KernelStep, SolvesTheReferencesSystemForEveryOption) {
  std::mt19937 generator(2);
  for (int options = 0; options < 128; ++options) {
    RandomStrand random = oracle::random_strand(generator, 5 + options % 24, 1 + (options & 1));
    oracle::Strand& strand = random.strand;
    strand.geometric_stiffness = options & 2;
    if (options & 4) strand.damping = 0;
    if (options & 8) strand.drag = 0;
    if (options & 16) strand.angular_tangent = AngularTangent::kPaper;
    if (options & 32) strand.integrity_tangent = IntegrityTangent::kPaper;
    this->compare(random, options & 64, "options " + std::to_string(options));
  }
}

TYPED_TEST(KernelStep, SolvesTheReferencesSystemWithoutGhosts) {
  std::mt19937 generator(3);
  for (int count : {1, 2, 3, 4, 17}) {
    RandomStrand random = oracle::random_strand(generator, count, 1);
    for (auto* stiffness : {&random.strand.integrity, &random.strand.angular})
      std::fill(stiffness->begin(), stiffness->end(), 0.0);
    this->compare(random, true, std::to_string(count) + " particles without ghosts");
  }
}

// The angular tangent goes with 1 / |x_i - x_{i-1}| down to a tenth of the rest length.
TYPED_TEST(KernelStep, SolvesTheReferencesSystemOfSegmentsUnderATenthOfTheirLength) {
  std::mt19937 generator(4);
  for (int count : {2, 5, 17}) {
    RandomStrand random = oracle::random_strand(generator, count, 1);
    oracle::Points& x = random.state.position;
    for (int i = 1; i < count; i += 2) {
      const double rest = (random.strand.rest.col(i) - random.strand.rest.col(i - 1)).norm();
      x.col(i) = x.col(i - 1) + 0.03 * rest * (x.col(i) - x.col(i - 1)).normalized();
    }
    this->compare(random, true, std::to_string(count) + " particles, short segments");
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
