// How often a solid's surface winds round a point: the signed crossings of the ray from the point along +x.
// Exact for a closed surface, one that passes through itself too, where the closest triangle alone does not
// tell inside from outside: a point above one fold of skin may be inside another.
#pragma once
#include "kernels/backend/vector.h"
#include "kernels/solid/solid_view.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
RINGLET_FUNCTION Vector3<T> corner(const float* vertices, std::int32_t vertex) {
  const float* v = vertices + 3 * static_cast<std::int64_t>(vertex);
  return {static_cast<T>(v[0]), static_cast<T>(v[1]), static_cast<T>(v[2])};
}

// Twice the signed area of the origin, a, b in the yz plane; rounding changes sign with the order of a and b,
// so that of two triangles that share an edge a ray crosses just one.
template <class T>
RINGLET_FUNCTION T crossing_side(Vector3<T> a, Vector3<T> b) {
  const T left = a.y * b.z, right = a.z * b.y;
  return left - right;
}

// 1 where the ray from the origin along +x leaves through the triangle, -1 where it enters, 0 where it
// misses. A ray through an edge or a vertex counts as one moved by (e, e^2) in y and z, e as small as it
// takes: every triangle about them agrees on it.
template <class T>
RINGLET_FUNCTION int crossing(Vector3<T> a, Vector3<T> b, Vector3<T> c) {
  const auto positive = [](T side, Vector3<T> from, Vector3<T> to) {
    if (side != T(0)) return side > T(0);
    return from.z != to.z ? from.z > to.z : to.y > from.y;
  };
  const bool ab = positive(crossing_side(a, b), a, b), bc = positive(crossing_side(b, c), b, c),
             ca = positive(crossing_side(c, a), c, a);
  if (ab != bc || bc != ca) return 0;
  const bool ahead = (dot(a, cross(b, c)) > T(0)) == ab;
  return !ahead ? 0 : ab ? 1 : -1;
}

// `p` in level-set coordinates [m]. 0 outside; negative where skin has turned inside out.
template <class T>
RINGLET_FUNCTION int winding_number(const SolidView& solid, Vector3<T> p) {
  const CrossingsView& bins = solid.crossings;
  // In single precision, as the bins were made.
  const float y = (static_cast<float>(p.y) - bins.low[0]) * bins.per_metre,
              z = (static_cast<float>(p.z) - bins.low[1]) * bins.per_metre;
  if (!(y >= 0 && z >= 0 && y < static_cast<float>(bins.count[0]) && z < static_cast<float>(bins.count[1])))
    return 0;
  const std::int32_t bin = static_cast<std::int32_t>(y) * bins.count[1] + static_cast<std::int32_t>(z);
  int sum = 0;
  for (std::int32_t k = bins.start[bin]; k < bins.start[bin + 1]; ++k) {
    const std::int32_t* v = solid.triangles + 3 * static_cast<std::int64_t>(bins.triangle[k]);
    const auto from_p = [&](int c) { return corner<T>(solid.vertices, v[c]) - p; };
    sum += crossing(from_p(0), from_p(1), from_p(2));
  }
  return sum;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
