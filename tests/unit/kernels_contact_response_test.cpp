// What contacts do to strands: momentum, energy, Coulomb's cone, and nothing where nothing touches.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "contact_support.h"

namespace ringlet::kernels_testing {
namespace {

constexpr double kRadius = 4e-5;
constexpr double kRounding = 3e-11;  // [m] or [m/s]: impulses are rounded so that their sums are exact

template <class T>
class ContactResponse : public testing::Test {
 protected:
  static constexpr bool kDouble = sizeof(T) == 8;
  static double either(double in_double, double in_float) { return kDouble ? in_double : in_float; }

  // Strands of 4 cm that fly through a box of 4 cm in all directions.
  static std::vector<HairStrand> tangle(int strands) {
    std::mt19937 engine(3);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto vector = [&](double size) {
      return Vec3(size * uniform(engine), size * uniform(engine), size * uniform(engine));
    };
    std::vector<HairStrand> made;
    for (int s = 0; s < strands; ++s)
      made.push_back(straight_strand(vector(0.02), 0.04 * vector(1).normalized(), 6, vector(0.5)));
    return made;
  }
  struct Sums {
    Vec3 momentum = Vec3::Zero(), place = Vec3::Zero();
    double energy = 0;
  };
  static Sums sums_of(const HairRun<T>& run) {
    Sums sums;
    for (std::size_t s = 0; s < run.strands(); ++s)
      for (int i = 0; i < run.count(s); ++i) {
        sums.momentum += run.velocity(s, i), sums.place += run.position(s, i);
        sums.energy += 0.5 * run.velocity(s, i).squaredNorm();
      }
    return sums;
  }
  // Each particle flies as it does for a frame.
  static void fly(HairRun<T>& run) {
    run.remember();
    for (std::size_t s = 0; s < run.strands(); ++s)
      for (int i = 0; i < run.count(s); ++i)
        run.set_position(s, i, run.position(s, i) + HairRun<T>::kFrame * run.velocity(s, i));
  }
  static HairContactFigures one_pass(HairRun<T>& run) {
    HairContactFigures found = run.contacts->begin(run.contact_step());
    run.contacts->count_crossings(run.contact_step(), found);
    found.contacts = run.contacts->pass(run.contact_step());
    return found;
  }

