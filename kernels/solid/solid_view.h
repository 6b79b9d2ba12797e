// A solid as the kernels see it for one substep: narrow-band level sets, a rigid pose, and the surface
// triangles for exact normals and velocities. Plain pointers; whoever fills it owns the memory for the
// substep.
#pragma once
#include <cstdint>

namespace ringlet::kernels {

// Sparse narrow band in tiles of 8^3 voxels, the leaf nodes of an OpenVDB grid. Voxel (i, j, k) has its
// sample at voxel_size * (i, j, k) in level-set coordinates. Distances [m], negative inside.
struct LevelSetView {
  float voxel_size;          // [m]
  float background;          // [m] half width of the band: the distance stored beyond it
  std::int32_t tile_min[3];  // lowest tile coordinate, in tiles
  std::int32_t tile_count[3];
  const std::int32_t* tile;  // [x][y][z]: tile number, kTileOutside, or kTileInside less a triangle near by
  const float* distance;     // [tiles][512], voxel (x & 7) << 6 | (y & 7) << 3 | (z & 7)
  const std::int32_t* triangle;  // [tiles][512] closest triangle; beyond the band one near by, -1 outside
};
inline constexpr std::int32_t kTileOutside = -1;
inline constexpr std::int32_t kTileInside = -2;

// The triangles that a ray along +x may cross, binned by where it starts in the yz plane.
struct CrossingsView {
  float low[2];     // [m] y and z of the first bin's corner
  float per_metre;  // bins
  std::int32_t count[2];
  const std::int32_t* start;     // [bins + 1] into `triangle`
  const std::int32_t* triangle;  // in ascending order within a bin
};

struct SolidView {
  LevelSetView level_set[2];  // at the frame before and the frame after; the same for a rigid solid
  float blend;                // weight of level_set[1]; 0 for a rigid solid
  float friction;             // Coulomb mu [-]
  float offset;               // [m] the collision surface lies this far outside the level set

  // World from level-set coordinates, x = rotation * p + translation, at the substep's start and end.
  // Row-major, [m].
  double rotation_before[9], translation_before[3];
  double rotation[9], translation[3];

  // The surface (caps included) in level-set coordinates at the substep's start and end; the same for a rigid
  // solid.
  const std::int32_t* triangles;   // [triangles][3]
  const std::int32_t* neighbours;  // [triangles][3] triangle across the edge from corner k to k + 1, -1: none
  const float* vertices_before;    // [vertices][3] [m]
  const float* vertices;           // [vertices][3] [m]
  std::int32_t triangle_count;

  // Where the closest triangle does not tell inside from outside, at the substep's end: where the surface
  // passes through itself or the solid is thin beside the voxels. Null where there is no such place.
  CrossingsView crossings;
  const unsigned char* folded_tiles;  // as level_set[0].tile: 1 near such a place
};

}  // namespace ringlet::kernels
