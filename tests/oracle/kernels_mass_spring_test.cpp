// The mass-spring model's step against the dense reference, and what its forces must satisfy.
#include <gtest/gtest.h>

#include "kernels/strand/altitude.h"
#include "kernels_support.h"
#include "level_set_support.h"
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

TEST(Altitude, OfAFlatTetrahedronIsNothingAndOfAnInvertedOneNegative) {
  using V = kernels::Vector3<double>;
  const V rest[4] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.2, 0.5}};
  V flat[4], inverted[4];
  for (int k = 0; k < 4; ++k)
    flat[k] = {rest[k].x, rest[k].y, 0}, inverted[k] = {rest[k].x, rest[k].y, -rest[k].z};
  const kernels::Altitude<double> whole = kernels::shortest_altitude(rest, rest),
                                  none = kernels::shortest_altitude(flat, rest),
                                  turned = kernels::shortest_altitude(inverted, rest);
  EXPECT_DOUBLE_EQ(whole.length, whole.rest_length);
  EXPECT_EQ(none.length, 0);
  EXPECT_NEAR(std::abs(none.normal.z), 1, 1e-15);  // so that its spring lifts it out of the plane
  EXPECT_GT(std::abs(none.rest_length), 0.3);
  EXPECT_DOUBLE_EQ(turned.length, -turned.rest_length);
}

