// The reference strand's pieces: forces against the differences of their energies, matrices against the
// differences of forces, conserved momenta, degenerate strands, the length projection and the solid response.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "oracle/random_strand.h"

namespace ringlet::oracle {
namespace {

constexpr double kDifference = 1e-7;  // [m]

// -dE/dx by central differences.
template <class Energy>
Points minus_gradient(const Points& x, Energy&& energy) {
  Points force(3, x.cols());
  for (int k = 0; k < x.size(); ++k) {
    Points plus = x, minus = x;
    plus.reshaped()[k] += kDifference;
    minus.reshaped()[k] -= kDifference;
    force.reshaped()[k] = -(energy(plus) - energy(minus)) / (2 * kDifference);
  }
  return force;
}

// -dF/dx by central differences.
template <class Force>
Eigen::MatrixXd minus_jacobian(const Points& x, Force&& force) {
  Eigen::MatrixXd matrix(x.size(), x.size());
  for (int k = 0; k < x.size(); ++k) {
    Points plus = x, minus = x;
    plus.reshaped()[k] += kDifference;
    minus.reshaped()[k] -= kDifference;
    matrix.col(k) = -((force(plus) - force(minus)) / (2 * kDifference)).reshaped();
  }
  return matrix;
}

double relative_error(const Eigen::MatrixXd& measured, const Eigen::MatrixXd& expected) {
  return (measured - expected).norm() / expected.norm();
}

// A straight rest shape stretched and turned, so that every spring is longer than at rest.
RandomStrand stretched_strand(std::mt19937& generator, int count) {
  RandomStrand r = random_strand(generator, count, 0);
  const Points y = ghost(r.strand, r.step.before);
  r.state.position = (1.3 * (y.colwise() - y.col(0).eval())).colwise() + Vec3(0.1, 0.2, 0.3);
  r.state.position += random_points(generator, count, 0.0003);
  return r;
}

TEST(OracleForces, AreTheGradientsOfTheirEnergies) {
  std::mt19937 generator(1);
  for (int count : {1, 2, 3, 4, 9}) {
    const RandomStrand r = random_strand(generator, count, 0);
    const Points& x = r.state.position;
    const Points integrity =
        minus_gradient(x, [&](const Points& at) { return integrity_energy(r.strand, at, r.step.before); });
    EXPECT_LT(relative_error(integrity, integrity_force(r.strand, x, r.step.before)), 1e-6);
    if (count == 1) continue;
    const Points spring = minus_gradient(x, [&](const Points& at) { return spring_energy(r.strand, at); });
    EXPECT_LT(relative_error(spring, spring_force(r.strand, x)), 1e-6);
  }
}

TEST(OracleForces, OfSpringsHaveTheirMatricesAsSlope) {
  std::mt19937 generator(2);
  const RandomStrand r = stretched_strand(generator, 7);
  const Eigen::MatrixXd slope =
      minus_jacobian(r.state.position, [&](const Points& at) { return spring_force(r.strand, at); });
  const Eigen::MatrixXd matrix =
      spring_stiffness(r.strand, r.state.position) + geometric_stiffness(r.strand, r.state.position);
  EXPECT_LT(relative_error(matrix, slope), 1e-6);
}

TEST(OracleForces, OfCompressedSpringsHaveNoGeometricStiffness) {
  std::mt19937 generator(3);
  const RandomStrand r = random_strand(generator, 6, 0);
  const Points squeezed = 0.5 * ghost(r.strand, r.step.before);
  EXPECT_EQ(geometric_stiffness(r.strand, squeezed).norm(), 0);
}

TEST(OracleForces, OfIntegrityHaveTheExactMatrixAsSlope) {
  std::mt19937 generator(4);
  const RandomStrand r = random_strand(generator, 5, 0);
  const auto force = [&](const Points& at) { return integrity_force(r.strand, at, r.step.before); };
  EXPECT_LT(relative_error(integrity_stiffness(r.strand, r.state.position, r.step.before),
                           minus_jacobian(r.state.position, force)),
            1e-6);
}

// Near the ghost, moving a particle further from it while its neighbour stays turns the segment: kappa_alpha
// times rest length over length per metre.
TEST(OracleForces, OfAnglesHaveTheConsistentSlopeAcrossTheSegment) {
  Points rest(3, 2), x(3, 2);
  rest << 0, 0.02, 0, 0, 0, 0;
  const double turn = 1e-4, length = 0.03;
  x << 0, length * std::cos(turn), 0, length * std::sin(turn), 0, 0;
  Strand strand = make_strand(rest, {0, 0, 0, 0, 100});
  strand.rest.col(1) *= 1.5;  // the ghost as long as the segment: its direction is then across
  const Points force = angular_force(strand, x, {});
  EXPECT_NEAR(force.col(1).norm(), 100 * 0.03 * turn, 1e-9);
  EXPECT_LT(force(1, 1), 0);
  Points further = x;
  further(0, 1) = length * std::cos(turn + 1e-5);
  further(1, 1) = length * std::sin(turn + 1e-5);
  const double slope = (angular_force(strand, further, {}) - force).norm() / (further - x).norm();
  const Eigen::MatrixXd matrix = angular_stiffness(strand, x, {});
  EXPECT_NEAR(matrix.bottomRightCorner(3, 3).trace(), slope, 1e-3 * slope);
  EXPECT_EQ(matrix.topRows(3).norm(), 0);
}

TEST(OracleForces, OfAnglesReachPiAndVanishOnTheGhost) {
  Points rest(3, 2);
  rest << 0, 0.01, 0, 0, 0, 0;
  const Strand strand = make_strand(rest, {0, 0, 0, 0, 100});
  EXPECT_NEAR(angular_force(strand, -rest, {})(0, 1), 100 * 0.01 * EIGEN_PI, 1e-12);
  EXPECT_EQ(angular_force(strand, rest, {}).norm(), 0);
}

TEST(OracleForces, OfAShortSegmentKeepABoundedAngularTangent) {
  Points rest(3, 2);
  rest << 0, 0.01, 0, 0, 0, 0;
  Strand strand = make_strand(rest, {0, 0, 0, 0, 100});
  Points x = rest;
  x.col(1) = Vec3(0, 1e-5, 0);
  EXPECT_NEAR(angular_stiffness(strand, x, {}).trace(), 1000, 1e-9);
  strand.angular_tangent = AngularTangent::kPaper;
  EXPECT_NEAR(angular_stiffness(strand, x, {}).trace(), 100, 1e-9);
}

TEST(OracleStep, HasASymmetricPositiveBandedMatrix) {
  std::mt19937 generator(5);
  for (int clamped : {0, 1, 2}) {
    for (int count : {1, 2, 3, 5, 20}) {
      const RandomStrand r = random_strand(generator, count, clamped);
      const LinearSystem system = assemble(r.strand, r.state, r.step);
      ASSERT_EQ(system.matrix.rows(), 3 * std::max(0, count - clamped));
      EXPECT_EQ((system.matrix - system.matrix.transpose()).norm(), 0);
      if (system.matrix.size() == 0) continue;
      const Eigen::VectorXd eigenvalues = system.matrix.selfadjointView<Eigen::Lower>().eigenvalues();
      EXPECT_GE(eigenvalues.minCoeff(), 1);  // at least the mass
      for (int row = 0; row < system.matrix.rows(); ++row) {
        for (int column = 0; column < row / 3 * 3 - 9; ++column) EXPECT_EQ(system.matrix(row, column), 0);
      }
      const State next = advance(r.strand, r.state, r.step);
      EXPECT_LT(backward_error(system, next.velocity.rightCols(count - clamped).reshaped()), 1e-14);
    }
  }
}

// The step solves its own equations: m (v' - v) / h is the force at the start plus the linearised rest, term
// by term.
TEST(OracleStep, SatisfiesTheMomentumBalanceWithDampingDragAndMovingGhosts) {
  std::mt19937 generator(6);
  const RandomStrand r = random_strand(generator, 12, 1);
  const Strand& s = r.strand;
  const State next = advance(s, r.state, r.step);
  const double h = r.step.h;
  const Points y = (ghost(s, r.step.after) - ghost(s, r.step.before)) / h;
  const Points preloaded = (preloaded_ghost(s, r.step.after) - preloaded_ghost(s, r.step.before)) / h;
  const Eigen::VectorXd v = next.velocity.reshaped();
  const Points& x = r.state.position;
  Eigen::VectorXd force = (spring_force(s, x) + integrity_force(s, x, r.step.before) +
                           angular_force(s, x, r.step.before) - s.drag * next.velocity)
                              .reshaped();
  force -= h * (geometric_stiffness(s, x) * v);
  force -= (h + s.damping) * (spring_stiffness(s, x) * v);
  force -= (h + s.damping) * (integrity_stiffness(s, x, r.step.before) * (v - preloaded.reshaped()));
  force -= (h + s.damping) * (angular_stiffness(s, x, r.step.before) * (v - y.reshaped()));
  for (int i = 1; i < s.size(); ++i) {
    const Vec3 wanted = s.mass[i] * ((next.velocity.col(i) - r.state.velocity.col(i)) / h - s.gravity);
    EXPECT_LT((force.segment<3>(3 * i) - wanted).norm(), 1e-9 * force.norm());
  }
}

TEST(OracleStep, KeepsAFreeStrandsMomenta) {
  std::mt19937 generator(7);
  RandomStrand r = random_strand(generator, 15, 0);
  r.strand.integrity.assign(15, 0);
  r.strand.angular.assign(15, 0);
  r.strand.gravity.setZero();
  r.strand.drag = 0;
  for (int i = 0; i < 15; ++i) r.strand.mass[i] = 1 + 0.1 * i;
  const auto linear = [&](const State& s) -> Vec3 {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 15; ++i) sum += r.strand.mass[i] * s.velocity.col(i);
    return sum;
  };
  const auto angular = [&](const State& s) -> Vec3 {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 15; ++i)
      sum += r.strand.mass[i] * Vec3(s.position.col(i)).cross(Vec3(s.velocity.col(i)));
    return sum;
  };
  for (bool geometric : {true, false}) {
    r.strand.geometric_stiffness = geometric;
    State state = r.state;
    for (int k = 0; k < 20; ++k) state = advance(r.strand, state, r.step);
    EXPECT_LT((linear(state) - linear(r.state)).norm(), 1e-11);
    if (!geometric) {
      EXPECT_LT((angular(state) - angular(r.state)).norm(), 1e-12);  // frozen directions keep it too
    }
  }
}

