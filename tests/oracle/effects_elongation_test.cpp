// Non-Hookean integrity: the curve, its secant in the kernels' step, its memory.
#include <gtest/gtest.h>

#include "effects/strands/tension_curve.h"
#include "kernels/strand/elongation.h"
#include "kernels_support.h"
#include "oracle/helix.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

const scene::Curve kDefault = {{0.5, 0.5}, {0.75, 0.65}, {1.0, 0.7}};
const scene::Curve kStraight = {{0.002, 0.002}, {0.02, 0.02}, {1e6, 1e6}};

double length_of(const oracle::Strand& strand) {
  double length = 0;
  for (int i = 1; i < strand.size(); ++i) length += (strand.rest.col(i) - strand.rest.col(i - 1)).norm();
  return length;
}

double secant_of(const scene::Curve& points, double e) {
  return kernels::secant(effects::tension_curve<double>(points), e);
}

TEST(TensionCurve, IsHookesLineUpToTheTransitionExactly) {
  for (const double e : {0.0, 1e-12, 0.1, 0.3333, 0.5}) EXPECT_EQ(secant_of(kDefault, e), 1.0);
}

TEST(TensionCurve, PassesThroughItsPointsAndBreaksAtTheLast) {
  EXPECT_NEAR(secant_of(kDefault, 0.75), 0.65 / 0.75, 1e-15);
  EXPECT_NEAR(secant_of(kDefault, 1 - 1e-12), 0.7, 1e-11);
  EXPECT_EQ(secant_of(kDefault, 1.0), 0.0);
  EXPECT_EQ(secant_of(kDefault, 50), 0.0);
  EXPECT_EQ(secant_of({{0.5, 0.5}}, 0.5), 1.0);
  EXPECT_EQ(secant_of({{0.5, 0.5}}, 0.500001), 0.0);
  EXPECT_TRUE(std::isnan(secant_of(kDefault, std::nan(""))));
}

TEST(TensionCurve, NeverFallsAndHasNoKinkBeforeTheBreak) {
  const scene::Curve curves[] = {kDefault, {{0.1, 0.1}, {0.2, 0.1}, {0.3, 0.9}, {0.31, 0.9}, {2, 1}}};
  for (const scene::Curve& points : curves) {
    const double end = points.back()[0], step = end / 20000;
    double before = 0, slope_before = 1;
    for (double e = step; e < end; e += step) {
      const double tension = e * secant_of(points, e), slope = (tension - before) / step;
      EXPECT_GE(tension, before - 1e-14) << e;
      if (&points == &curves[0]) {
        EXPECT_NEAR(slope, slope_before, 0.01) << e;
      }
      before = tension, slope_before = slope;
    }
  }
}

TEST(TensionCurve, ThroughPointsOfALineIsTheLine) {
  for (const double e : {0.003, 0.01, 0.02, 0.31, 2.0, 1e3}) EXPECT_NEAR(secant_of(kStraight, e), 1, 1e-12);
}

template <class Machine>
class KernelElongation : public OnMachine<Machine> {
 protected:
  using T = typename Machine::T;

  // A helix shaken so far that particles are out by most of `reach` times its length, every step seen by
  // `watch`.
  template <class Watch>
  static oracle::State shake(const scene::Curve* curve, bool permanent, double amplitude, int steps,
                             const Watch& watch, bool paper = false) {
    oracle::Strand strand = oracle::helix_strand({});
    if (paper) strand.integrity_tangent = oracle::IntegrityTangent::kPaper;
    StrandRun<Machine> run({strand}, {RootPose{}}, true);
    if (curve) run.soften(effects::tension_curve<T>(*curve), permanent);
    for (int step = 1; step <= steps; ++step) {
      RootPose pose;
      const double t = std::min(step, 120) / 240.0;  // half a second of motion, then rest
      pose.root.z() = amplitude * (1 - std::cos(2 * std::numbers::pi * 2 * t));
      run.step({pose}, 1.0 / 240);
      watch(run);
    }
    return run.get(0);
  }
  static void ignore(const StrandRun<Machine>&) {}
  static double largest(const StrandRun<Machine>& run) {
    double most = 0;
    for (int i = 0; i < run.model.layout.count(0); ++i) most = std::max(most, run.remembered(0, i));
    return most;
  }
};
TYPED_TEST_SUITE(KernelElongation, Machines, MachineNames);

TYPED_TEST(KernelElongation, BelowTheTransitionChangesNoBit) {
  for (const bool paper : {false, true})
    for (const bool permanent : {false, true}) {
      double most = 0;
      const auto hookean = this->shake(nullptr, permanent, 0.02, 240, this->ignore, paper);
      const auto soft = this->shake(
          &kDefault, permanent, 0.02, 240,
          [&](const auto& run) { most = std::max(most, this->largest(run)); }, paper);
      EXPECT_TRUE(most > 0.01 && most < 0.5) << most;
      EXPECT_TRUE(soft.position == hookean.position && soft.velocity == hookean.velocity);
    }
}

