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

// Where the table of tiles has these tile coordinates, -1 beyond it.
RINGLET_FUNCTION std::int32_t table_index(const LevelSetView& set, int x, int y, int z) {
  const int i = x - set.tile_min[0], j = y - set.tile_min[1], k = z - set.tile_min[2];
  if (i < 0 || j < 0 || k < 0 || i >= set.tile_count[0] || j >= set.tile_count[1] || k >= set.tile_count[2])
    return -1;
  return (i * set.tile_count[1] + j) * set.tile_count[2] + k;
}

// The tile number there, kTileOutside beyond the table.
RINGLET_FUNCTION std::int32_t tile_at(const LevelSetView& set, int x, int y, int z) {
  const std::int32_t index = table_index(set, x, y, z);
  return index < 0 ? kTileOutside : set.tile[index];
}

// Where a voxel's values are; where it has none, its tile's number.
RINGLET_FUNCTION std::int64_t voxel_at(const LevelSetView& set, int x, int y, int z) {
  const std::int32_t tile = tile_at(set, x >> 3, y >> 3, z >> 3);
  return tile < 0 ? tile : static_cast<std::int64_t>(tile) * 512 + ((x & 7) << 6 | (y & 7) << 3 | (z & 7));
}

template <class T>
struct LevelSetSample {
  T distance;  // [m], plus or minus the background beyond the band
  std::int32_t
      triangle;  // closest to the voxel nearest to the point, deep inside one near by; -1 where unknown
};

// A value beyond this many voxels needs no interpolation: the surface is not in the cell.
inline constexpr float kFarVoxels = 3.0f;

// `p` in level-set coordinates [m].
template <class T>
RINGLET_FUNCTION LevelSetSample<T> sample_level_set(const LevelSetView& set, Vector3<T> p) {
  const T per_voxel = T(1) / static_cast<T>(set.voxel_size), background = static_cast<T>(set.background);
  const T limit = T(1e9);  // far enough; keeps the conversion to int defined
  const auto index = [&](T a) { return min(max(a * per_voxel, T(0) - limit), limit); };
  const Vector3<T> q = {index(p.x), index(p.y), index(p.z)};
  const auto nearest = [](T a) { return floor_to_int(a + T(0.5)); };
  const std::int64_t centre = voxel_at(set, nearest(q.x), nearest(q.y), nearest(q.z));
  if (centre < 0) {
    if (centre == kTileOutside) return {background, -1};
    return {T(0) - background, static_cast<std::int32_t>(kTileInside - centre)};
  }
  const T value = static_cast<T>(set.distance[centre]);
  const std::int32_t triangle = set.triangle[centre];
  if (abs(value) > static_cast<T>(kFarVoxels * set.voxel_size)) return {value, triangle};

  const int x = floor_to_int(q.x), y = floor_to_int(q.y), z = floor_to_int(q.z);
  const T f[3] = {q.x - static_cast<T>(x), q.y - static_cast<T>(y), q.z - static_cast<T>(z)};
  const auto mix = [](T t, T a, T b) { return fma(t, b - a, a); };
  const auto interpolated = [&](const auto& at) {
    const T low = mix(f[1], mix(f[2], at(0), at(1)), mix(f[2], at(2), at(3)));
    const T high = mix(f[1], mix(f[2], at(4), at(5)), mix(f[2], at(6), at(7)));
    return mix(f[0], low, high);
  };
  const std::int64_t lowest = voxel_at(set, x, y, z);
  if (lowest >= 0 && (x & 7) < 7 && (y & 7) < 7 && (z & 7) < 7) {  // all eight in one tile
    const float* from = set.distance + lowest;
    return {interpolated([&](int corner) {
              return static_cast<T>(from[(corner >> 2) << 6 | (corner >> 1 & 1) << 3 | (corner & 1)]);
            }),
            triangle};
  }
  return {interpolated([&](int corner) {
            const std::int64_t voxel =
                voxel_at(set, x + (corner >> 2), y + (corner >> 1 & 1), z + (corner & 1));
            if (voxel < 0) return voxel == kTileOutside ? background : T(0) - background;
            return static_cast<T>(set.distance[voxel]);
          }),
          triangle};
}

// To the box of all tiles [m]; 0 within. Nothing outside it is near the surface.
template <class T>
RINGLET_FUNCTION T distance_to_bounds(const LevelSetView& set, Vector3<T> p) {
  const T edge = static_cast<T>(8 * set.voxel_size);
  const auto beyond = [&](T a, int axis) {
    const T low = edge * static_cast<T>(set.tile_min[axis]),
            high = low + edge * static_cast<T>(set.tile_count[axis]);
    return max(T(0), max(low - a, a - high));
  };
  return length(Vector3<T>{beyond(p.x, 0), beyond(p.y, 1), beyond(p.z, 2)});
}

// The triangles closest to the corners of the cell that holds p; -1 where unknown.
inline constexpr int kCorners = 8;
template <class T>
RINGLET_FUNCTION std::int32_t corner_triangle(const LevelSetView& set, Vector3<T> p, int corner) {
  const T per_voxel = T(1) / static_cast<T>(set.voxel_size);
  const std::int64_t voxel = voxel_at(set, floor_to_int(p.x * per_voxel) + (corner >> 2),
                                      floor_to_int(p.y * per_voxel) + (corner >> 1 & 1),
                                      floor_to_int(p.z * per_voxel) + (corner & 1));
  return voxel < 0 ? -1 : set.triangle[voxel];
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
