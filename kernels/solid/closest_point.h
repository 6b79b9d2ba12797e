// The closest point of a triangle (Ericson, Real-Time Collision Detection, 5.1.5: Voronoi regions of the
// features).
#pragma once
#include "kernels/backend/vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Barycentric coordinates of the point of triangle abc closest to p. A triangle without area gives one
// of its points, if not the closest: in a mesh its neighbours have that one.
template <class T>
RINGLET_FUNCTION Vector3<T> closest_barycentrics(Vector3<T> p, Vector3<T> a, Vector3<T> b, Vector3<T> c) {
  const T zero = T(0), one = T(1);
  const Vector3<T> ab = b - a, ac = c - a, ap = p - a;
  const T d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= zero && d2 <= zero) return {one, zero, zero};
  const Vector3<T> bp = p - b;
  const T d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= zero && d4 <= d3) return {zero, one, zero};
  const T vc = d1 * d4 - d3 * d2;
  if (vc <= zero && d1 >= zero && d3 <= zero) {
    const T t = d1 - d3 > zero ? d1 / (d1 - d3) : zero;
    return {one - t, t, zero};
  }
  const Vector3<T> cp = p - c;
  const T d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= zero && d5 <= d6) return {zero, zero, one};
  const T vb = d5 * d2 - d1 * d6;
  if (vb <= zero && d2 >= zero && d6 <= zero) {
    const T t = d2 - d6 > zero ? d2 / (d2 - d6) : zero;
    return {one - t, zero, t};
  }
  const T va = d3 * d6 - d5 * d4;
  if (va <= zero && d4 - d3 >= zero && d5 - d6 >= zero) {
    const T sum = (d4 - d3) + (d5 - d6), t = sum > zero ? (d4 - d3) / sum : zero;
    return {zero, one - t, t};
  }
  const T sum = va + vb + vc;
  if (!(sum > zero)) return {one, zero, zero};
  const T v = vb / sum, w = vc / sum;
  return {one - v - w, v, w};
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
