// The mass-spring model's step against the dense reference, and what its forces must satisfy.
#include <gtest/gtest.h>

#include "kernels/strand/altitude.h"
#include "kernels_support.h"
#include "oracle/helix.h"
#include "oracle/mass_spring_reference.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

using oracle::MassSpringChain;
using oracle::Points;

// The chain of a hair: its particles and its companions in turn.
Points chain_of(const Points& hair) {
  std::vector<Vec3> points;
  for (int i = 0; i < hair.cols(); ++i) points.push_back(hair.col(i));
  const std::vector<Vec3> companions = state::rest_companions(points);
  Points chain(3, std::max<Eigen::Index>(0, 2 * hair.cols() - 1));
  for (int i = 0; i < hair.cols(); ++i) chain.col(2 * i) = hair.col(i) - hair.col(0);
  for (std::size_t i = 0; i < companions.size(); ++i) chain.col(2 * i + 1) = companions[i];
  return chain;
}

TEST(Companions, StandOffTheMiddleAQuarterTurnOn) {
  Points straight(3, 6);
  for (int i = 0; i < 6; ++i) straight.col(i) = Vec3(1, 2, 3) + 0.01 * i * Vec3(1, 2, -1).normalized();
  const Points chain = chain_of(straight);
  for (int i = 0; i + 1 < 6; ++i) {
    const Vec3 segment = straight.col(i + 1) - straight.col(i);
    const Vec3 off = chain.col(2 * i + 1) - 0.5 * (chain.col(2 * i) + chain.col(2 * i + 2));
    EXPECT_NEAR(off.norm(), 0.5 * segment.norm(), 1e-15);
    EXPECT_NEAR(off.dot(segment), 0, 1e-17);
    if (i == 0) continue;
    const Vec3 before = chain.col(2 * i - 1) - 0.5 * (chain.col(2 * i - 2) + chain.col(2 * i));
    EXPECT_NEAR(off.dot(before), 0, 1e-16);
  }
  // So that no tetrahedron is flat.
  for (int node = 0; node + 3 < chain.cols(); ++node)
    EXPECT_GT(std::abs(oracle::shortest_altitude(chain.middleCols(node, 4)).length), 1e-3);
}

TEST(Altitude, IsTheShortestOfSevenWithItsGradient) {
  std::mt19937 generator(3);
  for (int trial = 0; trial < 2000; ++trial) {
    const Points now = oracle::random_points(generator, 4, 1), rest = oracle::random_points(generator, 4, 1);
    kernels::Vector3<double> x[4], y[4];
    for (int k = 0; k < 4; ++k) {
      x[k] = {now(0, k), now(1, k), now(2, k)};
      y[k] = {rest(0, k), rest(1, k), rest(2, k)};
    }
    const kernels::Altitude<double> found = kernels::shortest_altitude(x, y);
    const oracle::ReferenceAltitude expected = oracle::shortest_altitude(now);
    EXPECT_NEAR(std::abs(found.length), std::abs(expected.length), 1e-12);
    const double sign = found.length * expected.length > 0 ? 1 : -1;
    EXPECT_NEAR(sign * found.rest_length, oracle::altitude(rest, expected.which).length, 1e-12);
    for (int k = 0; k < 4; ++k) {
      const Vec3 gradient = found.weight[k] * Vec3(found.normal.x, found.normal.y, found.normal.z);
      EXPECT_LT((sign * gradient - expected.gradient[k]).norm(), 1e-10 / std::abs(expected.length));
      EXPECT_LE(std::abs(found.weight[k]), 1 + 1e-12);
    }
  }
}

TEST(Altitude, OfPointsOnALineOrOnOnePointIsNone) {
  using V = kernels::Vector3<float>;
  const V line[4] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}}, point[4] = {};
  for (const auto* x : {&line, &point}) {
    const kernels::Altitude<float> a = kernels::shortest_altitude(*x, line);
    EXPECT_EQ(a.normal.x * a.normal.x + a.normal.y * a.normal.y + a.normal.z * a.normal.z, 0);
    EXPECT_EQ(a.length, 0);
  }
}