// The reference's force is minus its energy's gradient, the choice of altitudes held.
TEST(MassSpringReference, ForceIsTheGradientOfItsEnergy) {
  std::mt19937 generator(5);
  MassSpringChain chain;
  chain.rest = chain_of(oracle::helix());
  std::uniform_real_distribution<double> uniform(1e5, 1e6);
  for (auto* stiffness : {&chain.edge, &chain.bend, &chain.twist})
    for (int i = 0; i < oracle::kHelixParticles; ++i) stiffness->push_back(uniform(generator));
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
  using Run = StrandRun<Machine>;

  // The reference's chain of `strand` as a model of precision T holds it.
  static MassSpringChain reference(const Run& run, const oracle::Strand& strand) {
    MassSpringChain chain;
    const int n = strand.size();
    chain.rest.resize(3, 2 * n - 1);
    for (int node = 0; node < 2 * n - 1; ++node)
      for (int c = 0; c < 3; ++c)
        chain.rest(c, node) =
            (node % 2 ? run.model.rest_companion : run.model.rest)[run.model.layout.at(0, node / 2, 3, c)];
    chain.edge = strand.edge, chain.bend = strand.bend, chain.twist = strand.twist;
    chain.gravity = strand.gravity, chain.drag = strand.drag, chain.damping = strand.damping;
    chain.clamped = std::max(0, 2 * strand.clamped - 1);
    chain.geometric_stiffness = strand.geometric_stiffness;
    return chain;
  }
  // With a stiffness of its own for every row of a chain, and as T holds it.
  static oracle::Strand chained(oracle::Strand strand, std::mt19937 generator = std::mt19937(9)) {
    std::uniform_real_distribution<double> uniform(0.5, 1.5);
    for (auto* stiffness : {&strand.edge, &strand.bend, &strand.twist}) {
      const double mean = stiffness == &strand.edge ? 1e5 : stiffness == &strand.bend ? 2e5 : 3e5;
      stiffness->resize(strand.size());
      for (double& value : *stiffness) value = mean * uniform(generator);
    }
    return rounded<T>(strand);
  }
  // The helix by either scheme.
  static oracle::Strand helix(bool paper) {
    return chained(oracle::helix_strand({false, false, !paper, paper ? 0 : 1.0 / 60}));
  }
  // Kinetic and elastic, and of the weight [J per unit mass].
  static double energy(const MassSpringChain& chain, const oracle::State& state) {
    return 0.5 * state.velocity.squaredNorm() +
           oracle::energy(chain, state.position, oracle::chosen_altitudes(state.position)) -
           (chain.gravity.transpose() * state.position).sum();
  }

  // The fastest node [m/s] in the 2 s after 8 s of settling.
  static double fastest_when_hung(bool paper, int clamped) {
    oracle::Strand strand = oracle::helix_strand({false, false, !paper, paper ? 0 : 1.0 / 60});
    for (auto* stiffness : {&strand.edge, &strand.bend, &strand.twist}) stiffness->assign(strand.size(), 1e6);
    strand.drag = 2, strand.clamped = clamped;
    Run run({strand}, {RootPose{}}, false, Springs::kMassSpring);
    double fastest = 0;
    for (int step = 0; step < 240 * 10; ++step) {
      run.step({RootPose{}}, 1.0 / 240);
      if (step > 240 * 8)
        fastest = oracle::larger(fastest, run.get_chain().velocity.colwise().norm().maxCoeff());
    }
    return fastest;
  }

  // One step of a random chain against the dense system; in a wind where there is a law.
  static void expect_reference(std::mt19937& generator, int count, const AirLaw* law) {
    oracle::RandomStrand random = oracle::random_strand(generator, count, count % 3);
    random.strand = chained(random.strand, generator);
    random.strand.geometric_stiffness = count & 1;
    if (count % 5 == 0) random.strand.damping = 0;
    Run run({random.strand}, {random.step.before}, false, Springs::kMassSpring);
    random.step.h = static_cast<T>(random.step.h);
    const MassSpringChain chain = reference(run, random.strand);
    oracle::State start{Points(3, chain.nodes()), oracle::random_points(generator, chain.nodes(), 0.5)};
    const int held = std::min(chain.clamped, chain.nodes()), open = chain.nodes() - held;
    for (int node = 0; node < chain.nodes(); ++node)
      start.position.col(node) = random.step.before.rotation * chain.rest.col(node) + random.step.before.root;
    start.position.rightCols(open) += oracle::random_points(generator, open, 0.002);
    run.set_chain(start);
    start = run.get_chain();
    oracle::LinearSystem system = assemble(chain, start, random.step);
    if (law) {
      const Vec3 wind(4, 0.5, -2);
      run.blow(wind, law->template as<T>());
      add_drag(chain, start, *law, wind, random.step.h, system);
    }
    run.step({random.step.after}, random.step.h);
    const oracle::State end = run.get_chain();
    const Eigen::VectorXd solution = end.velocity.rightCols(open).reshaped();
    const double backward = oracle::backward_error(system, solution);
    EXPECT_TRUE(backward <= OnMachine<Machine>::either(1e-12, 3e-6)) << count << " particles: " << backward;
    const double moved = (end.position - start.position - random.step.h * end.velocity).norm();
    EXPECT_TRUE(moved <= OnMachine<Machine>::either(1e-14, 2e-6)) << count << " particles: " << moved;
    for (int node = 0; node < held; ++node) {
      const Vec3 place = random.step.after.rotation * chain.rest.col(node) + random.step.after.root;
      EXPECT_LT((end.position.col(node) - place).norm(), (OnMachine<Machine>::either(1e-15, 1e-7)));
    }
  }
  // Every segment's drag: on its companion whole, on its ends by their shares.
  static void add_drag(const MassSpringChain& chain, const oracle::State& state, const AirLaw& law,
                       const Vec3& wind, double h, oracle::LinearSystem& system) {
    const int held = std::min(chain.clamped, chain.nodes());
    const auto rest = [&](int node) {  // of the segment that begins at the particle `node`
      if (node < 0 || node + 2 >= chain.nodes()) return 0.0;
      return (chain.rest.col(node + 2) - chain.rest.col(node)).norm();
    };
    for (int node = 0; node + 2 < chain.nodes(); node += 2) {
      const Mat3 drag =
          law.of_segment(state.position.col(node + 2) - state.position.col(node),
                         wind - 0.5 * (state.velocity.col(node) + state.velocity.col(node + 2)));
      for (const int on : {node, node + 1, node + 2}) {
        if (on < held) continue;
        const double share = on == node + 1 ? 1 : rest(node) / (rest(on - 2) + rest(on));
        system.matrix.template block<3, 3>(3 * (on - held), 3 * (on - held)) += h * share * drag;
        system.rhs.template segment<3>(3 * (on - held)) += h * share * drag * wind;
      }
    }
  }
};
TYPED_TEST_SUITE(KernelMassSpring, Machines, MachineNames);

TYPED_TEST(KernelMassSpring, SolvesTheReferencesSystem) {
  std::mt19937 generator(2);
  for (int count = 1; count <= 33; ++count) this->expect_reference(generator, count, nullptr);
}

