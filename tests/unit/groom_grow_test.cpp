// Growth against an independent transcription of physics.md section 9, and the statistics of its roots.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "unit/groom_support.h"

namespace ringlet::groom::test {
namespace {

scene::Grow curly() {
  scene::Grow p{};
  p.scalp.max_angle = std::numbers::pi;
  p.strands_per_triangle = 1;
  p.seed = 7;
  p.particles = 24;
  p.step = 0.01;
  p.gravity_influence = 0.02;
  p.max_deviation = 0.2;
  p.helix_radius = 8;
  p.helix_frequency = 1;
  p.helix_impact = 0.017;
  p.width = 8e-5;
  return p;
}

// One flat triangle with normal (0, 0, 1), y up.
Head flat() {
  Head head;
  head.vertices = {Vec3(0, 0, 0), Vec3(0.3, 0, 0), Vec3(0, 0.3, 0)};
  head.triangles = {{0, 1, 2}};
  head.mesh_of_triangle = {0};
  return head;
}

// Section 9 by plain arrays, without noise, from the root and first direction on.
std::vector<Vec3> transcription(const scene::Grow& p, const Vec3& root, const Vec3& normal) {
  std::vector<Vec3> points = {root};
  double d[3] = {normal.x(), normal.y(), normal.z()}, x[3] = {root.x(), root.y(), root.z()};
  double p_grav = 0;  // y of p_grav^{i-1}
  for (int i = 1; i < p.particles; ++i) {
    const double factor = std::max(p.max_deviation, 1 - std::fabs(d[1]));
    const double bent[3] = {d[0], d[1] + p_grav * factor, d[2]};
    const double h[3] = {p.helix_radius * std::cos(i * p.helix_frequency), 1,
                         p.helix_radius * std::sin(i * p.helix_frequency)};
    double norm = 0;
    for (int k = 0; k < 3; ++k) {
      d[k] = bent[k] + p.helix_impact * (bent[k] - h[k]);
      norm += d[k] * d[k];
    }
    for (int k = 0; k < 3; ++k) d[k] /= std::sqrt(norm);
    for (int k = 0; k < 3; ++k) x[k] += p.step * d[k];
    p_grav = -i * p.gravity_influence;
    points.emplace_back(x[0], x[1], x[2]);
  }
  return points;
}

void expect_near(std::span<const Vec3> points, const std::vector<Vec3>& expected) {
  ASSERT_EQ(points.size(), expected.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double error = (points[i] - expected[i]).norm();
    EXPECT_TRUE(error <= 1e-14) << "particle " << i << ": " << error;
  }
}

TEST(GroomGrow, OneStrandIsTheFormulas) {
  for (const double helix : {0.0, 1.0, 8.0}) {
    scene::Grow p = curly();
    p.helix_radius = helix;
    const Head head = flat();
    const Strands strands = grow(p, head.scalp(), scene::Axis::kY);
    expect_near(strands.points, transcription(p, strands.points[0], Vec3(0, 0, 1)));
  }
}

TEST(GroomGrow, UpAxisTurnsTheWholeStrand) {
  const Head head = flat();
  const Strands y_up = grow(curly(), head.scalp(), scene::Axis::kY);
  Head turned = flat();  // y up to z up: (x, y, z) -> (x, -z, y)
  for (Vec3& v : turned.vertices) v = Vec3(v.x(), -v.z(), v.y());
  const Strands z_up = grow(curly(), turned.scalp(), scene::Axis::kZ);
  std::vector<Vec3> expected;
  for (const Vec3& v : y_up.points) expected.emplace_back(v.x(), -v.z(), v.y());
  expect_near(z_up.points, expected);
}

TEST(GroomGrow, EverySegmentHasTheStepLengthWithinItsVariation) {
  scene::Grow p = curly();
  p.direction_noise = 0.5;
  p.length_variation = 0.3;
  const Head head = sphere(12, 24, 0.1);
  const Strands strands = grow(p, head.scalp(), scene::Axis::kY);
  double shortest = 1, longest = 0;
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const std::int64_t first = strands.offsets[s];
    const double step = (strands.points[first + 1] - strands.points[first]).norm();
    for (int i = 2; i < p.particles; ++i) {
      const double other = (strands.points[first + i] - strands.points[first + i - 1]).norm();
      ASSERT_TRUE(std::abs(other - step) <= 1e-14);
    }
    shortest = std::min(shortest, step);
    longest = std::max(longest, step);
  }
  EXPECT_TRUE(shortest >= 0.007 && shortest <= 0.0072) << shortest;
  EXPECT_TRUE(longest <= 0.013 && longest >= 0.0128) << longest;
}

// First directions are the interpolated normals, which on a sphere are close to the roots' own directions;
// noise spreads them by about its strength.
TEST(GroomGrow, DirectionIsTheNormalPlusNoise) {
  scene::Grow p = curly();
  p.particles = 2;
  p.gravity_influence = p.helix_impact = 0;
  const Head head = sphere(24, 48, 0.1);
  const auto mean_cosine = [&](double noise) {
    p.direction_noise = noise;
    const Strands strands = grow(p, head.scalp(), scene::Axis::kY);
    double sum = 0;
    for (std::size_t s = 0; s < strands.size(); ++s) {
      sum += (strands.points[2 * s + 1] - strands.points[2 * s])
                 .normalized()
                 .dot(strands.points[2 * s].normalized());
    }
    return sum / static_cast<double>(strands.size());
  };
  EXPECT_TRUE(mean_cosine(0) >= 0.9999);
  // Noise s U per axis: two tangential axes of variance s^2 / 3, so the cosine is about 1 - s^2 / 3.
  EXPECT_NEAR(mean_cosine(0.2), 1 - 0.04 / 3, 0.002);
}

// Chi-square over the 16 similar sub-triangles of two subdivisions: 15 degrees of freedom, 99.9 %
// quantile 37.7.
double chi_square(const Strands& strands) {
  std::array<int, 16> found{};
  for (const RootSite& root : strands.roots) {
    Vec3 b = root.barycentric;
    int cell = 0;
    for (int level = 0; level < 2; ++level) {
      int corner = 3;
      for (int k = 0; k < 3; ++k) corner = b[k] >= 0.5 ? k : corner;
      cell = 4 * cell + corner;
      b = corner == 3 ? Vec3(Vec3::Ones() - 2 * b) : Vec3(2 * b - Vec3::Unit(corner));
    }
    ++found[cell];
  }
  const double expected = static_cast<double>(strands.size()) / 16;
  double sum = 0;
  for (const int count : found) sum += (count - expected) * (count - expected) / expected;
  return sum;
}

TEST(GroomGrow, RootsAreUniformOnATriangle) {
  scene::Grow p = curly();
  p.particles = 1;
  p.strands_per_triangle = 16000;
  const Head head = flat();
  for (const int seed : {1, 2, 3}) {
    p.seed = seed;
    const double chi2 = chi_square(grow(p, head.scalp(), scene::Axis::kY));
    EXPECT_TRUE(chi2 <= 37.7 && chi2 >= 3.5) << chi2;  // nor too even to be random
  }
}

TEST(GroomGrow, StrandsSpreadByAreaAndAreExactlyAsMany) {
  Head head = flat();  // a second triangle of three times the area
  head.vertices.insert(head.vertices.end(), {Vec3(1, 0, 0), Vec3(1.9, 0, 0), Vec3(1, 0.3, 0)});
  head.triangles.push_back({3, 4, 5});
  head.mesh_of_triangle.push_back(0);
  scene::Grow p = curly();
  p.particles = 2;
  p.strands_per_triangle = 0;
  p.strands = 1000;
  const Strands strands = grow(p, head.scalp(), scene::Axis::kY);
  EXPECT_EQ(strands.size(), 1000u);
  const auto on_first = std::count_if(strands.roots.begin(), strands.roots.end(),
                                      [](const RootSite& root) { return root.triangle == 0; });
  EXPECT_NEAR(static_cast<double>(on_first), 250, 1);
}

TEST(GroomGrow, RootsLieAtTheirSites) {
  scene::Grow p = curly();
  const Head head = sphere(12, 24, 0.1);
  const Strands strands = grow(p, head.scalp(), scene::Axis::kY);
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const Triangle& t = head.triangles[strands.roots[s].triangle];
    Vec3 point = Vec3::Zero();
    for (int k = 0; k < 3; ++k) point += strands.roots[s].barycentric[k] * head.vertices[t[k]];
    ASSERT_TRUE((point - strands.points[strands.offsets[s]]).norm() <= 1e-16);
  }
}