  // A strand along x, and one along z above it that comes down on it with `velocity`, about to go through.
  static std::vector<HairStrand> cross(const Vec3& velocity) {
    return {straight_strand(Vec3(0, 0, 0), Vec3(0.02, 0, 0), 2, Vec3::Zero()),
            straight_strand(Vec3(0, 0.001, 0), Vec3(0, 0, 0.02), 2, velocity)};
  }
  // Of the upper strand against the lower, where these are at (x, z), seen from above.
  static Vec3 relative(const Vec3& lower0, const Vec3& lower1, const Vec3& upper0, const Vec3& upper1,
                       double share_lower, double share_upper) {
    return upper0 + share_upper * (upper1 - upper0) - lower0 - share_lower * (lower1 - lower0);
  }
  // Where they meet when the upper strand has moved aside by (x, z) until then, as shares of the lower and of
  // the upper.
  static std::array<double, 2> meeting(double x, double z) { return {0.5 + x / 0.02, 0.5 - z / 0.02}; }
  static Vec3 relative_velocity(const HairRun<T>& run, double x, double z) {
    const auto at = meeting(x, z);
    return relative(run.velocity(0, 0), run.velocity(0, 1), run.velocity(1, 0), run.velocity(1, 1), at[0],
                    at[1]);
  }
  static Vec3 relative_position(const HairRun<T>& run, double x, double z) {
    const auto at = meeting(x, z);
    return relative(run.position(0, 0), run.position(0, 1), run.position(1, 0), run.position(1, 1), at[0],
                    at[1]);
  }
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(ContactResponse, Precisions);

TYPED_TEST(ContactResponse, KeepsMomentumAndMakesNoEnergy) {
  HairRun<TypeParam> run(this->tangle(200), kRadius, 0);
  this->fly(run);
  double most_removed = 0;
  for (int pass = 0; pass < 4; ++pass) {
    const auto before = this->sums_of(run);
    const HairContactFigures found = this->one_pass(run);
    const auto after = this->sums_of(run);
    if (pass == 0) {
      EXPECT_GT(found.crossings, 1000);
    }
    // Sums over 1,200 particles of some 0.5 m/s, and of some 2 cm.
    EXPECT_NEAR((after.momentum - before.momentum).norm(), 0, this->either(1e-12, 1e-5)) << pass;
    EXPECT_NEAR((after.place - before.place).norm(), 0, this->either(1e-12, 1e-6)) << pass;
    EXPECT_LE(after.energy, before.energy * (1 + 1e-7)) << pass;
    most_removed = std::max(most_removed, 1 - after.energy / before.energy);
  }
  EXPECT_GT(most_removed, 0.1);  // inelastic
}

TYPED_TEST(ContactResponse, StopsTheApproachAndPutsTheStrandsBack) {
  HairRun<TypeParam> run(this->cross(Vec3(0, -0.1, 0)), kRadius, 0);
  this->fly(run);
  const HairContactFigures found = this->one_pass(run);
  EXPECT_EQ(found.contacts, 1);
  EXPECT_EQ(found.crossings, 1);
  EXPECT_NEAR(this->relative_velocity(run, 0, 0).norm(), 0, this->either(kRounding, 1e-7));
  // One above the other again; half of the way each, and somewhat more (relaxation).
  const double above = run.position(1, 0).y() - run.position(0, 0).y();
  EXPECT_GE(above, 2 * kRadius * (1 - 1e-3));
  EXPECT_LE(above, 2 * kRadius + 0.6 * (0.1 * HairRun<TypeParam>::kFrame));
}

TYPED_TEST(ContactResponse, FrictionIsOnCoulombsCone) {
  const double mu = 0.3, down = 0.1;
  for (const double aside : {0.01, 0.029, 0.031, 0.1, 0.4}) {
    HairRun<TypeParam> run(this->cross(Vec3(0.6 * aside, -down, 0.8 * aside)), kRadius, 0);
    run.step.friction = TypeParam(mu);
    this->fly(run);
    ASSERT_EQ(this->one_pass(run).contacts, 1);
    const double until = 0.001 / down;  // they meet
    const Vec3 left = this->relative_velocity(run, 0.6 * aside * until, 0.8 * aside * until);
    EXPECT_NEAR(left.y(), 0, this->either(kRounding, 1e-7)) << aside;
    // Below the cone it sticks, beyond it mu times what stopped the approach is gone.
    const double expected = std::max(0.0, aside - mu * down);
    EXPECT_NEAR(std::hypot(left.x(), left.z()), expected, this->either(kRounding, 1e-7)) << aside;
    if (expected > 0) {
      EXPECT_NEAR(left.x() / left.z(), 0.75, this->either(1e-7, 1e-4)) << aside;
    }
  }
}

TYPED_TEST(ContactResponse, SlipOfPlacesIsUndoneBelowTheCone) {
  // The upper strand lies on the lower and falls, and as far as `aside` says against its fall it slides.
  const double mu = 0.3, fall = 0.002;
  for (const double aside : {0.1, 0.29, 0.5}) {
    HairRun<TypeParam> run(this->cross(Vec3::Zero()), kRadius, 0);
    run.step.friction = TypeParam(mu);
    const auto lift = [&](const Vec3& by) {
      for (int i = 0; i < 2; ++i) run.set_position(1, i, run.position(1, i) + by);
    };
    lift(Vec3(0, 1e-7 - 0.001, 0));
    run.remember();
    lift(fall * Vec3(aside, -1, 0));
    ASSERT_EQ(this->one_pass(run).contacts, 1);
    const double slid = this->relative_position(run, 0, 0).x() / fall;
    EXPECT_NEAR(slid, std::max(0.0, aside - mu), 0.02) << aside;  // the radii count as fall too: 4 %
  }
}

TYPED_TEST(ContactResponse, NeverPulls) {
  HairRun<TypeParam> run(this->cross(Vec3(0.05, 0.1, 0.02)), kRadius, 0);  // overlapping and parting
  for (int i = 0; i < 2; ++i) {
    Vec3 at = run.position(1, i);
    at.y() = kRadius;
    run.set_position(1, i, at);
  }
  run.remember();
  ASSERT_EQ(this->one_pass(run).contacts, 1);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(run.velocity(0, i), Vec3::Zero());
    EXPECT_NEAR((run.velocity(1, i) - Vec3(0.05, 0.1, 0.02)).norm(), 0, 1e-8);
  }
  EXPECT_GE(run.position(1, 0).y() - run.position(0, 0).y(), 2 * kRadius * (1 - 1e-3));
}

TYPED_TEST(ContactResponse, WhatDoesNotTouchStaysAsItIsBitForBit) {
  std::vector<HairStrand> strands;
  for (int k = 0; k < 20; ++k)  // side by side and across, farther apart than they are thick, all on the move
    strands.push_back(straight_strand(Vec3(0, 1.2e-4 * k, 1e-3 * k),
                                      k % 2 ? Vec3(0.02, 0, 0) : Vec3(0, 0, 0.02), 5, Vec3(0.3, -1, 0.2)));
  HairRun<TypeParam> run(strands, kRadius, 0);
  this->fly(run);
  const auto position = run.state.position, velocity = run.state.velocity;
  const HairContactFigures found = this->one_pass(run);
  EXPECT_GT(found.pairs, 0);
  EXPECT_EQ(found.contacts, 0);
  EXPECT_TRUE(run.state.position == position && run.state.velocity == velocity);
}

TYPED_TEST(ContactResponse, OneStrandDoesNotMeetItself) {
  HairStrand loop;
  for (int i = 0; i < 12; ++i)  // two turns of a helix flat as a ring
    loop.points.push_back(Vec3(0.01 * std::cos(1.1 * i), 2e-6 * i, 0.01 * std::sin(1.1 * i)));
  HairRun<TypeParam> run({loop}, kRadius, 0);
  this->fly(run);
  const auto position = run.state.position;
  EXPECT_EQ(this->one_pass(run).pairs, 0);
  EXPECT_TRUE(run.state.position == position);
}

TYPED_TEST(ContactResponse, RootsAreObstaclesThatDoNotMove) {
  auto strands = this->cross(Vec3(0, -0.1, 0));
  strands[0].points = {Vec3(-0.01, 0, 0), Vec3(0.01, 0, 0)};  // prescribed from end to end
  strands[1].points = {Vec3(0, 0.001, -0.03), Vec3(0, 0.001, -0.02), Vec3(0, 0.001, 0.01),
                       Vec3(0, 0.001, 0.03)};
  HairRun<TypeParam> run(strands, kRadius, 2);
  run.remember();
  for (int i = 2; i < 4; ++i) run.set_position(1, i, run.position(1, i) - Vec3(0, 0.004, 0));
  const Vec3 roots[4] = {run.position(0, 0), run.position(0, 1), run.position(1, 0), run.position(1, 1)};
  EXPECT_EQ(this->one_pass(run).crossings, 1);
  EXPECT_EQ(run.position(0, 0), roots[0]);
  EXPECT_EQ(run.position(0, 1), roots[1]);
  EXPECT_EQ(run.position(1, 0), roots[2]);
  EXPECT_EQ(run.position(1, 1), roots[3]);
  EXPECT_GT(run.position(1, 2).y(), 0);
}

TYPED_TEST(ContactResponse, HairWithoutSegmentsHasNone) {
  HairRun<TypeParam> run({{{Vec3::Zero()}}, {{Vec3(0, 1e-5, 0)}}}, kRadius, 0);
  this->fly(run);
  EXPECT_EQ(this->one_pass(run).pairs, 0);
  EXPECT_EQ(run.position(1, 0), Vec3(0, 1e-5, 0));
}

TYPED_TEST(ContactResponse, AStrandFarAwayChangesNothingHere) {
  const auto contacts_with = [&](const std::vector<HairStrand>& more) {
    auto strands = this->tangle(200);
    strands.insert(strands.end(), more.begin(), more.end());
    HairRun<TypeParam> run(strands, kRadius, 0);
    this->fly(run);
    const HairContactFigures found = this->one_pass(run);
    EXPECT_LT(run.contacts->bytes(), 20u << 20);
    return static_cast<double>(found.contacts);
  };
  const double alone = contacts_with({});
  const HairStrand lost = straight_strand(Vec3(300, -500, 100), Vec3(0.01, 0, 0), 5, Vec3(900, 0, 0));
  EXPECT_NEAR(contacts_with({lost}), alone, 0.01 * alone);
  HairStrand broken = lost;
  broken.points[2].y() = std::nan("");
  EXPECT_NEAR(contacts_with({broken}), alone, 0.01 * alone);
}

// Of more pairs than contacts may look at some are left out: what the others do is a contact's doing still.
TYPED_TEST(ContactResponse, ABundleOfMorePairsThanThereIsRoomForKeepsItsMomentum) {
  constexpr int kStrands = 600, kMost = 1 << 18;  // some 900,000 pairs of segments lie within reach
  auto strands = this->tangle(kStrands);
  for (HairStrand& strand : strands)
    for (int i = 0; i < 6; ++i)
      strand.points[i] = Vec3(5e-3 * strand.points[0].x(), 0.008 * i, 5e-3 * strand.points[0].z());
  HairRun<TypeParam> run(strands, kRadius, 0);
  this->fly(run);
  const auto before = this->sums_of(run);
  const HairContactFigures found = this->one_pass(run);
  const auto after = this->sums_of(run);
  EXPECT_LE(found.pairs, kMost);
  EXPECT_GT(found.pairs, kMost / 2);
  EXPECT_NEAR((after.momentum - before.momentum).norm(), 0, this->either(1e-11, 1e-4));
  EXPECT_LT(after.energy, 0.95 * before.energy);
}

TYPED_TEST(ContactResponse, AThingThatMovesAsAWholeIsLeftAlone) {
  // At 30 m/s, turning by a third of a revolution a frame.
  HairRun<TypeParam> run(this->tangle(60), kRadius, 0);
  run.passes = 64;
  this->fly(run);
  run.collide(HairRun<TypeParam>::kFrame);  // without overlaps from here on, or nearly
  run.remember();
  const Mat3 turn = Eigen::AngleAxisd(2.1, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  std::vector<Pose> before, after;
  for (std::size_t s = 0; s < run.strands(); ++s) {
    std::vector<Vec3> points;
    for (int i = 0; i < run.count(s); ++i) points.push_back(turn * run.position(s, i) + Vec3(1, 0.5, 0));
    for (int i = 0; i < run.count(s); ++i) run.set_position(s, i, points[i]);
  }
  EXPECT_EQ(this->one_pass(run).crossings, 0);
}

}  // namespace
}  // namespace ringlet::kernels_testing
