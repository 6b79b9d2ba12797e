// Resampling against curves known in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/error.h"
#include "groom/edit.h"

namespace ringlet::groom {
namespace {

using Curve = std::function<Vec3(double)>;  // of 0 to 1

Strands one(const std::vector<Vec3>& points) {
  Strands strands;
  strands.points = points;
  strands.offsets.push_back(static_cast<std::int64_t>(points.size()));
  strands.groups = {0};
  strands.group_names = {"one"};
  return strands;
}

Strands sampled(const Curve& curve, int particles) {
  std::vector<Vec3> points;
  for (int i = 0; i < particles; ++i) points.push_back(curve(static_cast<double>(i) / (particles - 1)));
  return one(points);
}

Vec3 helix(double t) {
  const double a = 6 * std::numbers::pi * t;
  return {0.01 * std::cos(a), 0.02 * t, 0.01 * std::sin(a)};
}

// How far a resampled helix is from the helix, and its spacing from even.
double error_of_helix(int particles, int resampled) {
  const Strands strands = resample(sampled(helix, particles), resampled, {});
  double worst = 0;
  for (int i = 0; i < resampled; ++i)
    worst = std::max(
        worst, (strands.points[static_cast<std::size_t>(i)] - helix(static_cast<double>(i) / (resampled - 1)))
                   .norm());
  return worst;
}

TEST(GroomResample, AHelixStaysThatHelixToThirdOrder) {
  const double coarse = error_of_helix(31, 200), fine = error_of_helix(61, 200);
  EXPECT_LE(coarse, 0.03 * 0.01);
  EXPECT_GE(coarse / fine, 6);
}

TEST(GroomResample, RootAndTipStayToTheLastBitAndTheRestLiesEvenly) {
  const Strands before = sampled(helix, 40);
  for (const int particles : {2, 3, 17, 400}) {
    const Strands after = resample(before, particles, {});
    ASSERT_EQ(after.points.size(), static_cast<std::size_t>(particles));
    EXPECT_EQ(after.points.front(), before.points.front());
    EXPECT_EQ(after.points.back(), before.points.back());
  }
  // Chords tell arcs here: a circle's, once its points are close enough for the curve to be one.
  const Strands circle = resample(sampled(
                                      [](double t) {
                                        return Vec3(std::cos(t * t), std::sin(t * t), 0);  // uneven
                                      },
                                      400),
                                  21, {});
  for (std::size_t i = 0; i < 20; ++i)
    EXPECT_NEAR((circle.points[i + 1] - circle.points[i]).norm(), 2 * std::sin(0.025), 1e-6 * 0.05) << i;
}

// The lengths between the points along the curve itself are even to 1e-6: measured on a fine polyline.
TEST(GroomResample, LengthsAlongTheCurveAreEvenToAMillionth) {
  std::vector<Vec3> points;
  for (int i = 0; i < 12; ++i) points.push_back(0.01 * (i + 1) * Vec3::Random());
  const Strands few = resample(one(points), 9, {}), many = resample(one(points), 8 * 20000 + 1, {});
  std::size_t next = 0;
  double length = 0;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < many.points.size(); ++i) {
    if (i > 0) length += (many.points[i] - many.points[i - 1]).norm();
    if (next < few.points.size() && i == next * 20000) {
      EXPECT_LE((many.points[i] - few.points[next]).norm(), 1e-8);
      lengths.push_back(length);
      ++next;
    }
  }
  for (std::size_t k = 0; k < lengths.size(); ++k)
    EXPECT_NEAR(lengths[k], length * static_cast<double>(k) / 8, 1e-6 * length);
}

TEST(GroomResample, StraightStaysStraightHoweverUneven) {
  const Vec3 root(1, 2, 3), way = Vec3(1, -2, 0.5).normalized();
  std::vector<Vec3> points;
  for (const double at : {0.0, 0.1, 0.15, 0.6, 0.601, 1.0}) points.push_back(root + at * way);
  const Strands after = resample(one(points), 11, {});
  for (std::size_t i = 0; i < 11; ++i)
    EXPECT_LE((after.points[i] - (root + 0.1 * static_cast<double>(i) * way)).norm(), 1e-9) << i;
}

TEST(GroomResample, AStepDividesTheLengthEvenly) {
  const Strands line = one({Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(0, 3, 0)});
  for (const auto& [step, segments] : {std::pair(1.0, 3), {0.9, 3}, {0.8, 4}, {10.0, 1}, {0.01, 300}}) {
    const Strands after = resample(line, {}, step);
    ASSERT_EQ(after.points.size(), static_cast<std::size_t>(segments) + 1) << step;
    EXPECT_NEAR(after.points[1].y(), 3.0 / segments, 1e-9);
  }
  EXPECT_THROW(resample(line, {}, 1e-9), Error);
}

TEST(GroomResample, WidthsRootsAndGroupsFollow) {
  Strands strands = one({Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(0, 3, 0)});
  strands.points.push_back(Vec3(5, 5, 5));  // and a strand of one particle
  strands.offsets.push_back(4);
  strands.groups = {1, 0};
  strands.group_names = {"a", "b"};
  strands.roots = {{4, Vec3(1, 0, 0)}, {7, Vec3(0, 1, 0)}};
  strands.widths = {4e-5f, 3e-5f, 1e-5f, 2e-5f};
  const Strands after = resample(strands, 7, {});
  EXPECT_EQ(after.offsets, (std::vector<std::int64_t>{0, 7, 8}));
  for (std::size_t i = 0; i < 7; ++i)
    EXPECT_NEAR(after.widths[i], 4e-5f - 0.5e-5f * static_cast<float>(i), 1e-11f);
  EXPECT_EQ(after.widths[7], 2e-5f);
  EXPECT_EQ(after.groups, strands.groups);
  EXPECT_EQ(after.group_names, strands.group_names);
  EXPECT_EQ(after.roots[1].triangle, 7);
}

TEST(GroomResample, CoincidingParticlesAreNoObstacle) {
  const Strands after = resample(one({Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(0, 1, 0), Vec3(0, 2, 0)}), 5, {});
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_LE((after.points[i] - Vec3(0, 0.5 * static_cast<double>(i), 0)).norm(), 1e-9);
  const Strands point = resample(one(std::vector<Vec3>(3, Vec3(1, 2, 3))), 4, {});
  EXPECT_EQ(point.points, std::vector<Vec3>(4, Vec3(1, 2, 3)));
}

}  // namespace
}  // namespace ringlet::groom
