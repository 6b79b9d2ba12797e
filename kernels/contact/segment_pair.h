// Two segments over a stretch of time: where they touch, and whether one has passed through the other.
//
// Particles move on straight lines from their place at the start to their place at the end. The volume of the
// tetrahedron (a0, a1, b0, b1), times six
//
//   V(t) = (b0 - a0) . ((a1 - a0) x (b1 - b0))
//
// changes sign where the lines of the segments meet; it is a cubic in t, and does not change where all moves
// alike, by any affine motion. The segments have crossed where V has another sign at the end, and at V's root
// the lines meet within both segments. Then the contact's normal is the common perpendicular of that time on
// a's side of the start, held between the very points that met. Where they have not crossed it is the
// direction between the closest points at the end. (Bridson, Fedkiw, Anderson 2002, section 7, for lines.)
//
// A crossing and a return within one stretch counts as none, and so does one that is undone by going round a
// tip.
#pragma once
#include "kernels/backend/lane_bits.h"
#include "kernels/backend/vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// One segment at one time.
template <class R>
struct Segment {
  Vector3<R> begin, end;

  RINGLET_KERNEL Vector3<R> along() const { return end - begin; }
  RINGLET_KERNEL Vector3<R> at(R s) const { return fma(s, end - begin, begin); }
};

template <class R>
struct SegmentPair {
  Segment<R> a_start, b_start, a, b;  // the latter two at the end
};

template <class R>
struct PairContact {
  Mask<R> crossed;
  R s, u;             // places of the contact on a and b, in [0, 1]
  R later;            // share of the stretch that was left when they met: 1 where they have not crossed
  Vector3<R> normal;  // unit length, from b to a; 0 where there is none
  R distance;         // along the normal, at the end; negative beyond a crossing [m]
};

template <class R>
RINGLET_KERNEL R clamp_unit(R a) {
  return min(max(a, R(0)), R(1));
}

// Zero counts as positive.
template <class R>
RINGLET_KERNEL Mask<R> differ_in_sign(R a, R b) {
  const Mask<R> one = a < R(0), other = b < R(0);
  return (one | other) & !(one & other);
}

// V at one time.
template <class R>
RINGLET_KERNEL R tetrahedron_volume(const Segment<R>& a, const Segment<R>& b) {
  return dot(b.begin - a.begin, cross(a.along(), b.along()));
}

// The products that all questions about two lines come down to. p: from a's begin to b's.
template <class R>
struct LineProducts {
  R uu, ww, uw, up, wp, determinant;

  RINGLET_KERNEL LineProducts(Vector3<R> u, Vector3<R> w, Vector3<R> p)
      : uu(dot(u, u)), ww(dot(w, w)), uw(dot(u, w)), up(dot(u, p)), wp(dot(w, p)) {
    const Vector3<R> n = cross(u, w);
    determinant = dot(n, n);  // uu ww - uw^2, without its cancellation
  }
  RINGLET_KERNEL R s() const { return fnma(uw, wp, ww * up) * inverse(); }
  RINGLET_KERNEL R u() const { return fnma(uu, wp, uw * up) * inverse(); }
  RINGLET_KERNEL R inverse() const { return inverse_or_zero(determinant, R(Scalar<R>(1e-36))); }
};

template <class R>
struct ClosestPlaces {
  R s, u;
};

// Closest points of two segments that are not parallel; of degenerate ones too.
template <class R>
RINGLET_KERNEL ClosestPlaces<R> closest_places(const LineProducts<R>& p) {
  const R nothing = R(Scalar<R>(1e-36));
  R s = clamp_unit(p.s());
  const R u = clamp_unit(fma(s, p.uw, -p.wp) * inverse_or_zero(p.ww, nothing));
  s = clamp_unit(fma(u, p.uw, p.up) * inverse_or_zero(p.uu, nothing));
  return {s, u};
}

// Middle of the stretch over which two parallel segments lie side by side, so that a contact there turns
// neither; the closest ends where they do not.
template <class R>
RINGLET_KERNEL ClosestPlaces<R> parallel_places(const LineProducts<R>& p) {
  const R nothing = R(Scalar<R>(1e-36)), half = R(Scalar<R>(0.5));
  const R per_uu = inverse_or_zero(p.uu, nothing);
  const R one = clamp_unit(p.up * per_uu), other = clamp_unit((p.up + p.uw) * per_uu);
  const R s = half * (one + other);
  return {s, clamp_unit(fma(s, p.uw, -p.wp) * inverse_or_zero(p.ww, nothing))};
}

