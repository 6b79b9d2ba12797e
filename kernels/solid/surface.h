// A solid's surface near a point: signed distance, normal and velocity.
//
// The level set finds where the surface is; near it the exact mesh decides. The voxels' closest triangles and
// a walk over their neighbours give the closest point, so that a coarse grid costs no accuracy, normals do
// not suffer from trilinear gradients, and between two frames of a deforming solid the mesh is that of the
// substep.
#pragma once
#include "kernels/solid/closest_point.h"
#include "kernels/solid/crossings.h"
#include "kernels/solid/level_set.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
struct SurfaceSample {
  T distance;         // [m] to the collision surface, negative inside
  bool exact;         // near the surface: what follows is filled in, and `distance` is exact
  Vector3<T> normal;  // outward, level-set axes
  std::int32_t triangle;
  Vector3<T> barycentric;
};

template <class T>
struct ClosestPoint {
  T distance2;
  Vector3<T> to_point;  // from the closest point
  Vector3<T> barycentric;
  std::int32_t triangle;
};

template <class T>
RINGLET_FUNCTION ClosestPoint<T> closest_on_triangle(const SolidView& solid, std::int32_t triangle,
                                                     Vector3<T> p) {
  const std::int32_t* v = solid.triangles + 3 * static_cast<std::int64_t>(triangle);
  const Vector3<T> a = corner<T>(solid.vertices, v[0]), b = corner<T>(solid.vertices, v[1]),
                   c = corner<T>(solid.vertices, v[2]);
  const Vector3<T> w = closest_barycentrics(p, a, b, c);
  const Vector3<T> to_point = w.x * (p - a) + w.y * (p - b) + w.z * (p - c);
  return {dot(to_point, to_point), to_point, w, triangle};
}

template <class T>
RINGLET_FUNCTION Vector3<T> unit_normal(const SolidView& solid, std::int32_t triangle) {
  const std::int32_t* v = solid.triangles + 3 * static_cast<std::int64_t>(triangle);
  const Vector3<T> a = corner<T>(solid.vertices, v[0]);
  const Vector3<T> n = cross(corner<T>(solid.vertices, v[1]) - a, corner<T>(solid.vertices, v[2]) - a);
  return inverse_or_zero(length(n), T(1e-20)) * n;
}

// The triangles that share a closest point: across the edge it lies on, around the corner it lies at; none
// where it lies inside its triangle. Calls visit(triangle) for each but the triangle itself.
template <class T, class Visit>
RINGLET_FUNCTION void for_each_sharing(const SolidView& solid, const ClosestPoint<T>& at,
                                       const Visit& visit) {
  constexpr int kMostAround = 24;
  const T zero = T(0), w[3] = {at.barycentric.x, at.barycentric.y, at.barycentric.z};
  for (int k = 0; k < 3; ++k) {
    const std::int64_t row = 3 * static_cast<std::int64_t>(at.triangle);
    const bool on_edge = w[(k + 2) % 3] <= zero, at_corner = on_edge && w[(k + 1) % 3] <= zero;
    if (on_edge && !at_corner && w[k] > zero && w[(k + 1) % 3] > zero && solid.neighbours[row + k] >= 0)
      visit(solid.neighbours[row + k]);
    if (!at_corner) continue;
    const std::int32_t vertex = solid.triangles[row + k];
    std::int32_t triangle = solid.neighbours[row + k];
    for (int n = 0; n < kMostAround && triangle >= 0 && triangle != at.triangle; ++n) {
      visit(triangle);
      const std::int32_t* v = solid.triangles + 3 * static_cast<std::int64_t>(triangle);
      const int corner_there = v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
      triangle = solid.neighbours[3 * static_cast<std::int64_t>(triangle) + corner_there];
    }
  }
}

template <class T>
RINGLET_FUNCTION void consider(const SolidView& solid, std::int32_t triangle, Vector3<T> p,
                               ClosestPoint<T>& best) {
  if (triangle < 0 || triangle == best.triangle) return;
  const ClosestPoint<T> found = closest_on_triangle(solid, triangle, p);
  if (found.distance2 < best.distance2) best = found;
}

// Walks over the surface while that comes closer.
template <class T>
RINGLET_FUNCTION void walk(const SolidView& solid, Vector3<T> p, ClosestPoint<T>& best) {
  constexpr int kMostSteps = 64;
  for (int step = 0; step < kMostSteps; ++step) {
    const ClosestPoint<T> from = best;
    for_each_sharing(solid, from, [&](std::int32_t triangle) { consider(solid, triangle, p, best); });
    if (best.triangle == from.triangle) return;
  }
}

// The outward direction at a closest point: the triangle's normal, on an edge or corner the sum over the
// triangles that share it.
template <class T>
RINGLET_FUNCTION Vector3<T> outward(const SolidView& solid, const ClosestPoint<T>& best) {
  Vector3<T> sum = unit_normal<T>(solid, best.triangle);
  for_each_sharing(solid, best, [&](std::int32_t triangle) { sum = sum + unit_normal<T>(solid, triangle); });
  return sum;
}

