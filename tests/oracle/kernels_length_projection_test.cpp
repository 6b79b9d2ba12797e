// The length projection against the reference's: what it leaves, what it keeps, where it gives up.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "kernels_support.h"
#include "oracle/helix.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

using oracle::Points;
using oracle::RandomStrand;
using oracle::Strand;

template <class Machine>
class KernelLengths : public OnMachine<Machine> {
 protected:
  using T = typename Machine::T;

  // The projection of x alone, by a step without forces or motion.
  Points projected(const Strand& strand, const Points& x, double tolerance) {
    StrandRun<Machine> run({strand}, {RootPose{}}, false);
    make_forceless(run);
    run.parameters.length_iterations = 8, run.parameters.length_tolerance = static_cast<T>(tolerance);
    run.set(0, {x, Points::Zero(3, x.cols())});
    run.step({RootPose{}}, 1.0 / 240);
    strain_ = run.figure(0, kernels::kStrain), pieces_ = run.figure(0, kernels::kSubdivisions);
    return run.get(0).position;
  }
  double strain_ = 0, pieces_ = 0;
};
TYPED_TEST_SUITE(KernelLengths, Machines, MachineNames);

// A strand with its particles but the clamped ones displaced by up to `size` per axis.
struct Displaced {
  Strand strand;
  Points x;
};
template <class T>
Displaced displaced(std::mt19937& generator, int count, int clamped, double size) {
  const Strand strand = rounded<T>(oracle::random_strand(generator, count, clamped).strand);
  Points x = strand.rest;
  x.rightCols(count - clamped) += oracle::random_points(generator, count - clamped, size);
  return {strand, x.template cast<T>().template cast<double>()};
}

TYPED_TEST(KernelLengths, AreWithinTheToleranceAfterwards) {
  std::mt19937 generator(4);
  for (const int count : {1, 2, 3, 4, 15, 64})
    for (const int clamped : {0, 1, 2}) {
      if (clamped >= count) continue;
      const auto [strand, x] = displaced<typename TypeParam::T>(generator, count, clamped, 0.001);
      const Points end = this->projected(strand, x, 1e-5);
      const double strain = oracle::worst_edge_strain(strand, end);
      EXPECT_TRUE(strain <= 1.2e-5) << count << " particles: strain " << strain;
      EXPECT_NEAR(this->strain_, strain, this->either(1e-12, 2e-6));
      EXPECT_EQ(this->pieces_, 1);
      EXPECT_EQ((end - x).leftCols(clamped).norm(), 0) << "a clamped particle moved";
    }
}

// Successive projections differ from the exact minimiser at second order: a displacement of size d of
// segments of length l ends within d^2 / l of it.
TYPED_TEST(KernelLengths, AreRestoredByTheLeastDisplacementToSecondOrder) {
  std::mt19937 generator(5);
  for (int trial = 0; trial < 12; ++trial) {
    const int count = 2 + 3 * trial, clamped = trial % 3;
    if (clamped >= count) continue;
    for (const double size : {1e-3, 2.5e-4}) {
      const auto [strand, x] = displaced<typename TypeParam::T>(generator, count, clamped, size);
      const double tolerance = this->either(1e-12, 1e-5);
      const Points expected = oracle::project_lengths(strand, x), end = this->projected(strand, x, tolerance);
      const double moved = (expected - x).colwise().norm().maxCoeff();
      const double apart = (end - expected).colwise().norm().maxCoeff();
      constexpr double kShortestSegment = 0.005;
      EXPECT_TRUE(apart <= 2 * moved * moved / kShortestSegment + this->either(1e-12, 1e-6))
          << count << " particles displaced by " << size << ": " << apart << " m apart, moved " << moved;
    }
  }
}

TYPED_TEST(KernelLengths, KeepTheMomentumOfAFreeStrand) {
  std::mt19937 generator(6);
  for (const int count : {2, 3, 9, 40}) {
    const auto [strand, x] = displaced<typename TypeParam::T>(generator, count, 0, 0.002);
    const Points moved = this->projected(strand, x, this->either(1e-12, 1e-5)) - x;
    EXPECT_GT(moved.norm(), 1e-4);
    const double drift = moved.rowwise().sum().norm();
    EXPECT_TRUE(drift <= this->either(1e-15, 1e-7) * count) << "sum of displacements " << drift << " m";
  }
}