TEST(OracleStep, LetsASingleParticleFallAndDrag) {
  Strand strand = make_strand(Points::Zero(3, 1), {});
  strand.clamped = 0;
  strand.integrity[0] = 0;
  strand.drag = 2;
  const double h = 0.01;
  State state = rest_state(strand);
  for (int k = 0; k < 10; ++k) state = advance(strand, state, {{}, {}, h});
  // v' = (v + h g) / (1 + h drag)
  EXPECT_NEAR(state.velocity(1, 0), -9.81 / 2 * (1 - std::pow(1.02, -10)), 1e-14);
}

TEST(OracleStep, AcceptsDegenerateStrands) {
  for (int count : {1, 2, 3, 4}) {
    for (int clamped : {0, 1, 2}) {
      Strand strand = make_strand(Points::Zero(3, count), {});  // every particle on the root
      strand.clamped = clamped;
      preload_gravity(strand);
      State state = rest_state(strand);
      for (int k = 0; k < 5; ++k) state = advance(strand, state, {{}, {}, 0.01});
      EXPECT_LT(state.position.norm(), 1e-14);
      EXPECT_LT(state.velocity.norm(), 1e-12);
      EXPECT_EQ(project_lengths(strand, state.position), state.position);
    }
  }
}

TEST(OracleStep, CarriesAStrandRigidlyWithAUniformlyMovingRoot) {
  std::mt19937 generator(8);
  RandomStrand r = random_strand(generator, 10, 1);
  r.strand.drag = 0;
  const Vec3 velocity(0.3, -0.2, 0.5);
  State state = rest_state(r.strand, r.step.before);
  state.velocity.colwise() = velocity;
  RootPose pose = r.step.before;
  for (int k = 0; k < 50; ++k) {
    RootPose next = pose;
    next.root += r.step.h * velocity;
    state = advance(r.strand, state, {pose, next, r.step.h});
    pose = next;
  }
  EXPECT_LT((state.position - ghost(r.strand, pose)).norm(), 1e-13);
}

