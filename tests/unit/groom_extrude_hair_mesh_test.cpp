// Hair meshes extruded from heads: valid, of the paper's sizes, outside the head, shaped as their numbers
// say.
#include "groom/extrude_hair_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/error.h"
#include "unit/hair_mesh_support.h"

namespace ringlet::groom::test {
namespace {
using testing::HasSubstr;

constexpr double kRadius = 0.09;

double outside_sphere(const Vec3& point) { return point.norm() - kRadius; }

ScalpRegion cap(double angle) {
  ScalpRegion region{};
  region.selection.max_angle = M_PI;
  region.centre = Vec3::Zero();
  region.pole = Vec3(0, 1, -0.5);
  region.angle = angle;
  return region;
}

// A sphere for a head, fine enough that a chord of it lies within 0.1 mm.
ScalpPatch patch_of(int vertices, double angle = 1.6) {
  static const Head head = sphere(96, 192, kRadius);
  return lay_scalp_patch(cap(angle), vertices, head.scalp(), scene::Axis::kY);
}

HairExtrusion straight(int layers, double length) {
  HairExtrusion extrusion;
  extrusion.layers = layers;
  extrusion.length = length;
  extrusion.gravity = 0;
  return extrusion;
}

// ---- Patches --------------------------------------------------------------------------------------------

TEST(ScalpPatch, HasTheVerticesAskedForOnTheHead) {
  for (const int vertices : {7, 19, 43, 50, 91, 461}) {
    const ScalpPatch patch = patch_of(vertices);
    ASSERT_EQ(patch.points.size(), static_cast<std::size_t>(vertices));
    for (const Vec3& point : patch.points) EXPECT_NEAR(point.norm(), kRadius, 1e-4);
    // A disc of F faces, E edges: V - E + F = 1.
    std::set<std::array<std::int32_t, 2>> edges;
    int quads = 0;
    for (const HairMesh::Face& face : patch.faces) {
      const int n = HairMesh::corners(face);
      quads += n == 4;
      for (int c = 0; c < n; ++c)
        edges.insert({std::min(face[c], face[(c + 1) % n]), std::max(face[c], face[(c + 1) % n])});
    }
    EXPECT_EQ(vertices - static_cast<int>(edges.size()) + static_cast<int>(patch.faces.size()), 1);
    EXPECT_TRUE(vertices < 91 || 2 * quads > static_cast<int>(patch.faces.size()));
    EXPECT_NEAR(patch.radius(), kRadius, 1e-4);
  }
}

TEST(ScalpPatch, CoversTheCap) {
  const double angle = 1.3;
  const ScalpPatch patch = patch_of(461, angle);
  double area = 0, least = 1;
  for (const HairMesh::Face& f : patch.faces) {
    Vec3 sum = Vec3::Zero();
    for (int c = 2; c < HairMesh::corners(f); ++c)
      sum += (patch.points[f[c - 1]] - patch.points[f[0]]).cross(patch.points[f[c]] - patch.points[f[0]]) / 2;
    area += sum.norm();
  }
  for (const Vec3& point : patch.points)
    least = std::min(least, point.normalized().dot(Vec3(0, 1, -0.5).normalized()));
  EXPECT_NEAR(std::acos(least), angle, 0.03 * angle);
  const double rim = std::acos(least);
  EXPECT_NEAR(area, 2 * M_PI * kRadius * kRadius * (1 - std::cos(rim)), 0.02 * area);
}

// Without a centre and a pole they follow from the region: that of the sphere and the selected side's middle.
TEST(ScalpPatch, FindsCentreAndPole) {
  Head head = sphere(48, 96, kRadius);
  for (Vec3& x : head.vertices) x += Vec3(0.3, 1.2, -0.4);
  ScalpRegion region{};
  region.selection.direction = Vec3(0, 1, 0);
  region.selection.max_angle = 1.2;
  const ScalpPatch patch = lay_scalp_patch(region, 61, head.scalp(), scene::Axis::kY);
  EXPECT_LE((patch.centre - Vec3(0.3, 1.2, -0.4)).norm(), 1e-9);
  EXPECT_LE((patch.points[0] - Vec3(0.3, 1.2 + kRadius, -0.4)).norm(), 1e-3);
  double lowest = 2;
  for (const Vec3& point : patch.points) lowest = std::min(lowest, point.y());
  EXPECT_NEAR(std::acos((lowest - 1.2) / kRadius), 1.2, 0.08);
}

TEST(ScalpPatch, AxesFollowUpAndForward) {
  const Head head = sphere(24, 48, kRadius);
  ScalpRegion region = cap(1.2);
  region.pole = Vec3(0, 0, 1);
  EXPECT_EQ(lay_scalp_patch(region, 19, head.scalp(), scene::Axis::kZ).axes.col(1), Vec3(0, 0, 1));
  region.forward = Vec3(1, 0, 5);
  const Mat3 axes = lay_scalp_patch(region, 19, head.scalp(), scene::Axis::kZ).axes;
  EXPECT_EQ(axes.col(2), Vec3(1, 0, 0));
  EXPECT_NEAR(axes.determinant(), 1, 1e-15);
}

TEST(ScalpPatch, RegionsThatDoNotFit) {
  const Head head = sphere(24, 48, kRadius);
  const auto refusal = [&](ScalpRegion region, int vertices) {
    try {
      lay_scalp_patch(region, vertices, head.scalp(), scene::Axis::kY);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(refusal(cap(1), 6), HasSubstr("found 6 vertices, expected 7 to 100000"));
  ScalpRegion region = cap(1);
  region.centre = Vec3(0, 5, 0);
  EXPECT_THAT(refusal(region, 19), HasSubstr("meets none of the region's triangles"));
  region = cap(1);
  region.forward = Vec3(0, 2, 0);
  EXPECT_THAT(refusal(region, 19), HasSubstr("the forward direction is that of the up axis"));
  region = cap(1);
  region.selection.mesh = "wig";
  EXPECT_THAT(refusal(region, 19), HasSubstr("no mesh \"wig\""));
}

// ---- Extrusion ------------------------------------------------------------------------------------------

// Without gravity streamlines are radii: layer k lies on the sphere about the head of k / n of the length
// more.
TEST(ExtrudeHairMesh, StraightOutWithoutGravity) {
  const HairMesh mesh = extrude_hair_mesh(straight(5, 0.08), patch_of(43), outside_sphere);
  ASSERT_EQ(mesh.positions.size(), 215u);
  for (int k = 0; k < 5; ++k)
    for (std::size_t v = 0; v < 43; ++v) {
      const Vec3& root = mesh.layer(0)[v];
      EXPECT_LE((mesh.layer(k)[v] - root * (1 + 0.02 * k / root.norm())).norm(), 1e-9);
    }
}

TEST(ExtrudeHairMesh, GravityBendsDownAndLiftHoldsUp) {
  const auto mean_height = [](double gravity, double lift) {
    HairExtrusion extrusion = straight(8, 0.1);
    extrusion.gravity = gravity;
    extrusion.lift = lift;
    const HairMesh mesh = extrude_hair_mesh(extrusion, patch_of(91, 1.2), outside_sphere);
    double sum = 0;
    for (const Vec3& tip : mesh.layer(7)) sum += tip.y() / static_cast<double>(mesh.vertices());
    return sum;
  };
  const double none = mean_height(0, 0.03), some = mean_height(0.3, 0.03), more = mean_height(1, 0.03);
  EXPECT_GT(none, some + 0.01);
  EXPECT_GT(some, more + 0.01);
  EXPECT_GT(mean_height(1, 0.06), more + 0.003);
}

TEST(ExtrudeHairMesh, CutsAtALevel) {
  HairExtrusion extrusion = straight(12, 1);
  extrusion.gravity = 1;
  extrusion.lift = 0.03;
  extrusion.level = -0.2;
  const HairMesh mesh = extrude_hair_mesh(extrusion, patch_of(91), outside_sphere);
  int at_level = 0;
  for (const Vec3& tip : mesh.layer(11)) at_level += std::abs(tip.y() + 0.2) < 1e-3;
  EXPECT_GE(at_level, 80);  // the others were moved to open prisms
}

// A helix of the given radius and turns about the streamlines: with the streamlines known, radii, about them.
TEST(ExtrudeHairMesh, CurlGoesRoundTheStreamlines) {
  HairExtrusion extrusion = straight(25, 0.12);
  extrusion.curl_radius = 0.006;
  extrusion.curl_turns = 2;
  const ScalpPatch patch = patch_of(91, 1.0);
  const HairMesh plain = extrude_hair_mesh(straight(25, 0.12), patch, outside_sphere),
                 curled = extrude_hair_mesh(extrusion, patch, outside_sphere);
  const std::size_t pole = 0;
  double turned = 0;
  for (int k = 1; k < 25; ++k) {
    const Vec3 offset = curled.layer(k)[pole] - plain.layer(k)[pole];
    EXPECT_NEAR(offset.norm(), 0.006 * k / 24, 1e-4);
    if (k < 2) continue;
    const Vec3 before = curled.layer(k - 1)[pole] - plain.layer(k - 1)[pole];
    turned += std::acos(std::clamp(before.normalized().dot(offset.normalized()), -1.0, 1.0));
  }
  EXPECT_NEAR(turned / (2 * M_PI), 2 * 23 / 24.0, 0.01);
}

TEST(ExtrudeHairMesh, NumbersOutOfRange) {
  const auto refusal = [](auto change) {
    HairExtrusion extrusion = straight(5, 0.1);
    change(extrusion);
    const auto problem = out_of_range(extrusion);
    EXPECT_THROW(extrude_hair_mesh(extrusion, ScalpPatch(), outside_sphere), Error);
    return problem ? to_string(*problem) : std::string("none");
  };
  EXPECT_THAT(refusal([](auto& e) { e.layers = 1; }), HasSubstr("layers: found 1, expected 2 to 1000"));
  EXPECT_THAT(refusal([](auto& e) { e.length = 0; }),
              HasSubstr("length: found 0, expected a number above 0"));
  EXPECT_THAT(refusal([](auto& e) { e.length = NAN; }), HasSubstr("length: found nan"));
  EXPECT_THAT(refusal([](auto& e) { e.gravity = -1; }), HasSubstr("gravity: found -1, expected 0 to 100"));
  EXPECT_THAT(refusal([](auto& e) { e.level = NAN; }), HasSubstr("level: found nan"));
  EXPECT_THAT(refusal([](auto& e) { e.curl_turns = 2; }),
              HasSubstr("curl turns: found 2, expected at most 1.33"));
}

// ---- Styles ---------------------------------------------------------------------------------------------

TEST(HairStyles, HaveThePapersSizes) {
  const auto vertices = [](HairStyle style, HairResolution resolution) {
    const HairMeshSize size = size_of(style, resolution);
    return size.scalp_vertices * size.layers;
  };
  EXPECT_EQ(vertices(HairStyle::kShort, HairResolution::kLow), 215);
  EXPECT_EQ(vertices(HairStyle::kShoulder, HairResolution::kLow), 361);
  EXPECT_EQ(vertices(HairStyle::kLong, HairResolution::kLow), 361);
  EXPECT_EQ(vertices(HairStyle::kLong, HairResolution::kHigh), 2305);
  for (const HairStyle style : {HairStyle::kShort, HairStyle::kShoulder, HairStyle::kLong}) {
    EXPECT_LT(vertices(style, HairResolution::kLow), vertices(style, HairResolution::kMedium));
    EXPECT_LT(vertices(style, HairResolution::kMedium), vertices(style, HairResolution::kHigh));
  }
}

class Styles : public testing::TestWithParam<std::tuple<HairStyle, HairResolution>> {};

// extrude_hair_mesh() checks what it returns; here: outside the head, as low as the style says, and symmetric
// in shape.
TEST_P(Styles, ExtrudeFromASphere) {
  const auto [style, resolution] = GetParam();
  const HairMeshSize size = size_of(style, resolution);
  const ScalpPatch patch = patch_of(size.scalp_vertices, 1.75);
  const HairMesh mesh = extrude_hair_mesh(extrusion_of(style, resolution, patch), patch, outside_sphere);
  EXPECT_NO_THROW(check(mesh, ""));
  EXPECT_EQ(mesh.positions.size(), static_cast<std::size_t>(size.scalp_vertices * size.layers));
  double lowest = 1;
  for (std::size_t i = mesh.vertices(); i < mesh.positions.size(); ++i) {
    EXPECT_GT(outside_sphere(mesh.positions[i]), 0);
    lowest = std::min(lowest, mesh.positions[i].y());
  }
  switch (style) {
    case HairStyle::kShort:
      EXPECT_GT(lowest, -1.8 * kRadius);
      break;
    case HairStyle::kShoulder:
      EXPECT_NEAR(lowest, -2.6 * kRadius, 0.8 * kRadius);
      break;
    case HairStyle::kLong:
      EXPECT_NEAR(lowest, -5 * kRadius, kRadius);
      break;
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Styles,
    testing::Combine(testing::Values(HairStyle::kShort, HairStyle::kShoulder, HairStyle::kLong),
                     testing::Values(HairResolution::kLow, HairResolution::kMedium, HairResolution::kHigh)));

}  // namespace
}  // namespace ringlet::groom::test
