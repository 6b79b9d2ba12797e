// The forces of Augmented Mass-Spring and their parts of the implicit matrix (AMS paper 3.1; physics.md
// section 1). Everything per unit mass: stiffness [1/s^2], forces as accelerations [m/s^2].
#pragma once
#include "kernels/backend/vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// How a stiffness enters the implicit step's matrix: h^2 for the force at the step's end, h beta for material
// damping.
template <class R>
struct ImplicitWeights {
  R total;      // h^2 + h beta
  R geometric;  // h^2, or 0 without geometric stiffness
};

template <class R>
struct SpringTerms {
  Vector3<R> force;     // on the first particle; the second feels the opposite
  Symmetric3<R> block;  // H: +H on both diagonals, -H between
  R length;             // [m] now
};

// A spring from a to b: force kappa (|d| - l) d/|d|, d = b - a. Its block is (h^2 + h beta) kappa D plus the
// geometric stiffness h^2 kappa max(0, 1 - l/|d|) (I - D): a stretched spring also resists turning.
template <class R>
RINGLET_KERNEL SpringTerms<R> spring(Vector3<R> d, R rest_length, R kappa,
                                     const ImplicitWeights<R>& weights) {
  const R now = length(d);
  const R inverse = inverse_or_zero(now, shortest_direction<R>());
  const Vector3<R> direction = inverse * d;
  const R slack = max(R(0), fnma(rest_length, inverse, R(1)));
  const R turning = select(inverse > R(0), weights.geometric * kappa * slack, R(0));
  const Vector3<R> along = fma(weights.total, kappa, -turning) * direction;
  return {(kappa * (now - rest_length)) * direction,
          {fma(along.x, direction.x, turning), along.x * direction.y, along.x * direction.z,
           fma(along.y, direction.y, turning), along.y * direction.z, fma(along.z, direction.z, turning)},
          now};
}

// A coupling to the ghost that is stiff in one direction: acceleration of its one particle, and K = stiffness
// d d^T; the matrix takes (h^2 + h beta) K, the right-hand side (h^2 + h beta) K w with w the ghost's
// velocity.
template <class R>
struct GhostTerms {
  Vector3<R> force, direction;
  R stiffness;
};

// Integrity, a spring of rest length 0 to the preloaded ghost y', with the stiffness that the papers print,
// kappa D. (The exact one, kappa I, needs no direction: add_own_terms has it.)
template <class R>
RINGLET_KERNEL GhostTerms<R> directed_integrity(Vector3<R> to_ghost, R kappa) {
  const R inverse = inverse_or_zero(length(to_ghost), shortest_direction<R>());
  return {kappa * to_ghost, inverse * to_ghost, kappa};
}

// Angular: magnitude kappa l theta towards the ghost y (without preload), theta the angle at the previous
// particle p between y - p and x - p, l the segment's rest length. Stiffness kappa l / |x - p| D towards the
// ghost (a segment under a tenth of its rest length counts as that tenth), or the papers' kappa D.
template <class R>
RINGLET_KERNEL GhostTerms<R> angular(Vector3<R> to_ghost, Vector3<R> segment, R segment_length, R rest_length,
                                     R kappa, bool consistent) {
  // cross(y - p, x - p) = cross(y - x, x - p): exact where the ghost is near.
  const R theta = angle_between(length(cross(to_ghost, segment)), dot(to_ghost + segment, segment));
  const R inverse = inverse_or_zero(length(to_ghost), shortest_direction<R>());
  const Vector3<R> direction = inverse * to_ghost;
  const R reach = kappa * rest_length;
  R tangent = kappa;
  if (consistent) {
    const R at_least = max(segment_length, R(Scalar<R>(0.1)) * rest_length);
    tangent = reach * inverse_or_zero(at_least, shortest_direction<R>());
  }
  return {(reach * theta) * direction, direction, tangent};
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