TYPED_TEST(KernelElongation, OnAStraightCurveIsHookean) {
  double most = 0;
  const auto hookean = this->shake(nullptr, false, 0.1, 60, this->ignore);
  const auto soft =
      this->shake(&kStraight, false, 0.1, 60, [&](const auto& run) { most = this->largest(run); });
  EXPECT_GT(most, 0.03);  // well above the transition
  const double apart = (soft.position - hookean.position).cwiseAbs().maxCoeff();
  EXPECT_TRUE(apart <= 1e-6) << apart;
}

TYPED_TEST(KernelElongation, PermanentDamageNeverHealsAndReversibleDoes) {
  std::vector<double> before(30, 0);
  double most = 0;
  const auto damaged = this->shake(&kDefault, true, 0.6, 720, [&](const auto& run) {
    for (int i = 0; i < 30; ++i) {
      const double now = run.remembered(0, i);
      EXPECT_TRUE(now >= before[i]) << "particle " << i;
      before[i] = now;
    }
    most = this->largest(run);
    EXPECT_TRUE(run.get(0).position.allFinite());
    EXPECT_TRUE(run.figure(0, kernels::kSpeed) < 100);
  });
  EXPECT_GT(most, 1.0);  // some broke
  double last = 1;
  const auto healed =
      this->shake(&kDefault, false, 0.6, 1440, [&](const auto& run) { last = this->largest(run); });
  EXPECT_LT(last, 0.5);  // back on Hooke's line
  const oracle::Strand strand = oracle::helix_strand({});
  const oracle::Points rest = oracle::rest_state(strand).position;
  const auto deviation = [&](const oracle::State& state) {
    return (state.position - rest).colwise().norm().maxCoeff();
  };
  EXPECT_GT(deviation(damaged), 2 * deviation(healed)) << deviation(damaged) << " " << deviation(healed);
}

// The preload's ghosts are 98 mm away.
TYPED_TEST(KernelElongation, ShortStrandsDoNotBreakAtRest) {
  for (const double length : {0.001, 0.01, 0.03, 0.1, 1.0}) {
    oracle::Strand strand = oracle::helix_strand({});
    strand.rest *= length / length_of(strand);
    oracle::preload_gravity(strand);
    StrandRun<TypeParam> run({strand}, {RootPose{}}, true);
    run.soften(effects::tension_curve<typename TypeParam::T>(kDefault), true);
    for (int step = 0; step < 240; ++step) run.step({RootPose{}}, 1.0 / 240);
    EXPECT_TRUE(this->largest(run) < 1e-3) << length << " m: " << this->largest(run);
  }
}

// What a step of a softened strand starts from.
template <class T>
struct SoftStep {
  oracle::RandomStrand random;
  kernels::TensionCurve<T> curve;
  std::vector<double> memory;  // [particles] elongations so far; empty: the present ones count
};

// The free particles' velocities after a step that starts with `velocity`.
template <class Machine>
Eigen::VectorXd velocity_after(const SoftStep<typename Machine::T>& soft, const oracle::Points& velocity) {
  const auto& [strand, state, step] = soft.random;
  StrandRun<Machine> run({strand}, {step.before}, true);
  run.set(0, {state.position, velocity});
  run.soften(soft.curve, !soft.memory.empty());
  for (std::size_t i = 0; i < soft.memory.size(); ++i)
    run.state.elongation[run.model.layout.at(0, static_cast<int>(i), 1, 0)] =
        static_cast<typename Machine::T>(soft.memory[i]);
  run.step({step.after}, step.h);
  return run.get(0).velocity.rightCols(strand.size() - strand.clamped).reshaped();
}

// The inverse of the matrix that the step solves: of its system only the right-hand side depends on the
// velocity it starts with. That of a column is so large that the forces do not cost the difference its
// digits.
template <class Machine>
Eigen::MatrixXd inverse_of_matrix(const SoftStep<typename Machine::T>& soft) {
  constexpr double kFast = 4096;  // [m/s]
  const int n = soft.random.strand.size(), held = soft.random.strand.clamped;
  oracle::Points velocity = oracle::Points::Zero(3, n);
  const Eigen::VectorXd by_forces = velocity_after<Machine>(soft, velocity);
  Eigen::MatrixXd inverse(by_forces.size(), by_forces.size());
  for (int k = 0; k < inverse.cols(); ++k) {
    velocity(k % 3, held + k / 3) = kFast;
    inverse.col(k) = (velocity_after<Machine>(soft, velocity) - by_forces) / kFast;
    velocity(k % 3, held + k / 3) = 0;
  }
  return inverse;
}

