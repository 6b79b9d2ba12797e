// Solids made by hand: closed triangle meshes, and their narrow bands from the reference's exact distances.
#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "kernels/solid/solid_view.h"
#include "oracle/mesh_distance.h"

namespace ringlet::kernels_testing {

// A closed surface, wound outwards.
struct Surface {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<std::int32_t, 3>> triangles;

  // [triangles][3] triangle across the edge from corner k to k + 1.
  std::vector<std::int32_t> neighbours() const {
    std::map<std::pair<int, int>, int> owner;
    for (int t = 0; t < static_cast<int>(triangles.size()); ++t)
      for (int k = 0; k < 3; ++k) owner[{triangles[t][k], triangles[t][(k + 1) % 3]}] = t;
    std::vector<std::int32_t> across;
    for (const auto& t : triangles)
      for (int k = 0; k < 3; ++k) {
        const auto found = owner.find({t[(k + 1) % 3], t[k]});
        across.push_back(found == owner.end() ? -1 : found->second);
      }
    return across;
  }
};

// An icosahedron divided `levels` times, its vertices on the sphere round the origin.
inline Surface icosphere(double radius, int levels) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  Surface s{{{-1, g, 0},
             {1, g, 0},
             {-1, -g, 0},
             {1, -g, 0},
             {0, -1, g},
             {0, 1, g},
             {0, -1, -g},
             {0, 1, -g},
             {g, 0, -1},
             {g, 0, 1},
             {-g, 0, -1},
             {-g, 0, 1}},
            {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
             {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
             {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle;
    const auto between = [&](int a, int b) {
      const auto [at, added] = middle.insert({std::minmax(a, b), static_cast<int>(s.vertices.size())});
      if (added) s.vertices.push_back((s.vertices[a] + s.vertices[b]) / 2);
      return at->second;
    };
    std::vector<std::array<std::int32_t, 3>> finer;
    for (const auto [a, b, c] : s.triangles) {
      const int ab = between(a, b), bc = between(b, c), ca = between(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    s.triangles = std::move(finer);
  }
  for (auto& v : s.vertices) v *= radius / v.norm();
  return s;
}

// The box between two corners, each face cut into n x n squares of two triangles.
inline Surface box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int n) {
  Surface s;
  std::map<std::array<int, 3>, int> number;
  const auto vertex = [&](std::array<int, 3> at) {
    const auto [found, added] = number.insert({at, static_cast<int>(s.vertices.size())});
    if (added) s.vertices.push_back(low + Eigen::Vector3d(at[0], at[1], at[2]).cwiseProduct(high - low) / n);
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto at = [&](int u, int v) {
            std::array<int, 3> p{};
            p[axis] = side * n, p[(axis + 1) % 3] = i + u, p[(axis + 2) % 3] = j + v;
            return vertex(p);
          };
          const int a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
          if (side)
            s.triangles.insert(s.triangles.end(), {{a, b, c}, {a, c, d}});
          else
            s.triangles.insert(s.triangles.end(), {{a, c, b}, {a, d, c}});
        }
  return s;
}

// A narrow band of exact distances and closest triangles round a surface.
struct Band {
  float voxel, background;
  std::int32_t tile_min[3], tile_count[3];
  std::vector<std::int32_t> tile, triangle;
  std::vector<float> distance;

  Band(const Surface& surface, double voxel_size, double half_width_voxels)
      : voxel(static_cast<float>(voxel_size)),
        background(static_cast<float>(half_width_voxels * voxel_size)) {
    const oracle::MeshDistance mesh(surface.vertices, surface.triangles);
    Eigen::Vector3d low = surface.vertices[0], high = low;
    for (const auto& v : surface.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
    const double tile_size = 8 * voxel_size, margin = background + voxel_size;
    for (int c = 0; c < 3; ++c) {
      tile_min[c] = static_cast<int>(std::floor((low[c] - margin) / tile_size));
      tile_count[c] = static_cast<int>(std::floor((high[c] + margin) / tile_size)) - tile_min[c] + 1;
    }
    for (int i = 0; i < tile_count[0]; ++i)
      for (int j = 0; j < tile_count[1]; ++j)
        for (int k = 0; k < tile_count[2]; ++k)
          add_tile(mesh, {tile_min[0] + i, tile_min[1] + j, tile_min[2] + k});
  }

  kernels::LevelSetView view() const {
    kernels::LevelSetView v{voxel, background, {}, {}, tile.data(), distance.data(), triangle.data()};
    std::copy_n(tile_min, 3, v.tile_min), std::copy_n(tile_count, 3, v.tile_count);
    return v;
  }

 private:
  void add_tile(const oracle::MeshDistance& mesh, Eigen::Vector3i at) {
    const Eigen::Vector3d centre = voxel * (8.0 * at.cast<double>() + Eigen::Vector3d::Constant(3.5));
    if (mesh.closest(centre).distance > background + 4 * std::sqrt(3.0) * voxel) {
      tile.push_back(mesh.inside(centre) ? kernels::kTileInside - mesh.closest(centre).triangle
                                         : kernels::kTileOutside);
      return;
    }
    tile.push_back(static_cast<std::int32_t>(distance.size() / 512));
    for (int v = 0; v < 512; ++v) {
      const Eigen::Vector3d p = voxel * (8 * at + Eigen::Vector3i(v >> 6, v >> 3 & 7, v & 7)).cast<double>();
      const auto closest = mesh.closest(p);
      const float away = std::min(static_cast<float>(closest.distance), background);
      const bool inside = mesh.inside(p);
      distance.push_back(inside ? -away : away);
      triangle.push_back(inside || closest.distance < background ? closest.triangle : -1);
    }
  }
};

// The surface whose vertices are exactly those that a kernel sees.
inline Surface in_float(Surface surface) {
  for (auto& v : surface.vertices) v = v.cast<float>().cast<double>();
  return surface;
}

// A solid that stands where its mesh does until the view is changed. The view lives as long as the solid.
struct MeshSolid {
  Surface surface;
  Band band;
  std::vector<std::int32_t> neighbours;
  std::vector<float> vertices;

  MeshSolid(Surface mesh, double voxel_size, double half_width_voxels = 3)
      : surface(in_float(std::move(mesh))),
        band(surface, voxel_size, half_width_voxels),
        neighbours(surface.neighbours()) {
    for (const auto& v : surface.vertices)
      for (int c = 0; c < 3; ++c) vertices.push_back(static_cast<float>(v[c]));
  }

  kernels::SolidView view(double friction = 0.5) const {
    kernels::SolidView v{};
    v.level_set[0] = v.level_set[1] = band.view();
    v.friction = static_cast<float>(friction);
    for (int k = 0; k < 9; k += 4) v.rotation[k] = v.rotation_before[k] = 1;
    v.triangles = surface.triangles[0].data(), v.neighbours = neighbours.data();
    v.vertices = v.vertices_before = vertices.data();
    v.triangle_count = static_cast<std::int32_t>(surface.triangles.size());
    return v;
  }
};

}  // namespace ringlet::kernels_testing