TYPED_TEST(KernelMassSpring, SolvesTheReferencesSystemInAWind) {
  std::mt19937 generator(7);
  for (int count = 1; count <= 33; ++count) this->expect_reference(generator, count, &kHairInAir);
}

// Rest is rest, by either scheme, curled and straight, for 4 seconds.
TYPED_TEST(KernelMassSpring, StaysAtRestWithoutWeight) {
  for (const auto& [paper, straight] :
       {std::pair(false, false), {true, false}, {false, true}, {true, true}}) {
    oracle::Strand strand = this->helix(paper);
    if (straight) strand.rest.bottomRows(2).setZero();
    strand = rounded<typename TypeParam::T>(strand);
    strand.gravity.setZero();
    StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
    const oracle::State start = run.get_chain();
    for (int step = 0; step < 960; ++step) run.step({RootPose{}}, 1.0 / 240);
    EXPECT_LT((run.get_chain().position - start.position).norm(), this->either(1e-13, 1e-6)) << paper;
  }
}

// A strand that is let go without weight trembles about its rest shape and only loses energy.
TYPED_TEST(KernelMassSpring, NeverGainsEnergyAboutItsRestShape) {
  for (const bool paper : {false, true}) {
    oracle::Strand strand = this->helix(paper);
    strand.gravity.setZero();
    StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
    const MassSpringChain chain = this->reference(run, strand);
    std::mt19937 generator(6);
    oracle::State start = run.get_chain();
    start.velocity = oracle::random_points(generator, chain.nodes(), 0.02);
    start.velocity.col(0).setZero();
    run.set_chain(start);
    const double begin = this->energy(chain, start);
    double before = begin;
    for (int step = 0; step < 480; ++step) {
      run.step({RootPose{}}, 1.0 / 240);
      const double now = this->energy(chain, run.get_chain());
      EXPECT_LE(now, before + this->either(1e-9, 1e-5) * begin) << "step " << step;
      before = now;
    }
    EXPECT_LT(before, 0.9 * begin);
  }
}

// Hung by its root it comes to rest.
TYPED_TEST(KernelMassSpring, ComesToRestUnderItsWeight) {
  for (const bool paper : {false, true}) {
    EXPECT_LT(this->fastest_when_hung(paper, 1), 1e-3) << paper;
    // Where another altitude becomes the shortest its spring's force is another: bent hard at its clamped end
    // a strand trembles about such a jump, for good, but no more and no less.
    EXPECT_LT(this->fastest_when_hung(paper, 2), paper ? 0.1 : 0.02) << paper;
  }
}

TYPED_TEST(KernelMassSpring, FallsFreelyAndKeepsMomentum) {
  oracle::Strand strand = this->chained(oracle::helix_strand({}));
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
  oracle::Strand strand = this->chained(oracle::helix_strand({}));
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
  const oracle::Strand strand = this->chained(oracle::helix_strand({}));
  StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
  run.state.companion_velocity[run.model.layout.at(0, 28, 3, 1)] = NAN;
  run.step({RootPose{}}, 1.0 / 240);
  EXPECT_TRUE(run.figure(0, kernels::kDiverged) > 0);
}

// The root frame carries one particle of a hinge, and the first segment with its companion of a clamped
// tangent.
TYPED_TEST(KernelMassSpring, RootsAreClampedAsThoseOfAms) {
  for (const int clamped : {1, 2}) {
    oracle::Strand strand = this->chained(oracle::helix_strand({}));
    strand.clamped = clamped;
    StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
    const MassSpringChain chain = this->reference(run, strand);
    for (int step = 1; step <= 120; ++step) {
      const RootPose pose{Eigen::AngleAxisd(0.02 * step, Vec3::UnitY()).toRotationMatrix(),
                          Vec3(0, 0, 0.001 * step)};
      run.step({pose}, 1.0 / 240);
      const oracle::State now = run.get_chain();
      for (int node = 0; node <= 2 * (clamped - 1); ++node)
        EXPECT_LT((now.position.col(node) - pose.rotation * chain.rest.col(node) - pose.root).norm(),
                  this->either(1e-15, 1e-7));
      if (step < 120) continue;
      for (const int node : {2 * clamped - 1, 2 * clamped})  // the next ones are free
        EXPECT_GT((now.position.col(node) - pose.rotation * chain.rest.col(node) - pose.root).norm(), 1e-5);
    }
  }
}