TEST(GroomGrow, SeedDecides) {
  const Head head = sphere(12, 24, 0.1);
  scene::Grow p = curly();
  const Strands a = grow(p, head.scalp(), scene::Axis::kY), b = grow(p, head.scalp(), scene::Axis::kY);
  EXPECT_EQ(a.points, b.points);
  p.seed = 8;
  EXPECT_NE(grow(p, head.scalp(), scene::Axis::kY).points, a.points);
}

// The numbers of a seed never change, on any machine: expected values from an implementation in another
// language, itself checked against SplitMix64's published output.
TEST(GroomGrow, RandomNumbersAreFixedForEver) {
  Random random(42, 0);
  const double first = random.uniform(), second = random.symmetric();
  EXPECT_EQ(first, 0x1.db4defaee6dccp-3);
  EXPECT_EQ(second, 0x1.86adc4dde4680p-1);
}

TEST(GroomGrow, PortableCosineAndSine) {
  for (int i = -20000; i <= 20000; ++i) {
    const double angle = i * 0.37;
    const auto [c, s] = cos_sin(angle);
    ASSERT_TRUE(std::abs(c - std::cos(angle)) <= 1e-15 && std::abs(s - std::sin(angle)) <= 1e-15) << angle;
  }
}

// ---- Selection
// -------------------------------------------------------------------------------------------------------