// The side of the surface that a point is on, told by the closest point alone.
template <class T>
struct Side {
  Vector3<T> outward;  // of any length
  T distance;          // [m] negative where the point is behind the surface
};
template <class T>
RINGLET_FUNCTION Side<T> side_of(const SolidView& solid, const ClosestPoint<T>& at) {
  const Vector3<T> out = outward(solid, at);
  const T away = sqrt(at.distance2);
  return {out, dot(at.to_point, out) < T(0) ? T(0) - away : away};
}

// How near the level set must say the surface is for the exact mesh to be asked, in voxels. Its samples are
// exact; where the surface lies between a point and a corner of its cell, that corner's distance is no more
// than the corner is away, and the trilinear mean of these ways is at most half a cell's diagonal. Beyond it
// a level set knows the side, however thin the solid; one blended from two frames may miss a thin part that
// moves by more than its thickness in between.
inline constexpr float kNearVoxels = 0.867f;

// By how much the exact distance may differ from the level set's before it is doubted, in voxels.
inline constexpr float kDoubtVoxels = 0.1f;

// What the level sets say, blended in time.
template <class T>
struct BlendedSample {
  LevelSetSample<T> first, second;
  T distance;  // [m]

  RINGLET_FUNCTION BlendedSample(const SolidView& solid, Vector3<T> p)
      : first(sample_level_set(solid.level_set[0], p)), second(first), distance(first.distance) {
    if (!(solid.blend > 0.0f)) return;
    second = sample_level_set(solid.level_set[1], p);
    distance = fma(static_cast<T>(solid.blend), second.distance - first.distance, first.distance);
  }
};

// Where a strand grows on the solid: the level set's time-blended guess can miss that place, and does not
// know it where another part of the solid covers it, in a fold of skin or behind a limb.
struct Patch {
  std::int32_t triangle = -1;
  bool covered = false;
};

// The surface of a fold is looked at this far outside it, in voxels: past the rounding of single precision,
// nothing beside the fold's size.
inline constexpr float kAboveVoxels = 0.01f;

// Whether the surface passes through itself about p, or the solid is thin there.
template <class T>
RINGLET_FUNCTION bool near_fold(const SolidView& solid, Vector3<T> p) {
  if (solid.folded_tiles == nullptr) return false;
  const LevelSetView& set = solid.level_set[0];
  const T per_tile = T(0.125) / static_cast<T>(set.voxel_size);
  const std::int32_t index = table_index(set, floor_to_int(p.x * per_tile), floor_to_int(p.y * per_tile),
                                         floor_to_int(p.z * per_tile));
  return index < 0 || solid.folded_tiles[index] != 0;  // beyond the table nothing is known
}

// Whether the triangle lies inside another part of the solid where it is closest to p.
template <class T>
RINGLET_FUNCTION bool is_covered(const SolidView& solid, std::int32_t triangle, Vector3<T> p) {
  const Vector3<T> on_triangle = p - closest_on_triangle(solid, triangle, p).to_point;
  if (!near_fold(solid, on_triangle)) return false;
  const T above = static_cast<T>(kAboveVoxels * solid.level_set[0].voxel_size);
  return winding_number(solid, fma(above, unit_normal<T>(solid, triangle), on_triangle)) != 0;
}

// The sample at a closest point, `offset` [m] outside it.
template <class T>
RINGLET_FUNCTION SurfaceSample<T> sample_at(const ClosestPoint<T>& at, Vector3<T> outward, bool inside,
                                            T offset) {
  const T away = sqrt(at.distance2), side = inside ? T(-1) : T(1);
  const bool touching = away < T(1e-6);  // [m] the way to it is rounding
  const Vector3<T> towards = touching ? outward : side * at.to_point;
  return {fma(side, away, T(0) - offset), true,
          inverse_or_zero(length(towards), shortest_direction<T>()) * towards, at.triangle, at.barycentric};
}

