// Level sets against closed forms and against measuring every triangle.
#include "solids/level_set.h"

#include <tbb/global_control.h>

#include <random>

#include "unit/solids_fixtures.h"

namespace ringlet::solids {
namespace {

std::vector<Eigen::Vector3f> floats(const ClosedSurface& surface, std::vector<Vec3> vertices) {
  vertices.resize(surface.vertex_count());
  surface.follow(vertices);
  std::vector<Eigen::Vector3f> result;
  for (const Vec3& v : vertices) result.push_back(v.cast<float>());
  return result;
}

struct Built {
  explicit Built(const Shape& shape, float voxel, int half_width)
      : surface(close_surface("shape", shape.vertices, shape.triangles)),
        vertices(floats(surface, shape.vertices)),
        level_set(build_level_set(surface, vertices, voxel, half_width)) {}

  ClosedSurface surface;
  std::vector<Eigen::Vector3f> vertices;
  LevelSet level_set;
};

// Calls visit(position, distance, triangle) for each voxel of the band, by the rules of
// kernels::LevelSetView.
template <class Visit>
void for_each_band_voxel(const kernels::LevelSetView& view, Visit visit) {
  const auto& n = view.tile_count;
  for (int x = 0; x < 8 * n[0]; ++x)
    for (int y = 0; y < 8 * n[1]; ++y)
      for (int z = 0; z < 8 * n[2]; ++z) {
        const std::int32_t tile = view.tile[(x / 8 * n[1] + y / 8) * n[2] + z / 8];
        if (tile < 0) continue;
        const int voxel = tile * 512 + ((x & 7) << 6 | (y & 7) << 3 | (z & 7));
        if (std::abs(view.distance[voxel]) >= view.background) continue;
        visit(view.voxel_size *
                  Vec3(x + 8 * view.tile_min[0], y + 8 * view.tile_min[1], z + 8 * view.tile_min[2]),
              view.distance[voxel], view.triangle[voxel]);
      }
}

// The value at any voxel.
float value_at(const kernels::LevelSetView& view, const Vec3& position) {
  int v[3];
  for (int axis = 0; axis < 3; ++axis) {
    v[axis] = static_cast<int>(std::lround(position[axis] / view.voxel_size)) - 8 * view.tile_min[axis];
    if (v[axis] < 0 || v[axis] >= 8 * view.tile_count[axis]) return view.background;
  }
  const std::int32_t tile =
      view.tile[(v[0] / 8 * view.tile_count[1] + v[1] / 8) * view.tile_count[2] + v[2] / 8];
  if (tile == kernels::kTileOutside) return view.background;
  if (tile < 0) return -view.background;
  return view.distance[tile * 512 + ((v[0] & 7) << 6 | (v[1] & 7) << 3 | (v[2] & 7))];
}

// The distance to a triangle by the plane and the three sides, in double and on its own terms.
double distance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a).normalized();
  const auto side = [&](const Vec3& from, const Vec3& to) { return n.dot((to - from).cross(p - from)); };
  if (side(a, b) >= 0 && side(b, c) >= 0 && side(c, a) >= 0) return std::abs(n.dot(p - a));
  const auto to_segment = [&](const Vec3& from, const Vec3& to) {
    const Vec3 along = to - from;
    const double t = std::min(1.0, std::max(0.0, along.dot(p - from) / along.dot(along)));
    return (p - (from + t * along)).norm();
  };
  return std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

double distance(const Vec3& p, const Built& built, std::size_t triangle) {
  const Triangle& t = built.surface.triangles[triangle];
  const auto at = [&](std::size_t c) {
    return built.vertices[static_cast<std::size_t>(t[c])].cast<double>().eval();
  };
  return distance(p, at(0), at(1), at(2));
}

double closest(const Vec3& p, const Built& built) {
  double least = 1e300;
  for (std::size_t t = 0; t < built.surface.triangles.size(); ++t)
    least = std::min(least, distance(p, built, t));
  return least;
}

TEST(LevelSet, SphereIsItsClosedForm) {
  const double radius = 0.1;
  const Vec3 centre(0.013, -0.02, 0.007);
  const float voxel = 0.004f;
  const Built built(sphere(radius, centre, 128, 256), voxel, 4);
  const double half_edge = radius * std::numbers::pi / 256;
  const double sagitta = half_edge * half_edge / radius;  // how far a facet's middle lies under the sphere
  std::size_t voxels = 0;
  for_each_band_voxel(built.level_set.view(), [&](const Vec3& p, float d, std::int32_t triangle) {
    const double expected = (p - centre).norm() - radius;
    EXPECT_TRUE(std::abs(d - expected) <= 1.01 * sagitta) << p.transpose();
    // The closest triangle lies where the radius through p leaves the sphere.
    const Triangle& t = built.surface.triangles[static_cast<std::size_t>(triangle)];
    Vec3 middle = Vec3::Zero();
    for (const int v : t) middle += built.vertices[static_cast<std::size_t>(v)].cast<double>() / 3;
    const double edge = 2 * std::numbers::pi * radius / 256;
    EXPECT_TRUE((middle - centre - radius * (p - centre).normalized()).norm() <= 1.5 * edge);
    ++voxels;
  });
  // The band's volume, 4 pi r^2 times its width, in voxels.
  const double expected =
      4 * std::numbers::pi * (radius * radius + std::pow(4 * voxel, 2) / 3) * 8 / (voxel * voxel);
  EXPECT_NEAR(static_cast<double>(voxels), expected, 0.01 * expected);
  const kernels::LevelSetView view = built.level_set.view();
  EXPECT_EQ(value_at(view, centre), -view.background);
  EXPECT_EQ(value_at(view, centre + Vec3(1, 0, 0)), view.background);
  EXPECT_EQ(value_at(view, centre + Vec3(0.08, 0.08, 0.08)), view.background);  // in the table, a corner
  EXPECT_FLOAT_EQ(view.background, 4 * voxel);
}

TEST(LevelSet, DistancesAndTrianglesAreExactAtVoxels) {
  Shape bumpy = sphere(0.1, Vec3::Zero(), 24, 40);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(0.7, 1.3);
  for (Vec3& v : bumpy.vertices) v *= uniform(random);
  const Built built(bumpy, 0.005f, 5);
  std::size_t voxels = 0;
  for_each_band_voxel(built.level_set.view(), [&](const Vec3& p, float d, std::int32_t triangle) {
    if (++voxels % 101 != 0) return;
    EXPECT_TRUE(std::abs(std::abs(d) - closest(p, built)) <= 1e-7) << p.transpose();
    EXPECT_TRUE(std::abs(std::abs(d) - distance(p, built, static_cast<std::size_t>(triangle))) <= 1e-7);
  });
  EXPECT_GT(voxels, 10000u);
}

TEST(LevelSet, ACubesEdgesAndCornersAreSharp) {
  Shape cube;
  for (int i = 0; i < 8; ++i)
    cube.vertices.emplace_back(0.1 * (i & 1), 0.1 * (i >> 1 & 1), 0.1 * (i >> 2 & 1));
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const Built built(cube, 0.0033f, 3);
  for_each_band_voxel(built.level_set.view(), [&](const Vec3& p, float d, std::int32_t) {
    const Vec3 q = (p - Vec3::Constant(0.05)).cwiseAbs() - Vec3::Constant(0.05);
    const double expected = q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
    EXPECT_TRUE(std::abs(d - expected) <= 1e-7) << p.transpose();
  });
}

TEST(LevelSet, AHollowSphereStaysHollow) {
  Shape shell = sphere(0.1);
  shell.append(sphere(0.07).turned_inside_out());
  const Built built(shell, 0.004f, 3);
  const kernels::LevelSetView view = built.level_set.view();
  EXPECT_EQ(value_at(view, Vec3::Zero()), view.background);
  EXPECT_LT(value_at(view, {0.084, 0, 0}), -0.008f);
  EXPECT_GT(value_at(view, {0.06, 0, 0}), 0.005f);
  for_each_band_voxel(view, [&](const Vec3& p, float d, std::int32_t) {
    const double r = p.norm(), expected = std::max(r - 0.1, 0.07 - r);
    EXPECT_TRUE(std::abs(d - expected) <= 3e-4) << p.transpose();  // the spheres are polyhedra
  });
}

TEST(LevelSet, AThickBowlStaysOpen) {
  // Two hemispheres joined at the rim: one part, and its hollow is reached from without.
  const auto half = [](double radius) {
    Shape s = sphere(radius, Vec3::Zero(), 48, 96);
    std::erase_if(s.triangles, [&](const Triangle& t) {
      return (s.vertices[t[0]] + s.vertices[t[1]] + s.vertices[t[2]]).y() > 1e-9;
    });
    return s;
  };
  Shape bowl = half(0.1);
  const auto outer_count = static_cast<int>(bowl.vertices.size());
  bowl.append(half(0.08).turned_inside_out());
  for (int j = 0; j < 96; ++j) {
    const int rim = 1 + 23 * 96, a = rim + j, b = rim + (j + 1) % 96;
    bowl.triangles.push_back({a, b, a + outer_count});
    bowl.triangles.push_back({b, b + outer_count, a + outer_count});
  }
  const Built built(bowl, 0.004f, 3);
  ASSERT_TRUE(built.surface.loops.empty());
  const kernels::LevelSetView view = built.level_set.view();
  EXPECT_GT(value_at(view, {0, -0.06, 0}), 0);
  EXPECT_LT(value_at(view, {0, -0.09, 0}), 0);
  EXPECT_GT(value_at(view, {0, -0.11, 0}), 0);
}

TEST(LevelSet, WhatLiesHiddenInsideDoesNotCount) {
  Shape ball = sphere(0.1);
  ball.append(sphere(0.02, {0.03, 0, 0}));
  const Built built(ball, 0.004f, 3);
  const kernels::LevelSetView view = built.level_set.view();
  EXPECT_EQ(value_at(view, {0.03, 0, 0}), -view.background);
  for_each_band_voxel(view, [&](const Vec3& p, float d, std::int32_t) {
    EXPECT_TRUE(std::abs(d - (p.norm() - 0.1)) <= 3e-4) << p.transpose();
  });
}

TEST(LevelSet, SameForAnyNumberOfThreads) {
  Shape bumpy = sphere(0.1, {0.3, 0, 0}, 40, 60);
  for (std::size_t v = 0; v < bumpy.vertices.size(); ++v)
    bumpy.vertices[v].y() *= 1 + 0.2 * std::sin(0.7 * v);
  const Built several(bumpy, 0.003f, 4);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_TRUE(Built(bumpy, 0.003f, 4).level_set == several.level_set);
}

TEST(LevelSet, SurfaceWithoutAreaIsEmpty) {
  Shape flat;
  flat.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  flat.triangles = {{0, 1, 2}};
  const Built built(flat, 0.1f, 3);
  EXPECT_TRUE(built.level_set.tile.empty());
  EXPECT_FALSE(built.level_set.encloses_volume());
}

class LevelSetFile : public InDirectory {};

TEST_F(LevelSetFile, ReadsBackBitForBit) {
  Shape shell = sphere(0.1);
  shell.append(sphere(0.07).turned_inside_out());
  const Built built(shell, 0.003f, 3);
  const std::filesystem::path file = directory / "set.vdb";
  write_level_set(file, built.level_set);
  EXPECT_TRUE(read_level_set(file, built.surface.triangles.size()) == built.level_set);
}

}  // namespace
}  // namespace ringlet::solids