// The root of V in (0, 1), where V(0) and V(1) differ in sign: Newton's steps within a bracket.
template <class R>
RINGLET_KERNEL R crossing_time(const SegmentPair<R>& pair) {
  const Vector3<R> p = pair.b_start.begin - pair.a_start.begin, u = pair.a_start.along(),
                   w = pair.b_start.along();
  const Vector3<R> dp = pair.b.begin - pair.a.begin - p, du = pair.a.along() - u, dw = pair.b.along() - w;
  const Vector3<R> uw = cross(u, w), mixed = cross(du, w) + cross(u, dw), dudw = cross(du, dw);
  const R c0 = dot(p, uw), c1 = dot(dp, uw) + dot(p, mixed), c2 = dot(dp, mixed) + dot(p, dudw),
          c3 = dot(dp, dudw);
  const R half = R(Scalar<R>(0.5));
  R low = R(0), high = R(1), t = half;
  constexpr int kIterations = 7;
  for (int k = 0; k < kIterations; ++k) {
    const R value = fma(fma(fma(c3, t, c2), t, c1), t, c0);
    const R slope = fma(fma(R(3) * c3, t, R(2) * c2), t, c1);
    const Mask<R> before = !differ_in_sign(value, c0);
    low = select(before, t, low), high = select(before, high, t);
    const R newton = t - value / select(abs(slope) > R(Scalar<R>(1e-36)), slope, R(Scalar<R>(1e-36)));
    t = select((low <= newton) & (newton <= high), newton, half * (low + high));
  }
  return t;
}

// How far beyond a segment's ends [of its length] a crossing still counts: joints do not leak.
template <class R>
RINGLET_KERNEL R joint_tolerance() {
  return R(Scalar<R>(1e-3));
}
// Squared sine of the angle between segments that count as parallel.
template <class R>
RINGLET_KERNEL R parallel_sine2() {
  return R(Scalar<R>(1e-6));
}

template <class R>
RINGLET_KERNEL Mask<R> within_unit(R at) {
  return (R(0) - joint_tolerance<R>() < at) & (at < R(1) + joint_tolerance<R>());
}

template <class R>
RINGLET_KERNEL Segment<R> between(const Segment<R>& start, const Segment<R>& end, R t) {
  return {fma(t, end.begin - start.begin, start.begin), fma(t, end.end - start.end, start.end)};
}

template <class R>
RINGLET_KERNEL void set_contact(Mask<R> where, const PairContact<R>& from, PairContact<R>& to) {
  to.s = select(where, from.s, to.s), to.u = select(where, from.u, to.u);
  to.later = select(where, from.later, to.later);
  to.normal = select(where, from.normal, to.normal);
  to.distance = select(where, from.distance, to.distance);
}

// The contact of a pair whose V changed sign, where its segments met.
template <class R>
RINGLET_KERNEL PairContact<R> crossing_contact(const SegmentPair<R>& pair, R volume_at_start) {
  PairContact<R> contact;
  const R t = crossing_time(pair);
  const Segment<R> a = between(pair.a_start, pair.a, t), b = between(pair.b_start, pair.b, t);
  const LineProducts<R> products(a.along(), b.along(), b.begin - a.begin);
  const R s = products.s(), u = products.u();
  contact.crossed = within_unit(s) & within_unit(u);
  contact.s = clamp_unit(s), contact.u = clamp_unit(u);
  contact.later = R(1) - t;
  const Vector3<R> across = cross(a.along(), b.along());
  const R scale = inverse_or_zero(sqrt(products.determinant), R(Scalar<R>(1e-18)));
  contact.normal = select(volume_at_start < R(0), scale, R(0) - scale) * across;
  contact.distance = dot(contact.normal, pair.a.at(contact.s) - pair.b.at(contact.u));
  return contact;
}