// The matrix that the kernels factorise, through softening and the break: the reference's with the secant
// stiffness, symmetric, and no eigenvalue below 1 + h G, that of the masses and their drag. Integrity is as
// stiff as the springs, so that a share below 0 would show.
TYPED_TEST(KernelElongation, TheKernelsMatrixIsPositiveDefiniteThroughTheBreak) {
  using T = typename TypeParam::T;
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> up_to_the_break(0, 0.04);
  const scene::Curve curve = {{0.01, 0.01}, {0.02, 0.015}, {0.03, 0.018}};
  int hookean = 0, soft = 0, broken = 0;
  for (int trial = 0; trial < 24; ++trial) {
    SoftStep<T> step{oracle::random_strand(generator, 3 + trial, 1), effects::tension_curve<T>(curve), {}};
    oracle::Strand& strand = step.random.strand;
    for (double& stiffness : strand.integrity) stiffness *= 1e4;
    strand = rounded<T>(strand);
    strand.preload.setZero();
    oracle::preload_gravity(strand, step.random.step.before);
    if (trial & 1) strand.integrity_tangent = oracle::IntegrityTangent::kPaper;
    if (trial & 2)
      for (int i = 0; i < strand.size(); ++i) step.memory.push_back(up_to_the_break(generator));

    oracle::Strand softened = strand;
    const oracle::Points y = oracle::ghost(strand, step.random.step.before);
    for (int i = 0; i < strand.size(); ++i) {
      const double now = (step.random.state.position.col(i) - y.col(i)).norm() / length_of(strand);
      const double share = secant_of(curve, step.memory.empty() ? now : std::max(now, step.memory[i]));
      softened.integrity[i] *= share;
      if (i > 0) ++(share == 1 ? hookean : share > 0 ? soft : broken);
    }
    const Eigen::MatrixXd matrix = assemble(softened, step.random.state, step.random.step).matrix;
    const Eigen::MatrixXd inverse = inverse_of_matrix<TypeParam>(step);
    const Eigen::MatrixXd off = matrix * inverse - Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols());
    EXPECT_LE(off.norm(), this->either(1e-14, 2e-6) * matrix.norm() * inverse.norm()) << trial;
    EXPECT_LE((inverse - inverse.transpose()).norm(), this->either(1e-14, 2e-6) * inverse.norm()) << trial;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(inverse, Eigen::EigenvaluesOnly);
    const double masses = 1 / (1 + step.random.step.h * strand.drag);
    EXPECT_GT(eigen.eigenvalues().minCoeff(), 0) << trial;
    EXPECT_LE(eigen.eigenvalues().maxCoeff(), masses * (1 + this->either(1e-14, 1e-6))) << trial;
  }
  EXPECT_TRUE(hookean > 20 && soft > 20 && broken > 20) << hookean << " " << soft << " " << broken;
}

// One step at elongations all along the curve, the break included: the dense system whose integrity stiffness
// is the secant's.
TYPED_TEST(KernelElongation, SolvesTheReferencesSystemWithTheSecantStiffness) {
  std::mt19937 generator(4);
  int soft = 0, broken = 0;
  for (int trial = 0; trial < 24; ++trial) {
    oracle::RandomStrand random = oracle::random_strand(generator, 3 + trial % 20, 1);
    random.strand = rounded<typename TypeParam::T>(random.strand);
    random.strand.preload.setZero();
    oracle::preload_gravity(random.strand, random.step.before);
    if (trial & 1) random.strand.integrity_tangent = oracle::IntegrityTangent::kPaper;
    StrandRun<TypeParam> run({random.strand}, {random.step.before}, true);
    run.set(0, random.state);
    random.state = run.get(0);
    random.step.h = static_cast<typename TypeParam::T>(random.step.h);
    const scene::Curve curve = {{0.01, 0.01}, {0.02, 0.015}, {0.03, 0.018}};
    run.soften(effects::tension_curve<typename TypeParam::T>(curve), false);

    const double length = length_of(random.strand);
    const oracle::Points y = oracle::ghost(random.strand, random.step.before);
    oracle::Strand softened = random.strand;
    for (int i = 0; i < softened.size(); ++i) {
      const double share = secant_of(curve, (random.state.position.col(i) - y.col(i)).norm() / length);
      softened.integrity[i] *= share;
      soft += share > 0 && share < 1, broken += share == 0;
    }
    const oracle::LinearSystem system = assemble(softened, random.state, random.step);
    run.step({random.step.after}, random.step.h);
    const Eigen::VectorXd solution = run.get(0).velocity.rightCols(softened.size() - 1).reshaped();
    const double backward = oracle::backward_error(system, solution);
    EXPECT_TRUE(backward <= this->either(1e-13, 2e-6)) << backward;
  }
  EXPECT_TRUE(soft > 20 && broken > 20) << soft << " " << broken;
}

}  // namespace
}  // namespace ringlet::kernels_testing
