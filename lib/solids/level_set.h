// Narrow-band level sets of closed surfaces, as the kernels read them.
#pragma once
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "kernels/solid/solid_view.h"
#include "solids/surface.h"

namespace ringlet::solids {

// Owns what a kernels::LevelSetView points at; see there for the meaning of each.
struct LevelSet {
  float voxel_size = 0;
  float background = 0;
  std::array<std::int32_t, 3> tile_min{}, tile_count{};
  std::vector<std::int32_t> tile;
  std::vector<float> distance;
  std::vector<std::int32_t> triangle;

  kernels::LevelSetView view() const;
  std::size_t bytes() const;
  bool encloses_volume() const;  // some voxel is inside
  bool operator==(const LevelSet&) const = default;
};

// The signed distance in a band of `half_width` voxels on either side of `surface`, whose vertices are now at
// `vertices` [vertex_count] [m, level-set coordinates]. Distances and closest triangles are exact at the
// voxels. Parts that another part hides and degenerate triangles count for nothing. The same for any number
// of threads. Throws Error{kInput} where the bounds hold too many voxels.
LevelSet build_level_set(const ClosedSurface& surface, std::span<const Eigen::Vector3f> vertices,
                         float voxel_size, int half_width);

// A .vdb of two grids, `distance` [m] and `triangle`. Throws Error{kIo}.
void write_level_set(const std::filesystem::path& file, const LevelSet& level_set);

// Throws Error{kIo} where the file is not one of write_level_set's. `triangle_count` bounds what it may refer
// to.
LevelSet read_level_set(const std::filesystem::path& file, std::size_t triangle_count);

}  // namespace ringlet::solids
