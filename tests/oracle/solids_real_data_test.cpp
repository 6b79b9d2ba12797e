// The real assets, where they are at hand.
#include <map>
#include <random>

#include "core/timer.h"
#include "solids/level_set.h"
#include "solids/mesh.h"
#include "solids/solid.h"
#include "unit/solids_fixtures.h"

namespace ringlet::solids {
namespace {

using Motion = AnimatedMesh::Motion;
const scene::Units kCentimetres{0.01, scene::Axis::kY};

struct Asset {
  const char* file;
  const char* clip;
  double metres_per_unit;
  std::size_t vertices, triangles, boundary_edges;
  Motion motion;
  double longest;  // [m] of the rest pose's bounds, to 10 %
};

class RealData : public testing::TestWithParam<Asset> {};

std::size_t boundary_edges(const std::vector<Triangle>& triangles) {
  std::map<std::pair<int, int>, int> uses;
  for (const Triangle& t : triangles)
    for (std::size_t c = 0; c < 3; ++c)
      ++uses[{std::min(t[c], t[(c + 1) % 3]), std::max(t[c], t[(c + 1) % 3])}];
  return static_cast<std::size_t>(
      std::count_if(uses.begin(), uses.end(), [](const auto& edge) { return edge.second == 1; }));
}

// How often the surface surrounds a point, by solid angles.
double winding_number(const ClosedSurface& surface, const std::vector<Vec3>& vertices, const Vec3& p) {
  double angle = 0;
  for (const Triangle& t : surface.triangles) {
    const Vec3 a = vertices[t[0]] - p, b = vertices[t[1]] - p, c = vertices[t[2]] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * std::numbers::pi);
}

TEST_P(RealData, IsReadAndSampled) {
  const Asset& asset = GetParam();
  const std::filesystem::path file = data_file(asset.file);
  if (file.empty()) GTEST_SKIP() << "no RINGLET_DATA";
  scene::MeshDesc desc = mesh_desc(file);
  if (*asset.clip != '\0') desc.animation.clip = asset.clip;
  desc.units.metres_per_unit = asset.metres_per_unit;
  const Timer loading;
  const AnimatedMesh mesh(desc, kCentimetres, {1, 49, 24, 8});
  const double loaded = loading.seconds();
  EXPECT_LE(mesh.vertex_count(), asset.vertices);  // seams are welded
  EXPECT_EQ(mesh.triangles().size(), asset.triangles);
  EXPECT_EQ(mesh.motion(), asset.motion);
  EXPECT_EQ(boundary_edges(mesh.triangles()), asset.boundary_edges);

  std::vector<Vec3> out(mesh.vertex_count());
  const Timer sampling;
  constexpr int kSamples = 60;
  Eigen::AlignedBox3d rest, moving;
  for (const Vec3& v : mesh.rest_vertices()) rest.extend(v);
  for (int i = 0; i < kSamples; ++i) {
    mesh.sample(-0.3 + 0.05 * i, out);
    for (const Vec3& v : out) moving.extend(v);
  }
  std::printf("%s: loaded in %.0f ms, a sample takes %.2f ms\n", asset.file, 1e3 * loaded,
              1e3 * sampling.seconds() / kSamples);
  EXPECT_NEAR(rest.sizes().maxCoeff(), asset.longest, 0.1 * asset.longest);
  EXPECT_TRUE(moving.sizes().norm() <= 2 * rest.sizes().norm());  // a wrong joint flings vertices far off
}

TEST_P(RealData, LevelSetKnowsInsideFromOutside) {
  const Asset& asset = GetParam();
  const std::filesystem::path file = data_file(asset.file);
  if (file.empty()) GTEST_SKIP() << "no RINGLET_DATA";
  scene::MeshDesc desc = mesh_desc(file);
  desc.units.metres_per_unit = asset.metres_per_unit;
  const AnimatedMesh mesh(desc, kCentimetres, {1, 49, 24, 0});
  const ClosedSurface surface = close_surface(asset.file, mesh.rest_vertices(), mesh.triangles());
  std::vector<Vec3> vertices = mesh.rest_vertices();
  vertices.resize(surface.vertex_count());
  surface.follow(vertices);
  std::vector<Eigen::Vector3f> local;
  for (const Vec3& v : vertices) local.push_back(v.cast<float>());
  const Timer timer;
  const LevelSet level_set = build_level_set(surface, local, static_cast<float>(asset.longest / 128), 3);
  std::printf("%s: a level set takes %.2f s, %.1f MB\n", asset.file, timer.seconds(),
              1e-6 * level_set.bytes());
  EXPECT_TRUE(level_set.encloses_volume());

  // The side of random voxels at the surface against the winding number. They differ where parts intersect
  // and where a slit narrower than a voxel leads to a hollow.
  std::mt19937 random(1);
  std::size_t asked = 0, wrong = 0;
  const kernels::LevelSetView view = level_set.view();
  for (int x = 0; x < view.tile_count[0]; ++x)
    for (int y = 0; y < view.tile_count[1]; ++y)
      for (int z = 0; z < view.tile_count[2]; ++z) {
        const std::int32_t number = view.tile[(x * view.tile_count[1] + y) * view.tile_count[2] + z];
        if (number < 0) continue;
        const int voxel = static_cast<int>(random() % 512);
        const float d = view.distance[number * 512 + voxel];
        if (std::abs(d) > view.voxel_size) continue;
        const Vec3 p = view.voxel_size * Vec3(8 * (x + view.tile_min[0]) + (voxel >> 6),
                                              8 * (y + view.tile_min[1]) + (voxel >> 3 & 7),
                                              8 * (z + view.tile_min[2]) + (voxel & 7));
        ++asked;
        wrong += (winding_number(surface, vertices, p) > 0.5) != (d < 0);
      }
  std::printf("%s: the side of %zu voxels of %zu differs from the winding number's\n", asset.file, wrong,
              asked);
  EXPECT_LE(wrong, 1 + asked / 50);
}

INSTANTIATE_TEST_SUITE_P(
    Assets, RealData,
    testing::Values(Asset{"curly/head_shake.glb", "shake", 0.01, 12466, 24820, 110, Motion::kDeforming,
                          0.323},
                    Asset{"curly/head_full.dae", "", 0.08, 12466, 24820, 110, Motion::kStill, 0.331},
                    Asset{"bear/bear_walk.glb", "walk", 0.01, 21481, 40060, 54, Motion::kDeforming, 2.17},
                    Asset{"face/head_morph.glb", "talk", 0.01, 11248, 22288, 212, Motion::kDeforming, 0.338},
                    Asset{"ponytail/head.obj", "", 0.0027, 55000, 17894, 438, Motion::kStill, 0.46}),
    [](const auto& info) {
      std::string name = std::filesystem::path(info.param.file).stem().string();
      return name;
    });

}  // namespace
}  // namespace ringlet::solids
