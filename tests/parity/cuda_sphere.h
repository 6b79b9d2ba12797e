// A sphere as the kernels see a solid, its level set by brute force: for tests that need no OpenVDB.
#pragma once
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "core/geometry.h"
#include "kernels/solid/closest_point.h"
#include "kernels/solid/solid_view.h"

namespace ringlet::cuda_testing {

// Rings and segments around z; `radius` [m], voxels of `voxel` [m], a band of 3 voxels. `stretch` makes it an
// ellipsoid along x of the same triangles.
class Sphere {
 public:
  Sphere(double radius, double stretch, float voxel) : voxel_(voxel) {
    make_mesh(radius, stretch);
    make_level_set();
  }

  kernels::SolidView view() const {
    const kernels::LevelSetView set = {voxel_,
                                       3 * voxel_,
                                       {-tiles_, -tiles_, -tiles_},
                                       {2 * tiles_, 2 * tiles_, 2 * tiles_},
                                       tile_.data(),
                                       distance_.data(),
                                       triangle_.data()};
    kernels::SolidView solid{};
    solid.level_set[0] = solid.level_set[1] = set;
    solid.friction = 0.3f;
    for (int k = 0; k < 9; k += 4) solid.rotation_before[k] = solid.rotation[k] = 1;
    solid.triangles = triangles.data(), solid.neighbours = neighbours_.data();
    solid.vertices = solid.vertices_before = vertices.data();
    solid.triangle_count = static_cast<std::int32_t>(triangles.size() / 3);
    return solid;
  }

  std::vector<std::int32_t> triangles;
  std::vector<float> vertices;

 private:
  void make_mesh(double radius, double stretch) {
    constexpr int kRings = 8, kSegments = 12;
    const auto add = [&](double polar, double azimuth) {
      for (const double c : {stretch * radius * std::sin(polar) * std::cos(azimuth),
                             radius * std::sin(polar) * std::sin(azimuth), radius * std::cos(polar)})
        vertices.push_back(static_cast<float>(c));
    };
    add(0, 0);
    for (int r = 1; r < kRings; ++r)
      for (int s = 0; s < kSegments; ++s)
        add(std::numbers::pi * r / kRings, 2 * std::numbers::pi * s / kSegments);
    add(std::numbers::pi, 0);
    const int south = 1 + (kRings - 1) * kSegments;
    const auto at = [](int r, int s) { return 1 + (r - 1) * kSegments + s % kSegments; };
    for (int s = 0; s < kSegments; ++s) {
      triangles.insert(triangles.end(), {0, at(1, s), at(1, s + 1)});
      for (int r = 1; r + 1 < kRings; ++r)
        triangles.insert(triangles.end(), {at(r, s), at(r + 1, s), at(r + 1, s + 1), at(r, s),
                                           at(r + 1, s + 1), at(r, s + 1)});
      triangles.insert(triangles.end(), {at(kRings - 1, s), south, at(kRings - 1, s + 1)});
    }
    std::map<std::pair<int, int>, int> across;  // directed edge to its triangle
    for (std::size_t k = 0; k < triangles.size(); ++k)
      across[{triangles[k], triangles[k / 3 * 3 + (k + 1) % 3]}] = static_cast<int>(k / 3);
    for (std::size_t k = 0; k < triangles.size(); ++k)
      neighbours_.push_back(across.at({triangles[k / 3 * 3 + (k + 1) % 3], triangles[k]}));
  }

  // Signed distance to the mesh by asking every triangle, and the closest one; the mesh is convex.
  std::pair<double, int> closest(const Vec3& p) const {
    using V = kernels::Vector3<double>;
    const auto corner = [&](int k) {
      const float* v = &vertices[3 * static_cast<std::size_t>(triangles[k])];
      return V{v[0], v[1], v[2]};
    };
    const V at = {p.x(), p.y(), p.z()};
    double nearest = 1e30, outside = -1e30;
    int which = -1;
    for (int k = 0; k < static_cast<int>(triangles.size()); k += 3) {
      const V a = corner(k), b = corner(k + 1), c = corner(k + 2);
      const V w = kernels::closest_barycentrics(at, a, b, c);
      const double away = length(at - (w.x * a + w.y * b + w.z * c));
      if (away < nearest) nearest = away, which = k / 3;
      const V normal = cross(b - a, c - a);
      outside = std::max(outside, dot(at - a, normal) / length(normal));
    }
    return {outside < 0 ? -nearest : nearest, which};
  }

  void make_level_set() {
    float reach = 0;
    for (const float c : vertices) reach = std::max(reach, std::abs(c));
    tiles_ = static_cast<int>((reach + 4 * voxel_) / (8 * voxel_)) + 1;
    const float band = 3 * voxel_;
    for (int tile = 0; tile < 8 * tiles_ * tiles_ * tiles_; ++tile) {
      const int n = 2 * tiles_;
      const Vec3 corner = 8 * Vec3(tile / (n * n) - tiles_, tile / n % n - tiles_, tile % n - tiles_);
      std::vector<float> distance;
      std::vector<std::int32_t> triangle;
      bool in_band = false;
      for (int voxel = 0; voxel < 512; ++voxel) {
        const auto [d, nearest] = closest(voxel_ * (corner + Vec3(voxel >> 6, voxel >> 3 & 7, voxel & 7)));
        in_band = in_band || std::abs(d) < band;
        distance.push_back(std::clamp(static_cast<float>(d), -band, band));
        triangle.push_back(std::abs(d) < band ? nearest : -1);
      }
      if (!in_band) {
        tile_.push_back(distance[0] < 0 ? kernels::kTileInside : kernels::kTileOutside);
        continue;
      }
      tile_.push_back(static_cast<int>(distance_.size() / 512));
      distance_.insert(distance_.end(), distance.begin(), distance.end());
      triangle_.insert(triangle_.end(), triangle.begin(), triangle.end());
    }
  }

  float voxel_;
  int tiles_ = 0;  // on either side of the origin
  std::vector<std::int32_t> neighbours_, tile_, triangle_;
  std::vector<float> distance_;
};

}  // namespace ringlet::cuda_testing