// `p` in level-set coordinates at the substep's end [m]. Where the level set puts the surface farther than
// `near` [m] only the distance is given. The level set knows the surface that can be reached from without; a
// covered patch is surface too, and both of its sides are inside.
template <class T>
RINGLET_OUTLINED SurfaceSample<T> sample_surface(const SolidView& solid, Vector3<T> p, const Patch& skin,
                                                 T near) {
  const BlendedSample<T> level(solid, p);
  const LevelSetSample<T>&first = level.first, &second = level.second;
  const T distance = level.distance;
  const T offset = static_cast<T>(solid.offset), voxel = static_cast<T>(solid.level_set[0].voxel_size);
  const SurfaceSample<T> far_away{distance - offset, false, zero3<T>(), -1, zero3<T>()};
  if (far_away.distance > near) return far_away;

  ClosestPoint<T> best{T(1e30), zero3<T>(), zero3<T>(), -1};
  consider(solid, first.triangle, p, best);
  consider(solid, second.triangle, p, best);
  consider(solid, skin.triangle, p, best);
  if (best.triangle < 0) return far_away;
  walk(solid, p, best);
  // The walk can end where another part of the surface is closer still. Then it disagrees with the level set:
  // ask the triangles of the whole cell.
  Side<T> told = side_of(solid, best);
  if (abs(told.distance - distance) > static_cast<T>(kDoubtVoxels) * voxel) {
    for (int corner = 0; corner < kCorners; ++corner) {
      consider(solid, corner_triangle(solid.level_set[0], p, corner), p, best);
      if (solid.blend > 0.0f) consider(solid, corner_triangle(solid.level_set[1], p, corner), p, best);
    }
    walk(solid, p, best);
    told = side_of(solid, best);
  }
  bool on_sheet = false;
  if (skin.covered && distance < T(0)) {
    ClosestPoint<T> own = closest_on_triangle(solid, skin.triangle, p);
    walk(solid, p, own);
    on_sheet = own.distance2 <= best.distance2;
    if (on_sheet) best = own, told = side_of(solid, best);
  }
  // Farther from zero the level set knows the side; about folds rays do, else the closest triangle.
  const T beyond_doubt = static_cast<T>(kNearVoxels) * voxel;
  bool inside = distance < beyond_doubt && told.distance < T(0);
  if (on_sheet || distance < T(0) - beyond_doubt) {
    inside = true;
  } else if (near_fold(solid, p)) {
    const bool in_front = !inside;
    inside = winding_number(solid, p) != 0;
    on_sheet = inside && in_front;
  }
  return sample_at(best, told.outward, inside, on_sheet ? T(0) : offset);
}

template <class T>
RINGLET_FUNCTION SurfaceSample<T> sample_surface(const SolidView& solid, Vector3<T> p,
                                                 const Patch& skin = {}) {
  return sample_surface(solid, p, skin, static_cast<T>(kNearVoxels * solid.level_set[0].voxel_size));
}

// The sheet of the surface that a walk from `triangle` leads to, for a point behind it or behind another
// sheet: it lies inside, whichever side of this sheet it is on.
template <class T>
RINGLET_FUNCTION SurfaceSample<T> sample_sheet(const SolidView& solid, Vector3<T> p, std::int32_t triangle) {
  ClosestPoint<T> own = closest_on_triangle(solid, triangle, p);
  walk(solid, p, own);
  return sample_at(own, outward(solid, own), true, T(0));
}

// World from level-set axes and back.
template <class T>
RINGLET_FUNCTION Vector3<T> rotate(const double* rotation, Vector3<T> a) {
  const auto m = [rotation](int k) { return static_cast<T>(rotation[k]); };
  return {fma(m(2), a.z, fma(m(1), a.y, m(0) * a.x)), fma(m(5), a.z, fma(m(4), a.y, m(3) * a.x)),
          fma(m(8), a.z, fma(m(7), a.y, m(6) * a.x))};
}
template <class T>
RINGLET_FUNCTION Vector3<T> rotate_back(const double* rotation, Vector3<T> a) {
  const auto m = [rotation](int k) { return static_cast<T>(rotation[k]); };
  return {fma(m(6), a.z, fma(m(3), a.y, m(0) * a.x)), fma(m(7), a.z, fma(m(4), a.y, m(1) * a.x)),
          fma(m(8), a.z, fma(m(5), a.y, m(2) * a.x))};
}

template <class T>
RINGLET_FUNCTION Vector3<T> surface_point(const SolidView& solid, const float* vertices,
                                          std::int32_t triangle, Vector3<T> barycentric) {
  const std::int32_t* v = solid.triangles + 3 * static_cast<std::int64_t>(triangle);
  return barycentric.x * corner<T>(vertices, v[0]) + barycentric.y * corner<T>(vertices, v[1]) +
         barycentric.z * corner<T>(vertices, v[2]);
}

// How far a surface point moves over the substep by deformation alone, level-set axes [m].
template <class T>
RINGLET_FUNCTION Vector3<T> local_displacement(const SolidView& solid, std::int32_t triangle,
                                               Vector3<T> barycentric) {
  return surface_point(solid, solid.vertices, triangle, barycentric) -
         surface_point(solid, solid.vertices_before, triangle, barycentric);
}

// How far the sampled surface point moves over the substep, in the world [m].
template <class T>
RINGLET_FUNCTION Vector3<T> surface_displacement(const SolidView& solid, const SurfaceSample<T>& at) {
  const Vector3<T> before = surface_point(solid, solid.vertices_before, at.triangle, at.barycentric),
                   now = surface_point(solid, solid.vertices, at.triangle, at.barycentric);
  // R1 p1 - R0 p0 + (t1 - t0), with differences taken first: exactly zero for a still solid.
  double turn[9];
  for (int k = 0; k < 9; ++k) turn[k] = solid.rotation[k] - solid.rotation_before[k];
  const Vector3<T> shift = {static_cast<T>(solid.translation[0] - solid.translation_before[0]),
                            static_cast<T>(solid.translation[1] - solid.translation_before[1]),
                            static_cast<T>(solid.translation[2] - solid.translation_before[2])};
  return rotate(solid.rotation, now - before) + rotate(turn, before) + shift;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