TEST(OracleStep, StartsInBalanceInAnyRootFrame) {
  std::mt19937 generator(12);
  const RandomStrand r = random_strand(generator, 10, 1);
  State state = rest_state(r.strand, r.step.before);
  const Points start = state.position;
  for (int k = 0; k < 50; ++k) state = advance(r.strand, state, {r.step.before, r.step.before, r.step.h});
  EXPECT_LT((state.position - start).norm(), 1e-14);
  EXPECT_LT(state.velocity.norm(), 1e-12);
}

TEST(OracleStep, ReportsNotANumberAsStrain) {
  const Strand strand = make_strand(Points::Random(3, 5), {});
  Points x = strand.rest;
  x(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(worst_edge_strain(strand, x)));
}

TEST(OracleStep, RefusesAStateOfTheWrongSize) {
  const Strand strand = make_strand(Points::Random(3, 4), {});
  EXPECT_THROW(assemble(strand, {Points::Zero(3, 3), Points::Zero(3, 4)}, {{}, {}, 0.01}),
               std::invalid_argument);
}

// ---- Inextensibility
// ---------------------------------------------------------------------------------------------

double weighted_displacement(const Strand& strand, const Points& from, const Points& to) {
  double sum = 0;
  for (int i = 0; i < strand.size(); ++i) sum += strand.mass[i] * (to.col(i) - from.col(i)).squaredNorm();
  return sum;
}