TYPED_TEST(KernelMassSpring, KeepsItsLengthsAsAmsDoes) {
  oracle::Strand strand = this->helix(false);
  StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
  run.parameters.length_iterations = 8;
  double strain = 0, iterations = 0, subdivided = 0;
  for (int step = 1; step <= 240; ++step) {
    if (step == 120) run.parameters.length_iterations = 1;  // from here it needs steps in pieces
    run.step({oracle::kViolentShake.at(step / 240.0)}, 1.0 / 240);
    strain = oracle::larger(strain, oracle::worst_edge_strain(strand, run.get(0).position));
    iterations += run.figure(0, kernels::kIterations);
    subdivided += run.figure(0, kernels::kSubdivisions) > 1;
  }
  EXPECT_TRUE(strain <= 1e-3) << strain;
  EXPECT_GT(iterations, 100);
  EXPECT_GT(subdivided, 10);
}

// Companions go along when lengths are corrected: what holds them to the hair is not strained.
TYPED_TEST(KernelMassSpring, ConvergesWithTheStepWhileItsLengthsAreHeld) {
  using T = typename TypeParam::T;
  if (!std::is_same_v<T, double>) GTEST_SKIP() << "steps are as small as float's precision";
  const oracle::Strand strand = this->helix(false);
  EXPECT_NEAR(order_of_fall<TypeParam>(strand, Springs::kMassSpring, true), 1, 0.1);
  EXPECT_GT(std::abs(order_of_fall<TypeParam>(strand, Springs::kMassSpring, false) - 1), 0.1)
      << "what this is for";
}

TYPED_TEST(KernelMassSpring, LiesOnASolidAsAmsDoes) {
  using T = typename TypeParam::T;
  constexpr double kRadius = 0.1;
  static const MeshSolid sphere(icosphere(kRadius, 4), 0.005);
  const oracle::MeshDistance mesh(sphere.surface.vertices, sphere.surface.triangles);
  Points rest = Points::Zero(3, 24);
  rest.row(0).setLinSpaced(0, 0.18);
  rest.row(2).setLinSpaced(0, 0.01);
  oracle::Strand strand = this->chained(oracle::make_strand(rest, {}));
  strand.drag = 2, strand.damping = 1.0 / 60;
  const RootPose root{oracle::Mat3::Identity(), {0, kRadius + 1e-3, 0}};
  StrandRun<TypeParam> run({strand}, {root}, false, Springs::kMassSpring);
  run.parameters.length_iterations = 8, run.parameters.length_tolerance = T(1e-4);
  double strain = 0, deepest = 0, touched = 0;
  for (int step = 0; step < 240; ++step) {
    run.step({root}, 1.0 / 240);
    run.collide({sphere.view()});
    const Points x = run.get(0).position;
    strain = oracle::larger(strain, oracle::worst_edge_strain(strand, x));
    for (int i = 1; i < strand.size(); ++i)
      deepest = oracle::larger(deepest, -mesh.signed_distance(x.col(i)));
    touched += run.contact_figure(0, kernels::kTouched);
  }
  EXPECT_TRUE(strain <= 1e-3) << strain;
  EXPECT_TRUE(deepest <= 1e-5) << deepest;
  EXPECT_GT(touched, 100);
}

TYPED_TEST(KernelMassSpring, DegenerateStrandsStayFinite) {
  for (const double size : {0.0, 1e-6, 1.0})
    for (int count : {1, 2, 3, 4}) {
      Points rest = Points::Zero(3, count);
      for (int i = 0; i < count; ++i) rest.col(i) = size * i * Vec3(0, -0.01, 0);
      oracle::Strand strand = this->chained(oracle::make_strand(rest, {}, 1));
      StrandRun<TypeParam> run({strand}, {RootPose{}}, false, Springs::kMassSpring);
      for (int step = 0; step < 20; ++step) run.step({RootPose{}}, 1.0 / 240);
      EXPECT_TRUE(run.get_chain().position.allFinite()) << size << " " << count;
      EXPECT_EQ(run.figure(0, kernels::kDiverged), 0);
    }
}

}  // namespace
}  // namespace ringlet::kernels_testing
