// A solid's surface near a point: signed distance, normal and velocity.
//
// The level set finds where the surface is; near it the exact mesh decides. The voxels' closest triangles and
// a walk over their neighbours give the closest point, so that a coarse grid costs no accuracy, normals do
// not suffer from trilinear gradients, and between two frames of a deforming solid the mesh is that of the
// substep.
#pragma once
#include "kernels/solid/closest_point.h"
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
RINGLET_FUNCTION Vector3<T> corner(const float* vertices, std::int32_t vertex) {
  const float* v = vertices + 3 * static_cast<std::int64_t>(vertex);
  return {static_cast<T>(v[0]), static_cast<T>(v[1]), static_cast<T>(v[2])};
}

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

// Walks from triangle to neighbour while that comes closer.
template <class T>
RINGLET_FUNCTION void walk(const SolidView& solid, Vector3<T> p, ClosestPoint<T>& best) {
  constexpr int kMostSteps = 64;
  for (int step = 0; step < kMostSteps; ++step) {
    const std::int32_t from = best.triangle;
    for (int edge = 0; edge < 3; ++edge) {
      const std::int32_t other = solid.neighbours[3 * static_cast<std::int64_t>(from) + edge];
      if (other < 0) continue;
      const ClosestPoint<T> found = closest_on_triangle(solid, other, p);
      if (found.distance2 < best.distance2) best = found;
    }
    if (best.triangle == from) return;
  }
}

// The outward direction at a closest point: the triangle's normal, on an edge or corner the sum over the
// triangles that share it (those as close), found among the neighbours.
template <class T>
RINGLET_FUNCTION Vector3<T> outward(const SolidView& solid, Vector3<T> p, const ClosestPoint<T>& best) {
  Vector3<T> sum = unit_normal<T>(solid, best.triangle);
  const T tie = best.distance2 * T(1.0001) + T(1e-14);
  for (int edge = 0; edge < 3; ++edge) {
    const std::int32_t other = solid.neighbours[3 * static_cast<std::int64_t>(best.triangle) + edge];
    if (other >= 0 && closest_on_triangle(solid, other, p).distance2 <= tie)
      sum = sum + unit_normal<T>(solid, other);
  }
  return sum;
}

// How near the level set must say the surface is for the exact mesh to be asked, in voxels.
inline constexpr float kNearVoxels = 1.5f;

// `p` in level-set coordinates at the substep's end [m].
template <class T>
RINGLET_OUTLINED SurfaceSample<T> sample_surface(const SolidView& solid, Vector3<T> p) {
  const LevelSetSample<T> first = sample_level_set(solid.level_set[0], p);
  LevelSetSample<T> second = first;
  T distance = first.distance;
  if (solid.blend > 0.0f) {
    second = sample_level_set(solid.level_set[1], p);
    distance = fma(static_cast<T>(solid.blend), second.distance - first.distance, first.distance);
  }
  SurfaceSample<T> sample{distance - static_cast<T>(solid.offset), false, zero3<T>(), -1, zero3<T>()};
  const T voxel = static_cast<T>(solid.level_set[0].voxel_size);
  if (sample.distance > static_cast<T>(kNearVoxels) * voxel) return sample;

  ClosestPoint<T> best{T(1e30), zero3<T>(), zero3<T>(), -1};
  for (int k = 0; k < 2 * kCorners; ++k) {
    const LevelSetSample<T>& of = k < kCorners ? first : second;
    if (!of.in_band || (k >= kCorners && solid.blend <= 0.0f)) continue;
    const std::int32_t triangle = of.triangle[k % kCorners];
    if (triangle < 0 || triangle == best.triangle) continue;
    const ClosestPoint<T> found = closest_on_triangle(solid, triangle, p);
    if (found.distance2 < best.distance2) best = found;
  }
  if (best.triangle < 0) {  // past the band, deep inside: ask every triangle
    for (std::int32_t triangle = 0; triangle < solid.triangle_count; ++triangle) {
      const ClosestPoint<T> found = closest_on_triangle(solid, triangle, p);
      if (found.distance2 < best.distance2) best = found;
    }
  }
  if (best.triangle < 0) return sample;
  walk(solid, p, best);

  const Vector3<T> out = outward(solid, p, best);
  const T away = sqrt(best.distance2);
  const bool far_from_zero = abs(distance) > T(0.75) * voxel;  // there the level set knows the side
  const bool inside = far_from_zero ? distance < T(0) : dot(best.to_point, out) < T(0);
  const bool touching = away < T(1e-7);  // [m] no direction of its own
  const T side = inside ? T(-1) : T(1);
  const Vector3<T> towards = touching ? out : side * best.to_point;
  sample.exact = true;
  sample.distance = side * away - static_cast<T>(solid.offset);
  sample.normal = inverse_or_zero(length(towards), shortest_direction<T>()) * towards;
  sample.triangle = best.triangle;
  sample.barycentric = best.barycentric;
  return sample;
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

// How far the sampled surface point moves over the substep, in the world [m].
template <class T>
RINGLET_FUNCTION Vector3<T> surface_displacement(const SolidView& solid, const SurfaceSample<T>& at) {
  const std::int32_t* v = solid.triangles + 3 * static_cast<std::int64_t>(at.triangle);
  const auto point = [&](const float* vertices) {
    return at.barycentric.x * corner<T>(vertices, v[0]) + at.barycentric.y * corner<T>(vertices, v[1]) +
           at.barycentric.z * corner<T>(vertices, v[2]);
  };
  const Vector3<T> before = point(solid.vertices_before), now = point(solid.vertices);
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