std::size_t grown_strands(const scene::ScalpSelection& selection) {
  Head head = sphere(16, 32, 0.1);
  head.mesh_names = {"scalp", "face"};
  for (std::size_t t = 0; t < head.triangles.size(); ++t)
    head.mesh_of_triangle[t] = t >= 512;  // the lower half
  scene::Grow p = curly();
  p.scalp = selection;
  return grow(p, head.scalp(), scene::Axis::kY).size();
}

TEST(GroomGrow, SelectionByMeshBoxAndDirection) {
  const double all_angles = std::numbers::pi;
  const std::size_t pole_caps = 2 * 32;  // triangles without area at the poles never carry hair
  EXPECT_EQ(grown_strands({{}, {}, {}, all_angles}), 1024 - pole_caps);
  EXPECT_EQ(grown_strands({"scalp", {}, {}, all_angles}), 512 - pole_caps / 2);
  const std::array<Vec3, 2> upper = {Vec3(-1, 0, -1), Vec3(1, 1, 1)},
                            front = {Vec3(-1, -1, 0), Vec3(1, 1, 1)};
  EXPECT_EQ(grown_strands({{}, upper, {}, all_angles}), 512 - pole_caps / 2);
  EXPECT_EQ(grown_strands({"scalp", front, {}, all_angles}), 256 - pole_caps / 4);
  EXPECT_EQ(grown_strands({{}, {}, Vec3(0, 2, 0), std::numbers::pi / 2}), 512 - pole_caps / 2);
}

std::string error_of(const scene::ScalpSelection& selection) {
  try {
    grown_strands(selection);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return "no error";
}

TEST(GroomGrow, SelectionOfNothingIsAnError) {
  EXPECT_EQ(error_of({"beard", {}, {}, 1.0}),
            "/scalp/mesh: the head has no mesh \"beard\" (it has: scalp, face)");
  EXPECT_THAT(error_of({{}, std::array<Vec3, 2>{Vec3(5, 5, 5), Vec3(6, 6, 6)}, {}, 1.0}),
              testing::HasSubstr("/scalp: selects none of the head's 1024 triangles"));
}

TEST(GroomGrow, BuildNamesGroupAndNeedsAHead) {
  scene::Groom desc{};
  desc.name = "stubble";
  desc.pointer = "/groom";
  desc.grow = curly();
  const Head head = flat();
  const Scalp scalp = head.scalp();
  EXPECT_THAT(build(desc, kMetres, &scalp).group_names, testing::ElementsAre("stubble"));
  EXPECT_THROW(build(desc, kMetres, nullptr), Error);
  desc.grow->scalp.mesh = "none";
  try {
    build(desc, kMetres, &scalp);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.problems()[0].where, "/groom/grow/scalp/mesh");
  }
}

}  // namespace
}  // namespace ringlet::groom::test
