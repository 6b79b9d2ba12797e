// The solid response of one particle against the reference's arithmetic, and what must not pass through a
// solid.
#include <gtest/gtest.h>

#include <random>

#include "kernels_support.h"
#include "level_set_support.h"

namespace ringlet::kernels_testing {
namespace {

using Eigen::Vector3d;
using oracle::Particle;
using oracle::Points;

constexpr double kStep = 1.0 / 240;

// A block whose top is at y = 0.
const MeshSolid& block() {
  static const MeshSolid solid(box({-0.08, -0.06, -0.08}, {0.08, 0, 0.08}, 4), 0.006);
  return solid;
}

template <class Machine>
class KernelResponse : public OnMachine<Machine> {
 protected:
  using T = typename Machine::T;

  // A strand's free particle, `particle` before the advance, after one contact stage; its root is 5 mm above
  // the place it comes to.
  Particle respond(const kernels::SolidView& solid, const Particle& particle, double h = kStep) {
    const Vector3d ahead = particle.position + h * particle.velocity;
    const RootPose root{oracle::Mat3::Identity(), ahead + Vector3d(0, 0.005, 0)};
    Points rest(3, 2);
    rest << Vector3d::Zero(), Vector3d(0, -0.005, 0);
    StrandRun<Machine> run({oracle::make_strand(rest, {})}, {root}, false);
    oracle::State state = run.get(0);
    state.position.col(1) = ahead, state.velocity.col(1) = particle.velocity;
    run.set(0, state);
    run.parameters.step = static_cast<T>(h);
    run.collide({solid});
    touched_ = run.contact_figure(0, kernels::kTouched) > 0;
    state = run.get(0);
    EXPECT_EQ(state.velocity.col(0).norm(), 0);
    return {state.position.col(1), state.velocity.col(1)};
  }
  void expect_same(const Particle& measured, const Particle& expected) {
    EXPECT_TRUE((measured.position - expected.position).norm() <= this->either(2e-8, 3e-7))
        << measured.position.transpose() << " instead of " << expected.position.transpose();
    EXPECT_TRUE((measured.velocity - expected.velocity).norm() <= this->either(1e-5, 1e-4))
        << measured.velocity.transpose() << " instead of " << expected.velocity.transpose();
  }
  bool touched_ = false;
};
TYPED_TEST_SUITE(KernelResponse, Machines, MachineNames);

TYPED_TEST(KernelResponse, HasTheFrictionCone) {
  const Particle falling{{0.01, 0.004, -0.02}, {3, -2, 0}};
  const struct { double friction, slides; } cases[] = {{0, 3}, {0.5, 2}, {1, 1}, {1.5, 0}, {10, 0}};
  for (const auto& c : cases) {
    const Particle after = this->respond(block().view(c.friction), falling);
    this->expect_same(after, {falling.position + kStep * Vector3d(c.slides, 0, 0), {c.slides, 0, 0}});
  }
}

TYPED_TEST(KernelResponse, LeavesASeparatingParticlesVelocityAndPushesItOut) {
  const Vector3d velocity(1, 0.5, 0);
  const Particle after = this->respond(block().view(), {{0, -0.005, 0}, velocity});
  this->expect_same(after, {{kStep * 1, 0, 0}, velocity});
}

TYPED_TEST(KernelResponse, LeavesWhatIsOutsideAlone) {
  const Particle outside{{0, 0.004, 0}, {2, -0.5, 1}};
  this->expect_same(this->respond(block().view(), outside),
                    {outside.position + kStep * outside.velocity, outside.velocity});
  EXPECT_FALSE(this->touched_);
}

TYPED_TEST(KernelResponse, IsCarriedByAMovingSolid) {
  const Vector3d carried(0.3, 0.9, -0.6);
  kernels::SolidView solid = block().view(0.5);
  for (int c = 0; c < 3; ++c) solid.translation_before[c] = -kStep * carried[c];
  std::mt19937 generator(10);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    const Particle particle{
        {0.02 * uniform(generator), 0.001 * uniform(generator), 0.02 * uniform(generator)},
        {uniform(generator), -1 + 2 * uniform(generator), uniform(generator)}};
    const oracle::Solid expected = oracle::half_space({0, 0, 0}, {0, 1, 0}, carried);
    this->expect_same(this->respond(solid, particle), oracle::solid_response(expected, 0.5, particle, kStep));
  }
}

// What is asked for: where a solid pressed, how it moves, against the root where strands grow on it, and its
// friction; zeros where it did not.
TYPED_TEST(KernelResponse, TellsWhatItTouched) {
  using T = typename TypeParam::T;
  constexpr double kFriction = 0.25;
  Points rest(3, 3);  // from above, into the block, and out beside it
  rest << Vector3d::Zero(), Vector3d(0.01, -0.01, 0), Vector3d(0.02, 0.02, 0);
  for (const bool home : {false, true}) {
    StrandRun<TypeParam> run({oracle::make_strand(rest, {})},
                             {RootPose{oracle::Mat3::Identity(), {0, 0.005, 0}}}, false);
    const auto& layout = run.model.layout;
    run.state.touches.assign(layout.rows() * kernels::kTouchReals * kernels::kLanes, T(7));
    for (int i = 0; i < 3; ++i)
      run.state.touches[layout.at(0, i, kernels::kTouchReals, kernels::kTouchLoad)] = T(0);
    run.home = home ? 0 : -1;
    oracle::State state = run.get(0);
    state.velocity.col(0) = Vector3d(0.1, 0.2, -0.3);
    run.set(0, state);
    run.parameters.step = kStep;
    kernels::SolidView solid = block().view(kFriction);
    solid.translation_before[0] = -0.3 * kStep;
    run.collide({solid});
    const double pressed[] = {0, 1, 0, 0.3 - 0.1 * home, -0.2 * home, 0.3 * home, kFriction, double(home), 0};
    for (const int i : {1, 2})
      for (int k = 0; k < kernels::kTouchReals; ++k)
        EXPECT_NEAR(run.state.touches[layout.at(0, i, kernels::kTouchReals, k)], i == 1 ? pressed[k] : 0,
                    1e-4)
            << home << " " << i << " " << k;
  }
}

// The friction on what other hair presses on counts that: Coulomb's cone with the load.
TYPED_TEST(KernelResponse, FeelsTheLoad) {
  using T = typename TypeParam::T;
  Points rest(3, 2);
  rest << Vector3d::Zero(), Vector3d(0, -0.005, 0);
  for (const double load : {0.0, 1.0, 100.0}) {
    StrandRun<TypeParam> run({oracle::make_strand(rest, {})},
                             {RootPose{oracle::Mat3::Identity(), {0, 0.004, 0}}}, false);
    const auto& layout = run.model.layout;
    run.state.touches.assign(layout.rows() * kernels::kTouchReals * kernels::kLanes, T(0));
    run.state.touches[layout.at(0, 1, kernels::kTouchReals, kernels::kTouchNormal + 1)] = T(1);
    run.state.touches[layout.at(0, 1, kernels::kTouchReals, kernels::kTouchLoad)] = T(load);
    oracle::State state = run.get(0);
    state.velocity.col(1) = Vector3d(3, -2, 0);
    run.set(0, state);
    run.parameters.step = kStep;
    run.collide({block().view(0.5)});
    EXPECT_NEAR(run.get(0).velocity(0, 1), std::max(0.0, 3 - 0.5 * (2 + load)), 1e-4) << load;
    EXPECT_EQ(run.state.touches[layout.at(0, 1, kernels::kTouchReals, kernels::kTouchLoad)], 0);
  }
}

// On a sphere of small facets: within what a neighbouring facet's normal would change, and never left inside.
TYPED_TEST(KernelResponse, FollowsTheReferenceOnASphere) {
  constexpr double kRadius = 0.06, kFacetAngle = 0.08;
  static const MeshSolid sphere(icosphere(kRadius, 4), 0.006);
  const oracle::MeshDistance mesh(sphere.surface.vertices, sphere.surface.triangles);
  const oracle::Solid expected = oracle::sphere({0, 0, 0}, kRadius);
  std::mt19937 generator(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int touched = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d out = Vector3d(uniform(generator), uniform(generator), uniform(generator)).normalized();
    const Particle particle{(kRadius + 0.001 * uniform(generator)) * out,
                            Vector3d(uniform(generator), uniform(generator), uniform(generator)) - out};
    if (!(expected.distance(particle.position + kStep * particle.velocity) < -1e-4)) continue;
    ++touched;
    const Particle after = this->respond(sphere.view(0.3), particle);
    const Particle reference = oracle::solid_response(expected, 0.3, particle, kStep);
    const double faster = (after.velocity - reference.velocity).norm();
    EXPECT_TRUE(faster <= 2 * kFacetAngle * particle.velocity.norm()) << faster << " m/s apart";
    EXPECT_TRUE((after.position - reference.position).norm() <= 5e-4);
    EXPECT_TRUE(mesh.signed_distance(after.position) >= -this->either(2e-7, 1e-6));
  }
  EXPECT_GT(touched, 50);
}

TYPED_TEST(KernelResponse, ExcludesRoots) {
  Points rest(3, 3);
  rest << Vector3d::Zero(), Vector3d(0, 0.004, 0), Vector3d(0, 0.008, 0);
  for (const int clamped : {1, 2}) {
    oracle::Strand strand = oracle::make_strand(rest, {});
    strand.clamped = clamped;
    StrandRun<TypeParam> run({strand}, {RootPose{oracle::Mat3::Identity(), {0, -0.006, 0}}}, false);
    const oracle::State before = run.get(0);
    run.parameters.step = kStep;
    run.collide({block().view()});
    const oracle::State after = run.get(0);
    EXPECT_EQ((after.position - before.position).leftCols(clamped).norm(), 0);
    if (clamped == 1) {
      EXPECT_NEAR(after.position(1, 1), 0, 1e-7);
    }
  }
}

// 0.42 m in one substep, through a plate of 2 cm.
TYPED_TEST(KernelResponse, StopsABulletAtAThinPlate) {
  static const MeshSolid plate(box({-0.08, -0.02, -0.08}, {0.08, 0, 0.08}, 4), 0.004);
  for (const double start : {0.005, 0.1, 0.3, 0.37}) {
    const Particle after = this->respond(plate.view(), {{0, start, 0}, {0, -100, 0}});
    EXPECT_TRUE(after.position.y() >= -1e-6) << "from " << start << " to " << after.position.y();
    EXPECT_TRUE(std::abs(after.velocity.y()) <= 1e-3) << after.velocity.y();
  }
}

// Plates as thick as a voxel, or half of one, and ways that end within the band: past the plate, or in it but
// nearer to its far side.
TYPED_TEST(KernelResponse, StopsAtPlatesAsThinAsHalfAVoxel) {
  static const MeshSolid thick(box({-0.08, -0.006, -0.08}, {0.08, 0, 0.08}, 4), 0.006, 4),
      thin(box({-0.08, -0.003, -0.08}, {0.08, 0, 0.08}, 4), 0.006, 4);
  for (const MeshSolid* plate : {&thick, &thin})
    for (int k = 0; k < 21; ++k)
      for (int step = 1; step <= 40; ++step) {
        const double start = 0.0003 * k, way = 0.0005 * step;
        const double speed = way / kStep;
        const Particle after = this->respond(plate->view(0), {{0.01, start, 0}, {1, -speed, 0}});
        EXPECT_TRUE(after.position.y() >= -1e-6)
            << "from " << start << " by " << way << ": " << after.position.y();
        if (way > start + 1e-6) {
          EXPECT_TRUE(std::abs(after.velocity.y()) <= 2e-3 * speed)
              << "from " << start << " by " << way << ": " << after.velocity.y() << " m/s at "
              << after.position.y();
          EXPECT_NEAR(after.position.x(), 0.01 + kStep, 1e-4) << "it slides on for the rest of its time";
        }
      }
}

// A plate that swings through resting hair takes it along, though no particle moves by itself.
TYPED_TEST(KernelResponse, TakesAlongWhatARotatingPlateMeets) {
  static const MeshSolid plate(box({-0.08, -0.006, -0.08}, {0.08, 0, 0.08}, 4), 0.006, 4);
  kernels::SolidView solid = plate.view(0);
  const double turn = 0.25;  // about z: the end at x = 0.07 rises by 17 mm
  const Eigen::Matrix3d after = Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
  for (int k = 0; k < 9; ++k) solid.rotation[k] = after(k / 3, k % 3);
  for (const double height : {0.001, 0.006, 0.012}) {
    const Particle met = this->respond(solid, {{0.07, height, 0}, Vector3d::Zero()});
    const Vector3d seen = after.transpose() * met.position;
    EXPECT_TRUE(seen.y() >= -1e-6) << "from " << height << ": " << seen.y() << " m above the plate";
    EXPECT_GT(met.velocity.y(), 1) << "the plate's end rises at some 4 m/s";
  }
}

// Figures of the contact stage: strains without projection, speeds, and who is beyond a limit.
TYPED_TEST(KernelResponse, ReportsStrandsBeyondTheLimits) {
  Points rest(3, 3);
  rest << Vector3d::Zero(), Vector3d(0, 0.004, 0), Vector3d(0, 0.008, 0);
  const oracle::Strand strand = oracle::make_strand(rest, {});
  const RootPose buried{oracle::Mat3::Identity(), {0, -0.0065, 0}},
      away{oracle::Mat3::Identity(), {0, 0.5, 0}};
  const struct {
    double strain, speed;
    bool diverged;
  } cases[] = {{10, 10, false}, {0.1, 10, true}, {10, 0.01, true}};
  for (const auto& c : cases) {
    StrandRun<TypeParam> run({strand, strand}, {buried, away}, false);
    run.parameters.step = kStep;
    run.parameters.strain_limit = c.strain, run.parameters.speed_limit = c.speed;
    oracle::State state = run.get(0);
    state.velocity.col(2) = Vector3d(0.5, 0.2, 0);
    run.set(0, state);
    run.collide({block().view()});
    const double strain = oracle::worst_edge_strain(strand, run.get(0).position);
    EXPECT_GT(strain, 0.2) << "particle 1 was pushed out by 2.5 mm";
    EXPECT_NEAR(run.contact_figure(0, kernels::kContactStrain), strain, 1e-5);
    EXPECT_NEAR(run.contact_figure(0, kernels::kContactSpeed), std::hypot(0.5, 0.2), 1e-5);
    EXPECT_EQ(run.contact_figure(0, kernels::kContactDiverged), c.diverged ? 1 : 0)
        << c.strain << " " << c.speed;
    EXPECT_EQ(run.contact_figure(1, kernels::kContactDiverged), 0) << "touches nothing";
  }
}

// A segment of 12 cm falls on a rod as thick as a finger that lies halfway between its particles.
TYPED_TEST(KernelResponse, KeepsAThinRodFromPassingBetweenParticles) {
  static const MeshSolid rod(box({0.052, -0.028, -0.04}, {0.068, -0.012, 0.04}, 4), 0.004);
  Points rest(3, 3);
  rest << Vector3d(-0.01, 0, 0), Vector3d::Zero(), Vector3d(0.12, 0, 0);
  StrandRun<TypeParam> run({oracle::make_strand(rest, {1e6, 1e6, 1e6, 0, 0})}, {RootPose{}}, false);
  run.parameters.length_iterations = 8;
  constexpr double kRodMiddle = 0.06, kRodCentre = -0.02;
  for (int k = 0; k < 240; ++k) {
    run.step({RootPose{}}, kStep);
    run.collide({rod.view()});
    const Points x = run.get(0).position;
    const double t = (kRodMiddle - x(0, 1)) / (x(0, 2) - x(0, 1));
    const double height = x(1, 1) + t * (x(1, 2) - x(1, 1));
    ASSERT_TRUE(t > 0 && t < 1 && height > kRodCentre) << "at y = " << height << " after " << k << " steps";
  }
  EXPECT_LT(run.get(0).position(1, 2), -0.02);  // it lies on the rod
}

}  // namespace
}  // namespace ringlet::kernels_testing
