// The plain arrays that the contacts of hair against hair work on.
//
// Particles are numbered strand by strand, strands in an order that is that of their roots and not that of
// the groom: no result depends on how a file lists them. A segment has the number of the particle that it
// begins at.
#pragma once
#include "kernels/backend/atomic.h"
#include "kernels/backend/lane_bits.h"
#include "kernels/backend/quads.h"
#include "kernels/contact/hair_contacts.h"
#include "kernels/contact/segment_pair.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
struct alignas(4 * sizeof(T)) Place {
  T x, y, z;  // against an origin that all share, at the same time [m]
  T extra;    // start: the particle's freedom, 1 or 0 where it is prescribed; end: its radius [m]
};

template <class T>
struct HairPlaces {
  const Place<T>*start, *end;
  const std::int32_t* strand;  // of the segment that begins at a particle, -1 where none does
  std::int32_t particles;

  RINGLET_KERNEL bool on_one_strand(std::int32_t segment, std::int32_t other) const {
    return other >= 0 && other < particles && strand[other] == strand[segment];
  }
};

template <class R>
RINGLET_KERNEL Vector3<R> vector_of(const Quad<R>& quad) {
  return {quad.x, quad.y, quad.z};
}
template <class R>
RINGLET_KERNEL Vector3<R> vector_of(const Place<R>& place) {
  return {place.x, place.y, place.z};
}

template <class T>
RINGLET_KERNEL Vector3<float> float_vector(const Place<T>& place) {
  return {static_cast<float>(place.x), static_cast<float>(place.y), static_cast<float>(place.z)};
}

template <class R>
struct GatheredSegment {
  Segment<R> places;
  R begin_extra, end_extra;

  RINGLET_KERNEL R extra_at(R s) const { return fma(s, end_extra - begin_extra, begin_extra); }
};

// A segment for each lane.
template <class R>
RINGLET_KERNEL GatheredSegment<R> gather_segment(const Place<Scalar<R>>* places,
                                                 const std::int32_t* segments) {
  const Quad<R> begin = gather_quads<R>(&places[0].x, segments),
                end = gather_quads<R>(&places[1].x, segments);
  return {{vector_of(begin), vector_of(end)}, begin.w, end.w};
}

// The same segment for all lanes.
template <class R>
RINGLET_KERNEL Segment<R> segment_at(const Place<Scalar<R>>* places, std::int32_t segment) {
  const Place<Scalar<R>>&begin = places[segment], &end = places[segment + 1];
  return {{R(begin.x), R(begin.y), R(begin.z)}, {R(end.x), R(end.y), R(end.z)}};
}

// The pairs of as many lanes, and what goes with their ends.
template <class R>
struct PackOfPairs {
  using T = Scalar<R>;
  GatheredSegment<R> a_start, b_start, a, b;

  RINGLET_KERNEL PackOfPairs(const HairPlaces<T>& places, const std::int32_t* one, const std::int32_t* other)
      : a_start(gather_segment<R>(places.start, one)),
        b_start(gather_segment<R>(places.start, other)),
        a(gather_segment<R>(places.end, one)),
        b(gather_segment<R>(places.end, other)) {}
  RINGLET_KERNEL PackOfPairs(const GatheredSegment<R>& one_start, const GatheredSegment<R>& other_start,
                             const GatheredSegment<R>& one, const GatheredSegment<R>& other)
      : a_start(one_start), b_start(other_start), a(one), b(other) {}
  // Sum of the radii where they are largest [m].
  RINGLET_KERNEL R largest_reach() const {
    return max(a.begin_extra, a.end_extra) + max(b.begin_extra, b.end_extra);
  }
  RINGLET_KERNEL SegmentPair<R> places() const {
    return {a_start.places, b_start.places, a.places, b.places};
  }
};

// Segments that have not crossed are looked at where they are nearer at the end than this many sums of radii:
// contacts may move them that far in an application.
inline constexpr double kNear = 3;

template <class T>
RINGLET_KERNEL T thickest(const Place<T>* end, std::int32_t segment) {
  return max(end[segment].extra, end[segment + 1].extra);
}

// Rounded so that sums are exact, and so the same in any order: to multiples of 2^-36, which leaves room for
// a sum of 2^16.
template <class R>
RINGLET_KERNEL R summable(const R& a) {
  static_assert(sizeof(Scalar<R>) == sizeof(double));
  const R shift(1.5 * 65536.0);  // 1.5 * 2^(52 - 36)
  return (a + shift) - shift;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