// Once a frame of M substeps: the displacement took all of them, v = dx / (M h).
TYPED_TEST(KernelLengths, CorrectVelocitiesOverAllSubstepsOfTheirCadence) {
  using T = typename TypeParam::T;
  std::mt19937 generator(8);
  const auto [strand, x] = displaced<T>(generator, 12, 1, 0.001);
  constexpr double kStep = 1.0 / 240;
  for (const int skipped : {0, 3}) {
    StrandRun<TypeParam> run({strand}, {RootPose{}}, false);
    make_forceless(run);
    run.parameters.length_iterations = 8, run.parameters.length_tolerance = T(1e-4);
    run.parameters.skipped_substeps = skipped;
    run.set(0, {x, Points::Zero(3, 12)});
    run.step({RootPose{}}, kStep);
    const oracle::State end = run.get(0);
    EXPECT_GT(end.velocity.norm(), 1e-2);
    const double off = (end.velocity - (end.position - x) / ((1 + skipped) * kStep)).norm();
    EXPECT_TRUE(off <= this->either(1e-11, 1e-3)) << skipped << " skipped: " << off << " m/s";
  }
}

// Repeated points, exact and nearly so, have no length to be held to.
TYPED_TEST(KernelLengths, LeaveSegmentsWithoutLengthToTheSprings) {
  using T = typename TypeParam::T;
  for (const double tiny : {0.0, 2e-9, 5e-7}) {
    Points rest(3, 5);
    rest << 0, 2e-5, 2e-5 + tiny, 2e-5 + 2 * tiny, 0.01, 0, 0, 0, tiny, 0, 0, 0, 0, 0, 0;
    oracle::Strand strand = oracle::make_strand(rest, {1e6, 1e6, 1e6, 1e2, 1e2});
    strand.gravity = {0, -9.81, 0};
    StrandRun<TypeParam> run({strand}, {RootPose{}}, false);
    run.parameters.length_iterations = 8, run.parameters.length_tolerance = T(1e-4);
    run.parameters.strain_limit = 1, run.parameters.speed_limit = 10;
    for (int k = 0; k < 480; ++k) {
      run.step({RootPose{}}, 1.0 / 240);
      ASSERT_EQ(run.figure(0, kernels::kDiverged), 0) << "segments of " << tiny << " m, step " << k;
      ASSERT_TRUE(run.figure(0, kernels::kStrain) <= 1.1e-4) << "segments of " << tiny << " m, step " << k;
    }
  }
}

// With forces: the step is the reference's step, then its corrections, the first in the step's metric, then
// the velocities'.
TYPED_TEST(KernelLengths, FollowTheStepAndCorrectTheVelocities) {
  using T = typename TypeParam::T;
  std::mt19937 generator(7);
  for (int trial = 0; trial < 6; ++trial) {
    const bool in_step = trial % 2;
    RandomStrand random = oracle::random_strand(generator, 20, trial / 2);
    random.strand = rounded<T>(random.strand);
    preload_gravity(random.strand, random.step.before);
    StrandRun<TypeParam> run({random.strand}, {random.step.before}, true);
    run.parameters.length_iterations = 8, run.parameters.length_tolerance = T(1e-4);
    run.parameters.lengths_in_step = in_step;
    run.set(0, random.state);
    random.state = run.get(0), random.step.h = static_cast<T>(random.step.h);
    run.step({random.step.after}, random.step.h);

    const oracle::State solved = advance(random.strand, random.state, random.step);
    ASSERT_GT(oracle::worst_edge_strain(random.strand, solved.position), 1e-4);
    Points lengths = solved.position;
    int corrections = 0, iterations = 0;
    for (; in_step && corrections < 2 && oracle::worst_edge_strain(random.strand, lengths) > 1e-4;
         ++corrections)
      lengths = correct_lengths(random.strand, random.state, random.step, lengths, 2);
    lengths =
        oracle::project_lengths_successively(random.strand, lengths, 1e-4, 8 - corrections, &iterations);
    const oracle::State expected = with_projected(solved, lengths, random.step.h), end = run.get(0);
    const double apart = (end.position - expected.position).norm();
    const double faster = (end.velocity - expected.velocity).norm();
    EXPECT_TRUE(apart <= this->either(1e-12, 5e-6)) << "positions are " << apart << " m apart";
    EXPECT_TRUE(faster <= this->either(1e-10, 2e-3)) << "velocities are " << faster << " m/s apart";
    EXPECT_EQ(run.figure(0, kernels::kIterations), corrections + iterations);
    EXPECT_EQ(run.figure(0, kernels::kSubdivisions), 1);
  }
}