// Of parallel segments: V says nothing. They have crossed where the distance between their lines has turned
// about and was within `reach` on the way.
template <class R>
RINGLET_KERNEL PairContact<R> parallel_contact(const SegmentPair<R>& pair, const LineProducts<R>& products,
                                               R reach) {
  PairContact<R> contact;
  const ClosestPlaces<R> at = parallel_places(products);
  contact.s = at.s, contact.u = at.u;
  const Vector3<R> along = pair.a.along();
  const R per_uu = inverse_or_zero(products.uu, R(Scalar<R>(1e-36)));
  const auto across = [&](Vector3<R> d) { return fma(R(0) - dot(d, along) * per_uu, along, d); };
  const Vector3<R> end = pair.a.at(at.s) - pair.b.at(at.u);
  const Vector3<R> first = across(pair.a_start.at(at.s) - pair.b_start.at(at.u)), last = across(end);
  const Vector3<R> way = last - first;
  const R t = clamp_unit((R(0) - dot(first, way)) * inverse_or_zero(dot(way, way), R(Scalar<R>(1e-36))));
  const Vector3<R> nearest = fma(t, way, first);
  const Vector3<R> apart = end - last;  // along the segments, 0 where they lie side by side
  contact.crossed = (dot(first, last) < R(0)) & (dot(nearest, nearest) + dot(apart, apart) < reach * reach);
  contact.later = select(contact.crossed, R(1) - t, R(1));
  const Vector3<R> direction = select(contact.crossed, first, end);
  contact.normal = inverse_or_zero(length(direction), R(Scalar<R>(1e-12))) * direction;
  contact.distance = dot(contact.normal, end);
  return contact;
}

// The contact of a pair whose side is known from before: through one another as they now lie, or not.
template <class R>
RINGLET_KERNEL PairContact<R> standing_contact(const SegmentPair<R>& pair, const LineProducts<R>& products,
                                               R side) {
  PairContact<R> contact;
  const R s = products.s(), u = products.u();
  contact.crossed = within_unit(s) & within_unit(u);
  contact.s = clamp_unit(s), contact.u = clamp_unit(u);
  contact.later = R(1);
  const R scale = inverse_or_zero(sqrt(products.determinant), R(Scalar<R>(1e-18)));
  contact.normal = select(side < R(0), scale, R(0) - scale) * cross(pair.a.along(), pair.b.along());
  contact.distance = dot(contact.normal, pair.a.at(contact.s) - pair.b.at(contact.u));
  return contact;
}

// `reach`: sum of the radii [m]. `side`: the sign of V when the segments last were on their own sides, where
// that was before the start; 0 where they were so at the start.
template <class R>
RINGLET_FUNCTION PairContact<R> find_contact(const SegmentPair<R>& pair, R reach, R side) {
  const Mask<R> standing = (side < R(0)) | (side > R(0));
  const R first = select(standing, side, tetrahedron_volume(pair.a_start, pair.b_start)),
          last = tetrahedron_volume(pair.a, pair.b);
  const LineProducts<R> products(pair.a.along(), pair.b.along(), pair.b.begin - pair.a.begin);
  const Mask<R> parallel = products.determinant <= parallel_sine2<R>() * (products.uu * products.ww);

  PairContact<R> contact;
  const ClosestPlaces<R> at = closest_places(products);
  const Vector3<R> apart = pair.a.at(at.s) - pair.b.at(at.u);
  contact.s = at.s, contact.u = at.u, contact.later = R(1);
  contact.distance = length(apart);
  contact.crossed = R(0) > R(1);
  const Mask<R> changed = differ_in_sign(first, last);
  // Between the insides of two segments that stay on their sides, the normal is known however near they are.
  const Mask<R> inside = (R(0) < at.s) & (at.s < R(1)) & (R(0) < at.u) & (at.u < R(1)) & !changed;
  const R per_sine = inverse_or_zero(sqrt(products.determinant), R(Scalar<R>(1e-18)));
  contact.normal =
      select(inside, select(first < R(0), per_sine, -per_sine) * cross(pair.a.along(), pair.b.along()),
             inverse_or_zero(contact.distance, R(Scalar<R>(1e-12))) * apart);

  const auto take = [&](Mask<R> where, const PairContact<R>& crossing) {
    const Mask<R> crossed = crossing.crossed & where;
    contact.crossed = contact.crossed | crossed;
    set_contact(crossed, crossing, contact);
  };
  const Mask<R> turned = changed & !parallel;
  if (some(turned & !standing)) take(turned & !standing, crossing_contact(pair, first));
  if (some(turned & standing)) take(turned & standing, standing_contact(pair, products, first));
  if (some(parallel)) {
    const PairContact<R> beside = parallel_contact(pair, products, reach);
    contact.crossed = contact.crossed | (beside.crossed & parallel & !standing);
    set_contact(parallel, beside, contact);
    // Of these nobody can tell on which side they are.
    contact.normal = select(parallel & standing, zero3<R>(), contact.normal);
  }
  return contact;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
