// Solid walls in the grid: what share of each face lies outside the solids, and how fast the wall moves there
// (Batty et al. 2007). Only what is near a solid has any, and of its faces those of fluid cells are looked
// at.
#pragma once
#include "kernels/grid/transfer.h"
#include "kernels/solid/surface.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr int kWallValues = 6;  // of a node: open share of its three faces, the wall's velocity there

// A place of the grid in a solid's level-set axes [m].
template <class T>
RINGLET_FUNCTION Vector3<T> in_solid(const GridAxes& axes, const SolidView& solid, const double* place) {
  double away[3];
  for (int c = 0; c < 3; ++c) {
    const double* r = axes.rotation + 3 * c;
    away[c] = axes.cell * (r[0] * place[0] + r[1] * place[1] + r[2] * place[2]) +
              (axes.origin[c] - solid.translation[c]);
  }
  return rotate_into<T>(solid.rotation, away);
}

// Whether 2 x 2 x 2 cells may have faces that are not wholly open; `part`: their keys' upper bits.
template <class T>
RINGLET_FUNCTION bool near_wall(const GridData<T>& g, std::int64_t part) {
  // From their middle to the farthest of their faces, and half a cell for what is in part open.
  const T cells = static_cast<T>(2.25 * g.step.axes.cell);
  const Octet<std::int32_t> corner = tile_corner(g, static_cast<std::int32_t>(part / kTileParts));
  double middle[3];
  for (int c = 0; c < 3; ++c) middle[c] = kTileEdge * g.low[c] + corner.v[c] + 1 + 2 * (part >> c & 1);
  for (std::int32_t s = 0; s < g.step.solid_count; ++s) {
    const SolidView& solid = g.step.solids[s];
    const T offset = static_cast<T>(solid.offset);
    // Far from its surface a level set tells the value of the voxel nearest, by half a diagonal at most.
    const T reach = cells + static_cast<T>(0.87f * solid.level_set[0].voxel_size);
    const Vector3<T> p = in_solid<T>(g.step.axes, solid, middle);
    if (BlendedSample<T>(solid, p).distance - offset < reach) return true;
    // A band narrower than the reach does not tell.
    if (static_cast<T>(solid.level_set[0].background) - offset < reach &&
        distance_to_bounds(solid.level_set[0], p) < reach)
      return true;
  }
  return false;
}

// The velocity of a solid at a place near its surface, relative to the grid's axes, along one of them [m/s].
template <class T>
RINGLET_FUNCTION T wall_velocity(const GridData<T>& g, const SolidView& solid, const double* place,
                                 Vector3<T> p, std::int32_t triangle, int axis) {
  const GridAxes& axes = g.step.axes;
  double turn[9], away[3];
  for (int k = 0; k < 9; ++k) turn[k] = solid.rotation[k] - solid.rotation_before[k];
  Vector3<T> moved = rotate(turn, p);  // over the substep
  if (triangle >= 0 && solid.vertices != solid.vertices_before) {
    const T third = static_cast<T>(1.0 / 3);
    moved =
        moved + rotate(solid.rotation, local_displacement(solid, triangle, Vector3<T>{third, third, third}));
  }
  const T in_world[3] = {moved.x, moved.y, moved.z};
  T along = T(0);
  for (int c = 0; c < 3; ++c) {
    const double* r = axes.rotation + 3 * c;
    away[c] = axes.cell * (r[0] * place[0] + r[1] * place[1] + r[2] * place[2]);
  }
  for (int c = 0; c < 3; ++c) {
    const double* slope = axes.slope + 3 * c;
    const double carried = axes.velocity[c] + slope[0] * away[0] + slope[1] * away[1] + slope[2] * away[2];
    const double own =
        (static_cast<double>(in_world[c]) + solid.translation[c] - solid.translation_before[c]) /
        g.step.substep;
    along += static_cast<T>(axes.rotation[3 * c + axis] * (own - carried));
  }
  return along;
}

template <class T>
struct Opening {
  T share, velocity;
};
template <class T>
RINGLET_FUNCTION Opening<T> opening_of(const GridData<T>& g, std::int64_t node, int axis) {
  const std::int64_t wall = g.wall[node / kPartCells];
  if (wall < 0) return {T(1), T(0)};
  const T* at = g.opening + (wall * kPartCells + node % kPartCells) * kWallValues;
  return {at[axis], at[3 + axis]};
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