// A falling helix whose springs no step follows: its motion changes by half as much with every halving of the
// step. Weighed by masses alone, corrections strain its bends and twists, and it converges to another motion.
TYPED_TEST(KernelLengths, LetStiffStrandsConvergeWithTheStep) {
  using T = typename TypeParam::T;
  if (!std::is_same_v<T, double>) GTEST_SKIP() << "steps are as small as float's precision";
  const Strand strand = oracle::make_strand(oracle::helix(), {1e6, 1e6, 1e6, 1e2, 0});
  EXPECT_NEAR(order_of_fall<TypeParam>(strand, Springs::kAms, true), 1, 0.1);
  EXPECT_GT(std::abs(order_of_fall<TypeParam>(strand, Springs::kAms, false) - 1), 0.1) << "what this is for";

  // What it converges to: the motion of corrections whose tensions are solved for exactly.
  constexpr int kSteps = 320;
  oracle::Strand exact = strand;
  exact.gravity = {0, -9.81, 0}, exact.damping = 1.0 / 60;
  oracle::State state = oracle::rest_state(exact);
  const oracle::Step step{{}, {}, kFallSeconds / kSteps};
  for (int k = 0; k < kSteps; ++k) {
    const oracle::State solved = advance(exact, state, step);
    Points x = solved.position;
    for (int i = 0; i < 8 && oracle::worst_edge_strain(exact, x) > 1e-7; ++i)
      x = correct_lengths(exact, state, step, x, exact.size() - 1);
    ASSERT_LE(oracle::worst_edge_strain(exact, x), 1e-7);
    state = with_projected(solved, x, step.h);
  }
  const auto off = [&](bool in_step) {
    return (fallen<TypeParam>(strand, Springs::kAms, kSteps, in_step) - state.position).norm();
  };
  const double by_masses = off(false), in_step = off(true);
  EXPECT_LT(in_step, 0.05 * by_masses) << by_masses;
}

// Legal states without a direction: nothing divides by zero, and what has lengths gets them back.
TYPED_TEST(KernelLengths, StayFiniteInDegenerateStrands) {
  const auto line = [](const std::vector<double>& along) {
    Points x = Points::Zero(3, static_cast<Eigen::Index>(along.size()));
    for (std::size_t i = 0; i < along.size(); ++i) x(0, static_cast<Eigen::Index>(i)) = 0.01 * along[i];
    return x;
  };
  struct Case {
    const char* name;
    Points rest, x;
    bool restorable;
  };
  const std::vector<Case> cases = {
      {"one particle", line({0}), line({0}), true},
      {"two particles", line({0, 1}), line({0, 1.2}), true},
      {"three particles", line({0, 1, 2}), line({0, 1.2, 1.9}), true},
      {"straight and stretched", line({0, 1, 2, 3, 4, 5}), line({0, 1.1, 2.2, 3.3, 4.4, 5.5}), true},
      {"folded on itself", line({0, 1, 2, 3, 4, 5}), line({0, 1.1, 0.1, 1.2, 0.2, 1.3}), true},
      {"repeated root point", line({0, 0, 1, 2}), line({0, 0, 1.1, 2.2}), true},
      {"repeated points within", line({0, 1, 1, 1, 2}), line({0, 1.1, 1.1, 1.1, 2.2}), true},
      {"all in one place", line({0, 1, 2, 3}), line({0, 0, 0, 0}), false},
      {"no length at all", line({0, 0, 0, 0}), line({0, 0, 0, 0}), true},
  };
  for (const Case& c : cases)
    for (const int clamped : {0, 1, 2}) {
      SCOPED_TRACE(c.name);
      Strand strand = oracle::make_strand(c.rest, {});
      strand.clamped = clamped;
      StrandRun<TypeParam> run({strand}, {RootPose{}}, false);
      run.parameters.length_iterations = 8;
      run.set(0, {c.x, Points::Zero(3, c.x.cols())});
      for (int k = 0; k < 10; ++k) run.step({RootPose{}}, 1.0 / 240);
      const oracle::State end = run.get(0);
      EXPECT_TRUE(end.position.allFinite() && end.velocity.allFinite());
      EXPECT_EQ(run.figure(0, kernels::kDiverged), 0);
      if (c.restorable) {
        EXPECT_TRUE(oracle::worst_edge_strain(strand, end.position) <= 1.2e-4);
      }
    }
}

