// The altitude spring of a tetrahedron (Selle et al. 2008, 4.2; physics.md section 7): of its four
// point-to-face and three edge-to-edge altitudes the one that is shortest now, with that altitude's rest
// length. It keeps the tetrahedron from collapsing and, since altitudes are signed, from turning inside out.
//
//   h = n . sum_i w_i x_i,  n the unit normal of the altitude's two ends, w_i the barycentric weights of
//   their nearest points: positive at one end, negative at the other, sum 0
//
// The weights' own change does not move h: the gradient of h to x_i is w_i n, exactly. Where another altitude
// becomes the shortest the force jumps to that one's: a strand bent hard under its weight trembles about such
// a jump.
#pragma once
#include "kernels/backend/vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class R>
struct Altitude {
  Vector3<R> normal;  // 0 where the four points lie on a line
  R weight[4];
  R length, rest_length;  // signed [m]
};

namespace altitude_detail {

// Which corners make an altitude: the plane through a, b and c (points) or the two lines a b and c d.
template <class R>
struct Search {
  const Vector3<R>*x, *rest;
  R area2;  // squared |N| of the largest so far: all altitudes times their |N| are six volumes
  Altitude<R> best;

  // Takes the altitude with normal N now, and N0 at rest, between corners p and q, if it is shorter.
  RINGLET_KERNEL void offer(Vector3<R> n, Vector3<R> n_rest, int p, int q, const R (&weight)[4]) {
    const R square = dot(n, n);
    const Mask<R> shorter = square > area2;
    if (!any(shorter)) return;
    const R inverse = inverse_or_zero(sqrt(square), R(Scalar<R>(1e-30)));
    const R inverse_rest = inverse_or_zero(length(n_rest), R(Scalar<R>(1e-30)));
    area2 = select(shorter, square, area2);
    best.normal = select(shorter, inverse * n, best.normal);
    best.length = select(shorter, inverse * dot(n, x[p] - x[q]), best.length);
    best.rest_length = select(shorter, inverse_rest * dot(n_rest, rest[p] - rest[q]), best.rest_length);
    RINGLET_UNROLL
    for (int k = 0; k < 4; ++k) best.weight[k] = select(shorter, weight[k], best.weight[k]);
  }
  // From p to the plane of a, b, c.
  RINGLET_KERNEL void face(int p, int a, int b, int c) {
    const Vector3<R> n = cross(x[b] - x[a], x[c] - x[a]);
    const R per_area2 = inverse_or_zero(dot(n, n), R(Scalar<R>(1e-30)));
    R weight[4];
    weight[p] = R(1);
    weight[a] = -per_area2 * dot(n, cross(x[b] - x[p], x[c] - x[p]));
    weight[b] = -per_area2 * dot(n, cross(x[c] - x[p], x[a] - x[p]));
    weight[c] = R(0) - (R(1) + weight[a] + weight[b]);
    offer(n, cross(rest[b] - rest[a], rest[c] - rest[a]), p, a, weight);
  }
  // From the line a b to the line c d.
  RINGLET_KERNEL void edges(int a, int b, int c, int d) {
    const Vector3<R> along = x[b] - x[a], other = x[d] - x[c], between = x[c] - x[a];
    const Vector3<R> n = cross(along, other);
    const R per_area2 = inverse_or_zero(dot(n, n), R(Scalar<R>(1e-30)));
    const R s = per_area2 * dot(n, cross(between, other)), t = per_area2 * dot(n, cross(between, along));
    R weight[4];
    weight[a] = s - R(1), weight[b] = -s, weight[c] = R(1) - t, weight[d] = t;
    offer(n, cross(rest[b] - rest[a], rest[d] - rest[c]), c, a, weight);
  }
};

}  // namespace altitude_detail

template <class R>
RINGLET_KERNEL Altitude<R> shortest_altitude(const Vector3<R> (&x)[4], const Vector3<R> (&rest)[4]) {
  altitude_detail::Search<R> search{x, rest, R(0), {zero3<R>(), {R(0), R(0), R(0), R(0)}, R(0), R(0)}};
  search.face(0, 1, 2, 3), search.face(1, 2, 3, 0), search.face(2, 3, 0, 1), search.face(3, 0, 1, 2);
  search.edges(0, 1, 2, 3), search.edges(0, 2, 1, 3), search.edges(0, 3, 1, 2);
  return search.best;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
