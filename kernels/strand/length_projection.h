// Inextensibility: positions moved to the rest segment lengths by the least mass-weighted displacement
// (physics.md section 4). Per strand, Newton iterations on the multipliers lambda of
//
//   C_k = |x_{k+1} - x_k| - l_k = 0,   (J W J^T) lambda = C,   x -= W J^T lambda
//
// a tridiagonal system (Thomas algorithm). W is 1 for a free particle, 0 for a prescribed one, and for a
// particle in contact with normal n it is I - (1 - slip) n n^T: it gives way along the surface, so that
// lengths and contacts can both hold. Displacements are internal forces' work: linear momentum of a free
// strand is kept.
#pragma once
#include "kernels/backend/vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// One strand's segments as the projection sees them; components `stride` apart, particles 3 `stride`.
template <class R>
struct ProjectedStrand {
  Scalar<R>* position;           // [particles][3] moved in place [m]
  Scalar<R>* velocity;           // [particles][3] corrected by the displacement over h [m/s]
  R per_h;                       // 1 / h [1/s]
  const Scalar<R>* rest_length;  // [particles][3], the first is the segment's; global layout
  int rest_stride;               // between components of rest_length
  const Scalar<R>* normal;       // [particles][3] contact normals, 0 where there is none; null: no contacts
  Scalar<R>* scratch;            // [particles][kProjectionReals]
  int stride;
  int particles;  // rows of the batch
  R count;        // particles of each lane
  int clamped;
};
// Per segment: direction, link to the segment before, multiplier, inverse of its pivot.
inline constexpr int kProjectionReals = 6;

// How much of its freedom a particle in contact keeps along the normal: little, so that the system stays
// regular where a segment stands straight on the surface.
template <class R>
RINGLET_KERNEL R contact_slip() {
  return R(Scalar<R>(0.05));
}

// W a
template <class R>
RINGLET_KERNEL Vector3<R> mobility(const ProjectedStrand<R>& s, int particle, Vector3<R> a) {
  if (particle < s.clamped) return zero3<R>();
  if (!s.normal) return a;
  const Vector3<R> n = load3<R>(s.normal + 3 * particle * s.stride, s.stride);
  return fma((contact_slip<R>() - R(1)) * dot(n, a), n, a);
}

// Segments shorter than this [m], a fiftieth of a hair's width, are left to the springs: they have no
// direction to speak of.
template <class R>
RINGLET_KERNEL R shortest_held() {
  return R(Scalar<R>(1e-6));
}

// Eliminates the tridiagonal system from the root on, into the scratch, and returns the largest edge strain
// |C_k| / l_k found.
template <class R>
RINGLET_FUNCTION R eliminate_lengths(const ProjectedStrand<R>& s) {
  const R nothing = shortest_direction<R>();
  R strain = R(0), reduced = R(0), inverse = R(0);
  Vector3<R> here = load3<R>(s.position, s.stride), previous = zero3<R>();
  for (int k = 0; k + 1 < s.particles; ++k) {
    Scalar<R>* row = s.scratch + kProjectionReals * k * s.stride;
    const Vector3<R> next = load3<R>(s.position + 3 * (k + 1) * s.stride, s.stride);
    const R rest = load<R>(s.rest_length + 3 * k * s.rest_stride), now = length(next - here);
    const Mask<R> held = (R(Scalar<R>(k + 1)) < s.count) & (rest > shortest_held<R>());
    strain = max(strain, select(held, abs(fma(now, inverse_or_zero(rest, nothing), R(-1))), R(0)));

    Vector3<R> direction = inverse_or_zero(now, nothing) * (next - here);
    Vector3<R> moved_here = mobility(s, k, direction);
    const R own = dot(direction, moved_here) + dot(direction, mobility(s, k + 1, direction));
    const Mask<R> solvable = held & (own > R(Scalar<R>(1e-6)));
    direction = select(solvable, direction, zero3<R>());
    const R link = select(solvable, -dot(previous, moved_here), R(0));  // to the segment before
    const R carry = link * inverse;
    inverse = select(solvable, R(1) / select(solvable, fnma(link, carry, own), R(1)), R(0));
    reduced = fnma(link, reduced, now - rest) * inverse;
    store3<R>(row, s.stride, direction);
    store(row + 3 * s.stride, carry);
    store(row + 4 * s.stride, reduced);
    store(row + 5 * s.stride, inverse);
    previous = direction;
    here = next;
  }
  return strain;
}

