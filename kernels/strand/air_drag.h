// Drag of the air on a segment, per unit mass (physics.md section 1: a linear density makes it so). With u
// the air's velocity relative to the segment, split along (t) and across (n) it,
//
//   a = A (w - v),  A = (c_t1 + c_t2 |u_t|) t t^T + (c_n1 + c_n2 |u_n|) (I - t t^T)
//
// w the air's velocity. A is frozen at the step's start and positive semi-definite, v is the particle's
// velocity at the step's end: drag takes no particle past the speed of the air, however long the step.
// A segment's drag acts on each of its ends, by its share of that particle's length.
#pragma once
#include "kernels/backend/vector.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class R>
struct DragTerms {
  Symmetric3<R> block;  // A [1/s]
  Vector3<R> pull;      // A w [m/s^2]
};

template <class R>
RINGLET_KERNEL DragTerms<R> no_drag() {
  return {zero_symmetric<R>(), zero3<R>()};
}

// `segment` from one end to the other, of this length; `velocity` its mean velocity at the step's start.
template <class R>
RINGLET_KERNEL DragTerms<R> segment_drag(const Air<Scalar<R>>& air, Vector3<R> wind, Vector3<R> segment,
                                         R segment_length, Vector3<R> velocity) {
  const Vector3<R> t = inverse_or_zero(segment_length, shortest_direction<R>()) * segment;
  const Vector3<R> u = wind - velocity;
  const R along = dot(t, u);
  const R tangential = fma(R(air.tangential[1]), abs(along), R(air.tangential[0]));
  const R normal = fma(R(air.normal[1]), length(fma(-along, t, u)), R(air.normal[0]));
  DragTerms<R> terms{zero_symmetric<R>(), zero3<R>()};
  terms.block.add_identity(normal);
  terms.block.add_outer(tangential - normal, t);
  terms.pull = fma((tangential - normal) * dot(t, wind), t, normal * wind);
  return terms;
}

// The drag on the particle between two segments of these rest lengths, 0 for one that does not exist.
template <class R>
RINGLET_KERNEL DragTerms<R> particle_drag(const DragTerms<R>& before, R length_before,
                                          const DragTerms<R>& after, R length_after) {
  const R per_length = inverse_or_zero(length_before + length_after, R(0));
  const R a = length_before * per_length, b = length_after * per_length;
  const auto mean = [&](R x, R y) { return fma(a, x, b * y); };
  const Symmetric3<R>&p = before.block, &q = after.block;
  return {{mean(p.xx, q.xx), mean(p.xy, q.xy), mean(p.xz, q.xz), mean(p.yy, q.yy), mean(p.yz, q.yz),
           mean(p.zz, q.zz)},
          fma(a, before.pull, b * after.pull)};
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
