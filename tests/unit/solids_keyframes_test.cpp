#include <gtest/gtest.h>

#include <numbers>

#include "solids/keyframes.h"

namespace ringlet::solids {
namespace {

scene::Key key(double frame, Vec3 translate, double degrees = 0, double scale = 1) {
  return {frame, translate, Quat(Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3::UnitZ())), scale};
}

constexpr auto kSmooth = scene::Interpolation::kSmooth;
constexpr auto kLinear = scene::Interpolation::kLinear;

TEST(Keyframes, NoKeysIsIdentity) {
  const Similarity s = sample_keys({}, kSmooth, 7);
  EXPECT_EQ(s.translate, Vec3::Zero());
  EXPECT_TRUE(s.rotate.coeffs() == Quat::Identity().coeffs());
  EXPECT_EQ(s.scale, 1);
}

TEST(Keyframes, TheScenesMotionCarriesTheAssetsOwn) {
  scene::Animation animation{};
  animation.keys = {key(1, {0, 0, 0}), key(25, {1, 0, 0}, 0, 2)};
  animation.carrier = {key(1, {0, 0, 0}), key(49, {0, 10, 0}, 90)};
  animation.interpolation = animation.carrier_interpolation = kLinear;
  const scene::Frames frames{1, 100, 24, 0};
  const Vec3 local(0, 1, 0);
  for (const double speed : {1.0, 3.0, 10.0}) {
    animation.speed = speed;
    const Similarity s = sample_animation(animation, frames, 0.5 / speed);  // frame 13 at speed 1
    // The asset's own: 1.5 times as large, half a metre along x; then turned by 22.5 degrees and lifted.
    const Vec3 own = 1.5 * local + Vec3(0.5, 0, 0);
    const Vec3 expected = Eigen::AngleAxisd(std::numbers::pi / 8, Vec3::UnitZ()) * own + Vec3(0, 2.5, 0);
    EXPECT_LT((s.rotate * (s.scale * local) + s.translate - expected).norm(), 1e-14) << speed;
  }
}

TEST(Keyframes, HoldOutsideAndMeetEveryKey) {
  const std::vector<scene::Key> keys{key(1, {0, 0, 0}), key(3, {1, 5, 0}, 90, 2), key(10, {2, 0, 1}, 0, 0.5)};
  for (const auto interpolation : {kSmooth, kLinear}) {
    EXPECT_EQ(sample_keys(keys, interpolation, -4).translate, keys[0].translate);
    EXPECT_EQ(sample_keys(keys, interpolation, 99).translate, keys[2].translate);
    EXPECT_EQ(sample_keys(keys, interpolation, 3).translate, keys[1].translate);
    EXPECT_EQ(sample_keys(keys, interpolation, 3).scale, 2);
  }
}

TEST(Keyframes, LinearIsStraightAndRotationsTurnEvenly) {
  const std::vector<scene::Key> keys{key(0, {0, 0, 0}), key(4, {8, 4, 0}, 80, 3)};
  const Similarity s = sample_keys(keys, kLinear, 1);
  EXPECT_LE((s.translate - Vec3(2, 1, 0)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(s.scale, 1.5);
  EXPECT_LE(s.rotate.angularDistance(key(0, {}, 20).rotate), 1e-8);
}

// Catmull-Rom with even keys: p = ((2 b) + (c - a) s + (2 a - 5 b + 4 c - d) s^2 + (3 b - a - 3 c + d) s^3)
// / 2.
TEST(Keyframes, SmoothIsCatmullRom) {
  const double a = 1, b = -2, c = 5, d = 3;
  const std::vector<scene::Key> keys{key(0, {a, 0, 0}), key(2, {b, 0, 0}), key(4, {c, 0, 0}),
                                     key(6, {d, 0, 0})};
  for (const double s : {0.0, 0.1, 0.5, 0.77, 1.0}) {
    const double expected = 0.5 * (2 * b + (c - a) * s + (2 * a - 5 * b + 4 * c - d) * s * s +
                                   (3 * b - a - 3 * c + d) * s * s * s);
    EXPECT_NEAR(sample_keys(keys, kSmooth, 2 + 2 * s).translate.x(), expected, 1e-14);
  }
}

// Uneven keys on a parabola: central differences miss its slopes, but a straight line must stay one.
TEST(Keyframes, SmoothKeepsEvenSpeedOverUnevenKeys) {
  const std::vector<scene::Key> keys{key(0, {0, 0, 0}), key(1, {1, 0, 0}), key(7, {7, 0, 0}),
                                     key(8, {8, 0, 0})};
  for (double frame = 0; frame <= 8; frame += 0.125)
    EXPECT_NEAR(sample_keys(keys, kSmooth, frame).translate.x(), frame, 1e-14);
}

TEST(Keyframes, EaseStartsAndEndsAtRest) {
  EXPECT_EQ(ease(0), 0);
  EXPECT_EQ(ease(1), 1);
  EXPECT_EQ(ease(-1), 0);
  EXPECT_EQ(ease(2), 1);
  EXPECT_NEAR((ease(1e-6) - ease(0)) / 1e-6, 0, 1e-5);
  EXPECT_NEAR((ease(1) - ease(1 - 1e-6)) / 1e-6, 0, 1e-5);
}

}  // namespace
}  // namespace ringlet::solids