// The multipliers from the tip back, moving the particles of the `active` lanes as they appear.
template <class R>
RINGLET_FUNCTION void apply_lengths(const ProjectedStrand<R>& s, Mask<R> active) {
  const auto move = [&](int particle, Vector3<R> pull) {
    Scalar<R>*x = s.position + 3 * particle * s.stride, *v = s.velocity + 3 * particle * s.stride;
    const Vector3<R> moved = select(active, mobility(s, particle, pull), zero3<R>());
    store3<R>(x, s.stride, load3<R>(x, s.stride) + moved);
    store3<R>(v, s.stride, fma(s.per_h, moved, load3<R>(v, s.stride)));
  };
  R multiplier = R(0), carry = R(0);
  Vector3<R> pull_after = zero3<R>();  // lambda d of the segment after
  for (int k = s.particles - 2; k >= 0; --k) {
    const Scalar<R>* row = s.scratch + kProjectionReals * k * s.stride;
    multiplier = fnma(carry, multiplier, load<R>(row + 4 * s.stride));
    carry = load<R>(row + 3 * s.stride);  // this segment's link, for the one before it
    const Vector3<R> pull = multiplier * load3<R>(row, s.stride);
    move(k + 1, pull_after - pull);
    pull_after = pull;
  }
  move(0, pull_after);
}

template <class R>
struct ProjectionResult {
  R strain;      // largest left
  R iterations;  // taken
};

// The last resort, for the `late` lanes: every segment at its length in the direction that it has, one after
// the other from the root on. Lengths hold however far they were off. It is not the least displacement and
// takes momentum from the strand, so it is for what the projection does not bring back.
template <class R>
RINGLET_FUNCTION void lay_out_lengths(const ProjectedStrand<R>& s, Mask<R> late) {
  const R nothing = shortest_direction<R>();
  Vector3<R> here = load3<R>(s.position, s.stride), moved = zero3<R>();
  for (int k = 0; k + 1 < s.particles; ++k) {
    Scalar<R>*x = s.position + 3 * (k + 1) * s.stride, *v = s.velocity + 3 * (k + 1) * s.stride;
    const Vector3<R> next = load3<R>(x, s.stride), segment = next - here;
    const R rest = load<R>(s.rest_length + 3 * k * s.rest_stride), now = length(segment);
    const Mask<R> held =
        late & (R(Scalar<R>(k + 1)) < s.count) & (rest > shortest_held<R>()) & (now > nothing);
    const R change = select(held, fma(rest, inverse_or_zero(now, nothing), R(-1)), R(0));
    moved = k + 1 < s.clamped ? zero3<R>() : fma(change, segment, moved);
    moved = select(R(Scalar<R>(k + 1)) < s.count, moved, zero3<R>());
    store3<R>(x, s.stride, next + moved);
    store3<R>(v, s.stride, fma(s.per_h, moved, load3<R>(v, s.stride)));
    here = next;
  }
}

// Newton until every lane's strain is within the tolerance, or `max_iterations`. A lane that is done stays as
// it is, whatever its neighbours need: results do not depend on which strands share a pack.
template <class R>
RINGLET_KERNEL ProjectionResult<R> project_lengths(const ProjectedStrand<R>& s, R tolerance,
                                                   int max_iterations, Mask<R> active) {
  ProjectionResult<R> result{eliminate_lengths(s), R(0)};
  for (int i = 0; i < max_iterations; ++i) {
    const Mask<R> open = (result.strain > tolerance) & active;
    if (!any(open)) break;
    apply_lengths(s, open);
    result.strain = eliminate_lengths(s);
    result.iterations = result.iterations + select(open, R(1), R(0));
  }
  return result;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