struct Shaken {
  double mean_iterations = 0, most_iterations = 0, strain = 0, most_pieces = 0;
};
template <class Machine>
Shaken violently_shaken(int substeps, int cap, bool in_step = false) {
  const Strand strand = oracle::helix_strand({});
  StrandRun<Machine> run({strand}, {oracle::kViolentShake.at(0)}, true);
  run.parameters.length_iterations = cap, run.parameters.lengths_in_step = in_step;
  Shaken figures;
  const int steps = oracle::kRestSteps * substeps;
  for (int k = 1; k <= steps; ++k) {
    const double h = oracle::kHelixStep / substeps;
    run.step({oracle::kViolentShake.at(k * h)}, h);
    const double iterations = run.figure(0, kernels::kIterations),
                 pieces = run.figure(0, kernels::kSubdivisions);
    figures.mean_iterations += iterations / steps;
    if (pieces == 1) figures.most_iterations = std::max(figures.most_iterations, iterations);
    figures.most_pieces = std::max(figures.most_pieces, pieces);
    figures.strain = oracle::larger(figures.strain, oracle::worst_edge_strain(strand, run.get(0).position));
  }
  return figures;
}

// By masses alone Newton's method converges at second order; corrections in the step's metric, solved by two
// iterations each, add up to one more on average.
TYPED_TEST(KernelLengths, NeedFewIterationsInAViolentShake) {
  for (const bool in_step : {false, true}) {
    const Shaken fine = violently_shaken<TypeParam>(4, 8, in_step),
                 coarse = violently_shaken<TypeParam>(1, 8, in_step);
    const double more = in_step ? 1 : 0;
    EXPECT_TRUE(fine.mean_iterations > 1.5 + more && fine.mean_iterations < 2.1 + more)
        << fine.mean_iterations;
    EXPECT_LE(fine.most_iterations, 8);
    EXPECT_TRUE(fine.strain <= 1.01e-4) << fine.strain;
    EXPECT_TRUE(coarse.mean_iterations > 2 + more && coarse.mean_iterations < 3.5 + more)
        << coarse.mean_iterations;
    EXPECT_TRUE(coarse.strain <= 1.01e-4) << coarse.strain;
  }
}

TYPED_TEST(KernelLengths, TakeMoreSubstepsWhereTheCapIsHit) {
  const Shaken capped = violently_shaken<TypeParam>(1, 2);
  EXPECT_GT(capped.most_pieces, 1);
  EXPECT_LE(capped.most_pieces, 16);
  EXPECT_TRUE(capped.strain <= 1e-3) << capped.strain;
}

// Displaced by many segments, with a single Newton iteration: no number of pieces brings that back. Meanwhile
// the root turns, piece by piece.
TYPED_TEST(KernelLengths, AreLaidOutWhereNoPiecesBringThemBack) {
  std::mt19937 generator(9);
  for (const int count : {17, 64})
    for (const int clamped : {1, 2}) {
      const auto [strand, x] = displaced<typename TypeParam::T>(generator, count, clamped, 1.0);
      StrandRun<TypeParam> run({strand}, {RootPose{}}, false);
      make_forceless(run);
      run.parameters.length_iterations = 1, run.parameters.length_tolerance = typename TypeParam::T(1e-5);
      run.set(0, {x, Points::Zero(3, x.cols())});
      const RootPose turned{oracle::Mat3(Eigen::AngleAxisd(0.7, oracle::Vec3(1, 2, 3).normalized()))};
      run.step({turned}, 1.0 / 24);
      const Points end = run.get(0).position;
      const double strain = oracle::worst_edge_strain(strand, end);
      EXPECT_TRUE(strain <= 2e-5) << count << " particles: strain " << strain;
      EXPECT_EQ(run.figure(0, kernels::kSubdivisions), 16);
      const double off = (end - turned.rotation * strand.rest).leftCols(clamped).norm();
      EXPECT_TRUE(off <= this->either(1e-14, 1e-7)) << "clamped particles are " << off << " m off";
    }
}

}  // namespace
}  // namespace ringlet::kernels_testing
