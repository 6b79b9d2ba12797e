// Trilinear samples of a narrow-band level set, one point at a time.
#pragma once
#include "kernels/backend/vector.h"
#include "kernels/solid/solid_view.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
RINGLET_FUNCTION int floor_to_int(T a) {
  const int truncated = static_cast<int>(a);
  return truncated - (a < static_cast<T>(truncated) ? 1 : 0);
}

// The tile number of the tile at these tile coordinates, kTileOutside beyond the grid.
RINGLET_FUNCTION std::int32_t tile_at(const LevelSetView& set, int x, int y, int z) {
  const int i = x - set.tile_min[0], j = y - set.tile_min[1], k = z - set.tile_min[2];
  if (i < 0 || j < 0 || k < 0 || i >= set.tile_count[0] || j >= set.tile_count[1] || k >= set.tile_count[2])
    return kTileOutside;
  return set.tile[(i * set.tile_count[1] + j) * set.tile_count[2] + k];
}

// Where a voxel's values are, -1 where its tile is outside, -2 where it is inside.
RINGLET_FUNCTION std::int64_t voxel_at(const LevelSetView& set, int x, int y, int z) {
  const std::int32_t tile = tile_at(set, x >> 3, y >> 3, z >> 3);
  return tile < 0 ? tile : static_cast<std::int64_t>(tile) * 512 + ((x & 7) << 6 | (y & 7) << 3 | (z & 7));
}

inline constexpr int kCorners = 8;

template <class T>
struct LevelSetSample {
  T distance;    // [m], plus or minus the background beyond the band
  bool in_band;  // the corners' triangles are worth a look
  std::int32_t triangle[kCorners];
};

// `p` in level-set coordinates [m].
template <class T>
RINGLET_FUNCTION LevelSetSample<T> sample_level_set(const LevelSetView& set, Vector3<T> p) {
  LevelSetSample<T> sample;
  const T per_voxel = T(1) / static_cast<T>(set.voxel_size);
  const T limit = T(1e9);  // far enough; keeps the conversion to int defined
  const Vector3<T> q = {min(max(p.x * per_voxel, -limit), limit), min(max(p.y * per_voxel, -limit), limit),
                        min(max(p.z * per_voxel, -limit), limit)};
  const int x = floor_to_int(q.x), y = floor_to_int(q.y), z = floor_to_int(q.z);
  const std::int32_t tile = tile_at(set, x >> 3, y >> 3, z >> 3);
  if (tile < 0) {
    sample.in_band = false;
    sample.distance = tile == kTileInside ? -static_cast<T>(set.background) : static_cast<T>(set.background);
    return sample;
  }
  const T fx = q.x - static_cast<T>(x), fy = q.y - static_cast<T>(y), fz = q.z - static_cast<T>(z);
  sample.in_band = true;
  sample.distance = T(0);
  for (int corner = 0; corner < kCorners; ++corner) {
    const int dx = corner >> 2, dy = corner >> 1 & 1, dz = corner & 1;
    const std::int64_t voxel = voxel_at(set, x + dx, y + dy, z + dz);
    const T value = voxel >= 0 ? static_cast<T>(set.distance[voxel])
                               : (voxel == kTileInside ? -static_cast<T>(set.background)
                                                       : static_cast<T>(set.background));
    sample.triangle[corner] = voxel >= 0 ? set.triangle[voxel] : -1;
    const T weight = (dx ? fx : T(1) - fx) * (dy ? fy : T(1) - fy) * (dz ? fz : T(1) - fz);
    sample.distance = fma(weight, value, sample.distance);
  }
  return sample;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
