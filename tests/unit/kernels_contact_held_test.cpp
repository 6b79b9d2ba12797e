// Hair that a solid holds, in contact with other hair: it bears what lies on it, gives way along the surface
// and off it, and the solid's own answer is left to the solid.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_support.h"

namespace ringlet::kernels_testing {
namespace {

constexpr double kRadius = 2e-4, kFall = 0.05;  // [m], [m/s]

// A strand along x, and one along z that lies across the middle of its last segment, from above; or one along
// y, and one along z that lies against it from the side. Each has a root 10 cm away, which is prescribed, and
// a segment of 2 cm beyond: what the root takes of the motion is its share of the places' stiffness, under
// 1e-4.
template <class T>
class HeldHair : public testing::Test {
 protected:
  using Run = HairRun<T>;
  static constexpr double kNear = 1e-4;
  static inline const Vec3 kUp = Vec3::UnitY();

  static HairStrand strand(const Vec3& middle, const Vec3& along) {
    return {{middle - 0.11 * along, middle - 0.01 * along, middle + 0.01 * along}, Vec3::Zero()};
  }
  static Run crossed(const Vec3& apart) {
    const Vec3 along = apart.x() > 0 ? Vec3::UnitY() : Vec3::UnitX();
    return Run({strand(Vec3::Zero(), along), strand(2 * kRadius * apart, Vec3::UnitZ())}, kRadius, 1);
  }
  // A solid that is at rest, and was below the strand at the substep's start.
  static void hold(Run& run, std::size_t strand, const Vec3& normal, double friction = 0) {
    for (const int i : {1, 2}) run.hold(strand, i, normal, Vec3::Zero(), friction);
  }
  // A substep at this velocity.
  static void fly(Run& run, std::size_t strand, const Vec3& velocity) {
    for (const int i : {1, 2}) {
      run.set_velocity(strand, i, velocity);
      run.set_position(strand, i, run.position(strand, i) + Run::kStep * velocity);
    }
  }
  static std::int64_t pass(Run& run, int passes = 1) {
    run.contacts->begin(run.contact_step());
    const std::int64_t found = run.contacts->pass(run.contact_step());
    for (int more = 1; more < passes; ++more) run.contacts->pass(run.contact_step());
    return found;
  }
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(HeldHair, Precisions);

TYPED_TEST(HeldHair, BearsHairThatFallsAsItDoes) {
  for (const int passes : {1, 4}) {
    auto run = this->crossed(this->kUp);
    for (const std::size_t strand : {0, 1}) this->fly(run, strand, -kFall * this->kUp);
    this->hold(run, 0, this->kUp);
    const Vec3 fallen = run.position(0, 1);
    ASSERT_EQ(this->pass(run, passes), 1);
    for (const int i : {1, 2}) {
      EXPECT_NEAR(run.velocity(1, i).norm(), 0, this->kNear * kFall * passes) << i;
      EXPECT_GE(run.position(1, i).y(), 2 * kRadius * (1 - 1e-3)) << i;
      EXPECT_LE(run.position(1, i).y(), 2 * kRadius + 0.6 * kFall * run.kStep) << i;
      // The other falls on; its solid will see to that, and feels the weight of both.
      EXPECT_NEAR(run.load(0, i), kFall, 1e-3 * kFall) << i;
    }
    EXPECT_NEAR((run.position(0, 1) - fallen).norm(), 0, 1e-9);
    EXPECT_NEAR((run.velocity(0, 1) + kFall * this->kUp).norm(), 0, 1e-8);
  }
}

TYPED_TEST(HeldHair, IsStruckAsHairThatHasStopped) {
  // Both slide along x. Coulomb's friction on the solid will take mu kFall of that from the lower one.
  const double mu = 0.3;
  auto run = this->crossed(this->kUp);
  run.step.friction = 10;  // on one another they stick
  for (const std::size_t strand : {0, 1}) this->fly(run, strand, Vec3(0.1, -kFall, 0));
  this->hold(run, 0, this->kUp, mu);
  ASSERT_EQ(this->pass(run), 1);
  // They have the same mass: half of the slip each.
  for (const int i : {1, 2}) {
    EXPECT_NEAR(run.velocity(1, i).x(), 0.1 - 0.5 * mu * kFall, 1e-5) << i;
    EXPECT_NEAR(run.velocity(0, i).x(), 0.1 + 0.5 * mu * kFall, 1e-4) << i;
    EXPECT_NEAR(run.velocity(1, i).y(), 0, 1e-5) << i;
  }
}

TYPED_TEST(HeldHair, GivesWayAlongTheSurface) {
  auto run = this->crossed(Vec3::UnitX());
  this->fly(run, 1, Vec3(-0.1, -kFall, 0));
  this->hold(run, 1, this->kUp);
  ASSERT_EQ(this->pass(run), 1);
  for (const int i : {1, 2}) {  // half of the approach each, as if it were free
    EXPECT_NEAR(run.velocity(0, i).x(), -0.05, 1e-4) << i;
    EXPECT_NEAR(run.velocity(1, i).x(), -0.05, 1e-4) << i;
    EXPECT_NEAR(run.velocity(1, i).y(), -kFall, 1e-4) << i;
    EXPECT_NEAR(run.load(1, i), 0, 1e-6) << i;
  }
}

TYPED_TEST(HeldHair, IsLiftedOffTheSurface) {
  // The upper of the two was pressed flat with the lower, and both fall on.
  auto run = this->crossed(0.1 * this->kUp);
  for (const std::size_t strand : {0, 1})
    this->fly(run, strand, -kFall * this->kUp), this->hold(run, strand, this->kUp);
  ASSERT_EQ(this->pass(run, 4), 1);
  EXPECT_GE(run.position(1, 1).y(), 2 * kRadius * (1 - 1e-2));
  EXPECT_NEAR(run.velocity(1, 1).y(), 0, 1e-5);  // that of the solid, and not of its fall
  EXPECT_NEAR(run.velocity(0, 1).y(), -kFall, 1e-5);
}

// Struck from below it flies up, however little it overlaps: a solid holds nothing back.
TYPED_TEST(HeldHair, IsStruckOffTheSurface) {
  for (const double overlap : {1e-9, 1e-5}) {
    auto run = this->crossed((1 - overlap / (2 * kRadius)) * this->kUp);
    this->fly(run, 1, -kFall * this->kUp), this->hold(run, 1, this->kUp);
    for (const int i : {1, 2}) run.set_velocity(0, i, 0.04 * this->kUp);
    ASSERT_EQ(this->pass(run), 1);
    EXPECT_NEAR(run.velocity(1, 1).y(), 0.02, 1e-5) << overlap;
    EXPECT_NEAR(run.velocity(0, 1).y(), 0.02, 1e-5) << overlap;
  }
}

// Between one that lifts it and one that strikes it from above: what solids hold makes no energy.
TYPED_TEST(HeldHair, BetweenTwoMakesNoEnergy) {
  const auto across = [&](double height, double share) {
    return this->strand(Vec3(0.02 * (share - 0.5), height, 0), Vec3::UnitZ());
  };
  for (const double share : {0.15, 0.3, 0.5}) {
    typename TestFixture::Run run({across(-2 * kRadius + 1e-4, 0.5),
                                   this->strand(Vec3::Zero(), Vec3::UnitX()), across(2 * kRadius, share)},
                                  kRadius, 1);
    this->fly(run, 1, -kFall * this->kUp), this->hold(run, 1, this->kUp);
    for (const int i : {1, 2}) run.set_velocity(2, i, -0.5 * this->kUp);
    const auto energy = [&] {
      double sum = 0;
      for (const std::size_t strand : {0, 1, 2})
        for (const int i : {1, 2}) sum += 0.5 * run.velocity(strand, i).squaredNorm();
      return sum;
    };
    run.contacts->begin(run.contact_step());
    for (int pass = 0; pass < 4; ++pass) {
      const double before = energy();
      ASSERT_GE(run.contacts->pass(run.contact_step()), 1);
      EXPECT_LE(energy(), before * (1 + 1e-6)) << share << " " << pass;
    }
  }
}

TYPED_TEST(HeldHair, OfTwoSolidsThatPressItTogetherStaysToThem) {
  auto run = this->crossed(0.5 * this->kUp);
  this->fly(run, 0, -kFall * this->kUp), this->fly(run, 1, kFall * this->kUp);
  this->hold(run, 0, this->kUp), this->hold(run, 1, -this->kUp);
  const auto position = run.state.position, velocity = run.state.velocity;
  ASSERT_EQ(this->pass(run), 1);
  EXPECT_TRUE(run.state.position == position && run.state.velocity == velocity);
}

TYPED_TEST(HeldHair, ThatLeavesTheSolidIsFree) {
  auto run = this->crossed(0.5 * this->kUp), free = this->crossed(0.5 * this->kUp);
  for (auto* each : {&run, &free}) {
    this->fly(*each, 0, kFall * this->kUp), this->fly(*each, 1, -kFall * this->kUp);
    if (each == &run) this->hold(run, 0, this->kUp);
    ASSERT_EQ(this->pass(*each), 1);
  }
  EXPECT_TRUE(run.state.position == free.state.position && run.state.velocity == free.state.velocity);
}

// Where the roots are driven elsewhere the head has gone with them, and a floor has not.
TYPED_TEST(HeldHair, IsHeldByAHeadThatMovesOnWithTheRoots) {
  const Vec3 driven = 0.3 * this->kUp;
  for (const bool home : {true, false}) {
    auto run = this->crossed(this->kUp);
    run.set_velocity(0, 0, driven);
    for (const std::size_t strand : {0, 1}) this->fly(run, strand, -kFall * this->kUp);
    for (const int i : {1, 2}) run.hold(0, i, this->kUp, Vec3::Zero(), 0, home);
    ASSERT_EQ(this->pass(run), 1);
    EXPECT_NEAR(run.velocity(1, 1).y(), home ? driven.y() : 0, 1e-3) << home;
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