TEST(OracleProjection, RestoresLengthsWithTheLeastDisplacement) {
  std::mt19937 generator(9);
  for (int clamped : {0, 1, 2}) {
    for (int count : {2, 3, 8, 30}) {
      RandomStrand r = random_strand(generator, count, clamped);
      for (double& mass : r.strand.mass) mass = 1 + std::abs(random_points(generator, 1, 1)(0, 0));
      const Points& x = r.state.position;
      const Points projected = project_lengths(r.strand, x);
      EXPECT_LT(worst_edge_strain(r.strand, projected), 1e-10);
      EXPECT_EQ((projected - x).leftCols(clamped).norm(), 0);
      const double least = weighted_displacement(r.strand, x, projected);
      EXPECT_LE(
          least,
          weighted_displacement(r.strand, x, project_lengths_successively(r.strand, x, 1e-13, 50)) + 1e-16);
      for (int trial = 0; trial < 20; ++trial) {
        Points other = projected;
        other.rightCols(count - clamped) += random_points(generator, count - clamped, 1e-4);
        other = project_lengths_successively(r.strand, other, 1e-13, 50);
        EXPECT_LE(least, weighted_displacement(r.strand, x, other) + 1e-16);
      }
    }
  }
}

TEST(OracleProjection, KeepsAFreeStrandsLinearMomentum) {
  std::mt19937 generator(10);
  RandomStrand r = random_strand(generator, 20, 0);
  for (int i = 0; i < 20; ++i) r.strand.mass[i] = 1 + 0.2 * i;
  const Eigen::Map<const Eigen::VectorXd> mass(r.strand.mass.data(), 20);
  const Vec3 before = r.state.velocity * mass;
  for (const Points& projected : {project_lengths(r.strand, r.state.position),
                                  project_lengths_successively(r.strand, r.state.position, 1e-4, 8)}) {
    const Vec3 after = with_projected(r.state, projected, r.step.h).velocity * mass;
    EXPECT_LT((after - before).norm(), 1e-11);
  }
}

