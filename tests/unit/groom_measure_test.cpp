// A groom's figures against closed forms.
#include "groom/measure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace ringlet::groom {
namespace {

void add(Strands& strands, const std::vector<Vec3>& points) {
  strands.points.insert(strands.points.end(), points.begin(), points.end());
  strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
}

std::vector<Vec3> helix(double radius, double rise_per_radian, double step, int particles) {
  std::vector<Vec3> points;
  for (int i = 0; i < particles; ++i)
    points.emplace_back(radius * std::cos(i * step), radius * std::sin(i * step), rise_per_radian * i * step);
  return points;
}

TEST(GroomMeasure, LengthsAndSegmentsOfKnownStrands) {
  Strands strands;
  add(strands, {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 2, 0)});  // 3
  add(strands, {Vec3(0, 0, 0), Vec3(0, 0, 5)});                 // 5
  add(strands, {Vec3(7, 0, 0)});                                // 0
  add(strands, {Vec3(0, 0, 0), Vec3(0, 4, 0)});                 // 4
  const Measures m = measure(strands);
  EXPECT_EQ(m.length->min, 0);
  EXPECT_EQ(m.length->mean, 3);
  EXPECT_EQ(m.length->median, 3.5);
  EXPECT_EQ(m.length->max, 5);
  EXPECT_EQ(m.segment->min, 1);
  EXPECT_EQ(m.segment->mean, 3);
  EXPECT_EQ(m.segment->max, 5);
  EXPECT_NEAR(m.curvature->max, std::numbers::pi / 2 / 1.5, 1e-15);  // one bend
  EXPECT_FALSE(m.root_density);
}

TEST(GroomMeasure, ACircleBendsByItsAnglesOverItsChords) {
  Strands strands;
  add(strands, helix(0.05, 0, 0.3, 40));
  const Measures m = measure(strands);
  const double expected = 0.3 / (2 * 0.05 * std::sin(0.15));
  for (const double found : {m.curvature->mean, m.curvature->median, m.curvature->max})
    EXPECT_NEAR(found, expected, 1e-11);
  EXPECT_NEAR(expected, 20, 0.1);  // 1 / radius
}

TEST(GroomMeasure, AFineHelixHasItsCurvature) {
  Strands strands;
  const double radius = 0.01, rise = 0.004;
  add(strands, helix(radius, rise, 0.01, 3000));
  EXPECT_NEAR(measure(strands).curvature->mean, radius / (radius * radius + rise * rise), 1e-3);
}

TEST(GroomMeasure, PercentileOfCurvature) {
  Strands strands;  // 199 straight corners and one right angle at the end
  std::vector<Vec3> points;
  for (int i = 0; i <= 200; ++i) points.emplace_back(i, 0, 0);
  points.emplace_back(200, 1, 0);
  add(strands, points);
  const Measures m = measure(strands);
  EXPECT_EQ(m.curvature->percentile_99, 0);
  EXPECT_NEAR(m.curvature->max, std::numbers::pi / 2, 1e-15);
  EXPECT_NEAR(m.curvature->mean, std::numbers::pi / 400, 1e-15);
}

TEST(GroomMeasure, NothingToMeasureIsNoFigure) {
  Strands strands;
  for (int i = 0; i < 8; ++i) add(strands, {Vec3(i, 0, 0)});
  const Measures m = measure(strands);
  EXPECT_FALSE(m.segment || m.curvature || m.root_density);
  EXPECT_EQ(m.length->max, 0);
  add(strands, {Vec3(8, 0, 0), Vec3(8, 0, 0), Vec3(8, 1, 0)});  // a segment of no length has no direction
  EXPECT_FALSE(measure(strands).curvature);
  EXPECT_TRUE(measure(strands).root_density);
}

TEST(GroomMeasure, RootDensityOfASquareGridIsItsClosedForm) {
  Strands strands;
  const double spacing = 0.002;
  for (int i = 0; i < 60; ++i)
    for (int j = 0; j < 60; ++j) add(strands, {Vec3(i * spacing, 0.3, j * spacing)});
  // The eighth nearest is the diagonal neighbour, at sqrt(2) spacings.
  const double expected = (8 - 1.0 / 3) / (2 * std::numbers::pi * spacing * spacing);
  EXPECT_NEAR(*measure(strands).root_density, expected, 1e-6 * expected);
}

TEST(GroomMeasure, RootDensityOfRandomRootsOnASphereIsTheirNumberOverItsArea) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  Strands strands;
  for (int i = 0; i < 20000; ++i)
    add(strands, {0.1 * Vec3(normal(random), normal(random), normal(random)).normalized()});
  const double expected = 20000 / (4 * std::numbers::pi * 0.01);
  EXPECT_NEAR(*measure(strands).root_density, expected, 0.02 * expected);
}

}  // namespace
}  // namespace ringlet::groom
