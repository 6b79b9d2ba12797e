// Hair that a solid holds, in contact with other hair: it bears what lies on it, gives way along the surface
// and off it, and the solid's own answer is left to the solid.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_support.h"

namespace ringlet::kernels_testing {
namespace {

constexpr double kRadius = 2e-4, kFall = 0.05;  // [m], [m/s]

// A strand along x, and one along z that lies across its middle, from above; or one along y, and one along z
// that lies against its middle from the side.
template <class T>
class HeldHair : public testing::Test {
 protected:
  using Run = HairRun<T>;
  static constexpr double kRounding = sizeof(T) == 8 ? 1e-10 : 1e-7;
  static inline const Vec3 kUp = Vec3::UnitY();

  static Run crossed(const Vec3& apart) {
    const Vec3 along = apart.x() > 0 ? Vec3::UnitY() : Vec3::UnitX();
    return Run({straight_strand(Vec3::Zero(), 0.02 * along, 2, Vec3::Zero()),
                straight_strand(2 * kRadius * apart, Vec3(0, 0, 0.02), 2, Vec3::Zero())},
               kRadius, 0);
  }
  // A solid that is at rest, and was below the strand at the substep's start.
  static void hold(Run& run, std::size_t strand, const Vec3& normal, double friction = 0) {
    for (int i = 0; i < 2; ++i) run.hold(strand, i, normal, Vec3::Zero(), friction);
  }
  // A substep at this velocity.
  static void fly(Run& run, std::size_t strand, const Vec3& velocity) {
    for (int i = 0; i < 2; ++i) {
      run.set_velocity(strand, i, velocity);
      run.set_position(strand, i, run.position(strand, i) + Run::kStep * velocity);
    }
  }
  static std::int64_t one_pass(Run& run) {
    run.contacts->begin(run.contact_step());
    return run.contacts->pass(run.contact_step());
  }
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(HeldHair, Precisions);

TYPED_TEST(HeldHair, BearsHairThatFallsAsItDoes) {
  auto run = this->crossed(this->kUp);
  for (const std::size_t strand : {0, 1}) this->fly(run, strand, -kFall * this->kUp);
  this->hold(run, 0, this->kUp);
  const auto fallen = run.position(0, 0);
  ASSERT_EQ(this->one_pass(run), 1);
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(run.velocity(1, i).norm(), 0, this->kRounding) << i;
    EXPECT_GE(run.position(1, i).y(), 2 * kRadius * (1 - 1e-3)) << i;
    EXPECT_LE(run.position(1, i).y(), 2 * kRadius + 0.6 * kFall * run.kStep) << i;
  }
  // As it falls; its solid will see to that.
  EXPECT_EQ(run.position(0, 0), fallen);
  EXPECT_NEAR((run.velocity(0, 0) + kFall * this->kUp).norm(), 0, 1e-8);
}

TYPED_TEST(HeldHair, IsStruckAsHairThatHasStopped) {
  // Along x, where the lower strand slides: Coulomb's friction on the solid has taken mu * kFall of that.
  const double mu = 0.3;
  auto run = this->crossed(this->kUp);
  run.step.friction = 10;  // sticks on the lower
  for (const std::size_t strand : {0, 1}) this->fly(run, strand, Vec3(0.1, -kFall, 0));
  this->hold(run, 0, this->kUp, mu);
  ASSERT_EQ(this->one_pass(run), 1);
  // Both have the same mass: half of the slip each.
  EXPECT_NEAR(run.velocity(1, 0).x(), 0.1 - 0.5 * mu * kFall, 1e-6);
  EXPECT_NEAR(run.velocity(1, 0).y(), 0, 1e-6);
}

TYPED_TEST(HeldHair, GivesWayAlongTheSurface) {
  auto run = this->crossed(Vec3::UnitX()), free = this->crossed(Vec3::UnitX());
  for (auto* each : {&run, &free}) {
    this->fly(*each, 1, Vec3(-0.1, 0, 0));
    if (each == &run) this->hold(run, 1, this->kUp);
    ASSERT_EQ(this->one_pass(*each), 1);
  }
  for (const std::size_t strand : {0, 1})
    for (int i = 0; i < 2; ++i) {
      EXPECT_EQ(run.velocity(strand, i), free.velocity(strand, i)) << strand << " " << i;
      EXPECT_EQ(run.position(strand, i), free.position(strand, i)) << strand << " " << i;
    }
}

TYPED_TEST(HeldHair, IsLiftedOffTheSurface) {
  // The upper of the two was pressed flat with the lower, and both fall on.
  auto run = this->crossed(0.1 * this->kUp);
  for (const std::size_t strand : {0, 1}) {
    this->fly(run, strand, -kFall * this->kUp), this->hold(run, strand, this->kUp);
  }
  ASSERT_EQ(this->one_pass(run), 1);
  EXPECT_GE(run.position(1, 0).y(), 2 * kRadius * (1 - 1e-3));
  EXPECT_NEAR(run.velocity(1, 0).y(), 0, 1e-6);  // that of the solid, and not of its fall
  EXPECT_NEAR(run.velocity(0, 0).y(), -kFall, 1e-6);
}

TYPED_TEST(HeldHair, OfTwoSolidsThatPressItTogetherStaysToThem) {
  auto run = this->crossed(0.5 * this->kUp);
  this->fly(run, 0, -kFall * this->kUp), this->fly(run, 1, kFall * this->kUp);
  this->hold(run, 0, this->kUp), this->hold(run, 1, -this->kUp);
  const auto position = run.state.position, velocity = run.state.velocity;
  ASSERT_EQ(this->one_pass(run), 1);
  EXPECT_TRUE(run.state.position == position && run.state.velocity == velocity);
}

TYPED_TEST(HeldHair, ThatLeavesTheSolidIsFree) {
  auto run = this->crossed(0.5 * this->kUp), free = this->crossed(0.5 * this->kUp);
  for (auto* each : {&run, &free}) {
    this->fly(*each, 0, kFall * this->kUp), this->fly(*each, 1, -kFall * this->kUp);
    if (each == &run) this->hold(run, 0, this->kUp);
    ASSERT_EQ(this->one_pass(*each), 1);
  }
  EXPECT_TRUE(run.state.position == free.state.position && run.state.velocity == free.state.velocity);
}

}  // namespace
}  // namespace ringlet::kernels_testing