TEST(OracleProjection, HasAClosedFormForTwoParticles) {
  Points rest(3, 2), x(3, 2);
  rest << 0, 0.01, 0, 0, 0, 0;
  x << 0, 0, 0, 0.016, 0, 0;
  Strand strand = make_strand(rest, {});
  strand.mass = {1, 3};
  strand.clamped = 0;
  const Points projected = project_lengths(strand, x);
  EXPECT_NEAR(projected(1, 0), 0.006 * 3 / 4, 1e-14);
  EXPECT_NEAR(projected(1, 1), 0.016 - 0.006 / 4, 1e-14);
}

TEST(OracleProjection, TheSuccessiveOneDiffersAtSecondOrder) {
  std::mt19937 generator(11);
  const RandomStrand r = random_strand(generator, 20, 1);
  const Points y = ghost(r.strand, r.step.before);
  const Points offset = r.state.position - y;
  const auto gap = [&](double size) {
    const Points x = y + size * offset;
    return (project_lengths(r.strand, x) - project_lengths_successively(r.strand, x, 1e-14, 50)).norm();
  };
  EXPECT_NEAR(std::log2(gap(0.05) / gap(0.025)), 2, 0.2);
}

// ---- Solids
// ------------------------------------------------------------------------------------------------------

TEST(OracleSolid, SlowsByFrictionAndEndsOnTheSurface) {
  const Solid floor = half_space(Vec3::Zero(), {0, 2, 0});
  const double h = 0.1;
  const Particle after = solid_response(floor, 0.5, {{0, 0.05, 0}, {3, -1, 0}}, h);
  EXPECT_NEAR(after.velocity.x(), (1 - 0.5 / 3) * 3, 1e-15);
  EXPECT_NEAR(after.velocity.y(), 0, 1e-15);
  EXPECT_NEAR(after.position.x(), h * after.velocity.x(), 1e-15);
  EXPECT_NEAR(after.position.y(), 0.05, 1e-15);  // the corrected velocity never reaches the floor
}

TEST(OracleSolid, SticksWhereFrictionIsLargeAndOnHeadOnImpact) {
  const Solid floor = half_space(Vec3::Zero(), {0, 1, 0}, {0.2, 0, 0});
  const Particle stuck = solid_response(floor, 5, {{0, 0.01, 0}, {1, -1, 0}}, 0.1);
  EXPECT_LT((stuck.velocity - Vec3(0.2, 0, 0)).norm(), 1e-15);
  const Particle head_on = solid_response(floor, 0.5, {{0, 0.01, 0}, {0.2, -1, 0}}, 0.1);
  EXPECT_LT((head_on.velocity - Vec3(0.2, 0, 0)).norm(), 1e-15);
}

TEST(OracleSolid, PushesOutWithoutChangingASeparatingVelocity) {
  const Solid ball = sphere({0, 0, 0}, 1);
  const Particle inside{{0, 0.5, 0}, {0, 1, 0}};
  const Particle after = solid_response(ball, 0.5, inside, 0.1);
  EXPECT_EQ(after.velocity, inside.velocity);
  EXPECT_LT((after.position - Vec3(0, 1, 0)).norm(), 1e-15);
}

TEST(OracleSolid, PushesOutWhatTheSolidRanOver) {
  const Solid ball = sphere({0, 0, 0}, 1, {0, 2, 0});
  const Particle after = solid_response(ball, 0, {{0, 0.9, 0}, {0, 0, 0}}, 0.1);
  EXPECT_LT((after.velocity - Vec3(0, 2, 0)).norm(), 1e-15);
  EXPECT_LT((after.position - Vec3(0, 1.1, 0)).norm(), 1e-15);
}

TEST(OracleSolid, LeavesAParticleOutsideAlone) {
  const Solid ball = sphere({0, 0, 0}, 1);
  const Particle after = solid_response(ball, 0.5, {{0, 2, 0}, {0, -1, 0}}, 0.1);
  EXPECT_EQ(after.velocity, Vec3(0, -1, 0));
  EXPECT_LT((after.position - Vec3(0, 1.9, 0)).norm(), 1e-15);
}

}  // namespace
}  // namespace ringlet::oracle