// The reference's force is minus its energy's gradient, the choice of altitudes held.
TEST(MassSpringReference, ForceIsTheGradientOfItsEnergy) {
  std::mt19937 generator(5);
  MassSpringChain chain;
  chain.rest = chain_of(oracle::helix());
  const Points x = chain.rest + oracle::random_points(generator, chain.nodes(), 0.002);
  const std::vector<int> chosen = oracle::chosen_altitudes(x);
  const Points force = oracle::force(chain, x, chosen);
  Points difference(3, chain.nodes());
  constexpr double kStep = 1e-6;
  for (int k = 0; k < x.size(); ++k) {
    Points more = x, less = x;
    more.reshaped()[k] += kStep, less.reshaped()[k] -= kStep;
    difference.reshaped()[k] =
        -(oracle::energy(chain, more, chosen) - oracle::energy(chain, less, chosen)) / (2 * kStep);
  }
  EXPECT_LT((force - difference).norm(), 1e-6 * force.norm());
}

template <class Machine>
class KernelMassSpring : public OnMachine<Machine> {
 protected:
  using T = typename Machine::T;

  // The reference's chain of `strand` as a model of precision T holds it.
  static MassSpringChain reference(const StrandRun<Machine>& run, const oracle::Strand& strand) {
    MassSpringChain chain;
    const int n = strand.size();
    chain.rest.resize(3, 2 * n - 1);
    for (int node = 0; node < 2 * n - 1; ++node)
      for (int c = 0; c < 3; ++c)
        chain.rest(c, node) =
            (node % 2 ? run.model.rest_companion : run.model.rest)[run.model.layout.at(0, node / 2, 3, c)];
    const auto first = [](const std::vector<double>& values) { return values.empty() ? 0 : values[0]; };
    chain.edge = first(strand.edge), chain.bend = first(strand.bend), chain.twist = first(strand.twist);
    chain.gravity = strand.gravity, chain.drag = strand.drag, chain.damping = strand.damping;
    chain.clamped = 2 * strand.clamped, chain.geometric_stiffness = strand.geometric_stiffness;
    return chain;
  }
  static oracle::Strand uniform(oracle::Strand strand) {
    strand = rounded<T>(strand);
    strand.edge.assign(strand.size(), 1e5);  // the chain asks for every row
    strand.bend.assign(strand.size(), 2e5);
    strand.twist.assign(strand.size(), 3e5);
    return strand;
  }
};
TYPED_TEST_SUITE(KernelMassSpring, Machines, MachineNames);

TYPED_TEST(KernelMassSpring, SolvesTheReferencesSystem) {
  std::mt19937 generator(2);
  for (int count = 1; count <= 33; ++count) {
    oracle::RandomStrand random = oracle::random_strand(generator, count, count % 3);
    random.strand = this->uniform(random.strand);
    random.strand.geometric_stiffness = count & 1;
    StrandRun<TypeParam> run({random.strand}, {random.step.before}, false, Springs::kMassSpring);
    random.step.h = static_cast<typename TypeParam::T>(random.step.h);
    MassSpringChain chain = this->reference(run, random.strand);
    oracle::State start{Points(3, chain.nodes()), oracle::random_points(generator, chain.nodes(), 0.5)};
    const int held = std::min(chain.clamped, chain.nodes());
    for (int node = 0; node < chain.nodes(); ++node)
      start.position.col(node) = random.step.before.rotation * chain.rest.col(node) + random.step.before.root;
    start.position.rightCols(chain.nodes() - held) +=
        oracle::random_points(generator, chain.nodes() - held, 0.002);
    run.set_chain(start);
    start = run.get_chain();
    const oracle::LinearSystem system = assemble(chain, start, random.step);
    run.step({random.step.after}, random.step.h);
    const oracle::State end = run.get_chain();
    const Eigen::VectorXd solution = end.velocity.rightCols(chain.nodes() - held).reshaped();
    const double backward = oracle::backward_error(system, solution);
    EXPECT_TRUE(backward <= this->either(1e-12, 3e-6)) << count << " particles: " << backward;
    const double moved = (end.position - start.position - random.step.h * end.velocity).norm();
    EXPECT_TRUE(moved <= this->either(1e-14, 2e-6)) << count << " particles: " << moved;
  }
}

