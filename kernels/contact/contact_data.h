// The plain arrays that the contacts of hair against hair work on.
#pragma once
#include "kernels/backend/atomic.h"
#include "kernels/backend/lane_bits.h"
#include "kernels/contact/contact_step.h"
#include "kernels/contact/segment_pair.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Particles are numbered row * kLanes + lane, as a component of the state is: the next along the strand is
// kLanes further. A segment has the number of the particle that it begins at.
template <class T>
struct Place {
  T x, y, z;  // against an origin that all share, at the same time [m]
  T extra;    // start: the particle's freedom, 1 or 0 where it is prescribed; end: its radius [m]
};

template <class T>
struct HairPlaces {
  const Place<T>*start, *end;
};

template <class R>
RINGLET_KERNEL Vector3<R> load_lanes(const Scalar<R> (&lanes)[3][Traits<R>::kWidth]) {
  return {load<R>(lanes[0]), load<R>(lanes[1]), load<R>(lanes[2])};
}

// The places of a particle for each lane.
template <class R>
RINGLET_KERNEL Vector3<R> gather(const Place<Scalar<R>>* places, const std::int32_t* particles,
                                 std::int32_t offset) {
  alignas(64) Scalar<R> lanes[3][Traits<R>::kWidth];
  for (int lane = 0; lane < Traits<R>::kWidth; ++lane) {
    const Place<Scalar<R>>& place = places[particles[lane] + offset];
    lanes[0][lane] = place.x, lanes[1][lane] = place.y, lanes[2][lane] = place.z;
  }
  return load_lanes<R>(lanes);
}
template <class R>
RINGLET_KERNEL R gather_extra(const Place<Scalar<R>>* places, const std::int32_t* particles,
                              std::int32_t offset) {
  alignas(64) Scalar<R> lanes[Traits<R>::kWidth];
  for (int lane = 0; lane < Traits<R>::kWidth; ++lane) lanes[lane] = places[particles[lane] + offset].extra;
  return load<R>(lanes);
}

template <class R>
RINGLET_KERNEL Segment<R> gather_segment(const Place<Scalar<R>>* places, const std::int32_t* segments) {
  return {gather<R>(places, segments, 0), gather<R>(places, segments, kLanes)};
}

// The pairs of as many lanes.
template <class R>
RINGLET_KERNEL SegmentPair<R> gather_pair(const HairPlaces<Scalar<R>>& places, const std::int32_t* a,
                                          const std::int32_t* b) {
  return {gather_segment<R>(places.start, a), gather_segment<R>(places.start, b),
          gather_segment<R>(places.end, a), gather_segment<R>(places.end, b)};
}

// An order of segments that does not depend on the strands' order in the groom: by where they are.
template <class T>
RINGLET_KERNEL bool comes_first(const Place<T>* places, std::int32_t one, std::int32_t other) {
  for (int offset = 0; offset <= kLanes; offset += kLanes) {
    const Place<T>&p = places[one + offset], &q = places[other + offset];
    if (p.x != q.x) return p.x < q.x;
    if (p.y != q.y) return p.y < q.y;
    if (p.z != q.z) return p.z < q.z;
  }
  return one < other;  // in the very same place
}

// Rounded so that sums are exact, and so the same in any order: to multiples of 2^-36, which leaves room for
// a sum of 2^16.
RINGLET_KERNEL double summable(double a) {
  constexpr double kShift = 1.5 * 65536.0;  // 1.5 * 2^(52 - 36)
  return (a + kShift) - kShift;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