TYPED_TEST(KernelMassSpring, StaysAtRestWithoutWeight) {
  oracle::Strand strand = this->uniform(oracle::helix_strand({}));
  strand.gravity.setZero();
  StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
  const oracle::State start = run.get_chain();
  for (int step = 0; step < 100; ++step) run.step({RootPose{}}, 1.0 / 240);
  EXPECT_LT((run.get_chain().position - start.position).norm(), this->either(1e-13, 1e-6));
}

TYPED_TEST(KernelMassSpring, FallsFreelyAndKeepsMomentum) {
  oracle::Strand strand = this->uniform(oracle::helix_strand({}));
  strand.clamped = 0;
  StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
  oracle::State start = run.get_chain();
  std::mt19937 generator(4);
  start.velocity = oracle::random_points(generator, start.velocity.cols(), 1);
  run.set_chain(start);
  constexpr int kSteps = 48;
  for (int step = 0; step < kSteps; ++step) run.step({RootPose{}}, 1.0 / 240);
  const Vec3 expected = start.velocity.rowwise().mean() + kSteps / 240.0 * strand.gravity;
  EXPECT_LT((run.get_chain().velocity.rowwise().mean() - expected).norm(), this->either(1e-11, 2e-4));
}

// The same motion seen from a turned world.
TYPED_TEST(KernelMassSpring, DoesNotKnowItsOrientation) {
  oracle::Strand strand = this->uniform(oracle::helix_strand({}));
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  const auto swing = [&](const RootPose& pose, const Vec3& gravity) {
    oracle::Strand turned = strand;
    turned.gravity = gravity;
    StrandRun<TypeParam> run({turned}, {pose}, false, Springs::kMassSpring);
    for (int step = 0; step < 60; ++step) run.step({pose}, 1.0 / 240);
    return run.get_chain();
  };
  const oracle::State upright = swing({}, strand.gravity),
                      turned = swing({turn, Vec3::Zero()}, turn * strand.gravity);
  EXPECT_LT((turned.position - turn * upright.position).cwiseAbs().maxCoeff(), this->either(1e-8, 2e-3));
}

TYPED_TEST(KernelMassSpring, ReportsACompanionThatIsNotFinite) {
  const oracle::Strand strand = this->uniform(oracle::helix_strand({}));
  StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
  run.state.companion_velocity[run.model.layout.at(0, 28, 3, 1)] = NAN;
  run.step({RootPose{}}, 1.0 / 240);
  EXPECT_TRUE(run.figure(0, kernels::kDiverged) > 0);
}

TYPED_TEST(KernelMassSpring, DegenerateStrandsStayFinite) {
  for (const double size : {0.0, 1e-6, 1.0})
    for (int count : {1, 2, 3, 4}) {
      Points rest = Points::Zero(3, count);
      for (int i = 0; i < count; ++i) rest.col(i) = size * i * Vec3(0, -0.01, 0);
      oracle::Strand strand = this->uniform(oracle::make_strand(rest, {}, 1));
      StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
      for (int step = 0; step < 20; ++step) run.step({RootPose{}}, 1.0 / 240);
      EXPECT_TRUE(run.get_chain().position.allFinite()) << size << " " << count;
      EXPECT_EQ(run.figure(0, kernels::kDiverged), 0);
    }
}

}  // namespace
}  // namespace ringlet::kernels_testing
