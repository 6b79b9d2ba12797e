// Bounds of what is long and thin: tubes along an axis of the scene, slanted as their contents are.
//
// Hair that lies together runs alike. A box about a piece of it is as thick as the piece is slanted; a tube
// is as thick as the piece, and two tubes are told apart by how far their middles are from one another over
// the stretch of the axis that they share, however they are slanted.
#pragma once
#include <initializer_list>

#include "kernels/backend/vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Holds what is at `at` in [low, high] along the axis and within half[k] of middle[k] + at slope[k] along the
// k-th axis after it. For as many tubes as R has lanes. [m]
template <class R>
struct Tube {
  R low, high;
  R middle[2], slope[2], half[2];
  static constexpr int kNumbers = 8;

  // About the segments between `begin` and `end` of `kTimes` moments, and what moves from one to the next in
  // a straight line, with `margin` about it. Along `axis`; a box where that is not the way they run.
  template <int kTimes>
  RINGLET_KERNEL static Tube about(const Vector3<R> (&begin)[kTimes], const Vector3<R> (&end)[kTimes],
                                   R margin, int axis) {
    const R half(Scalar<R>(0.5));
    const auto along = [=](const Vector3<R>& at, int k) { return (&at.x)[(axis + k) % 3]; };
    const Vector3<R> first = half * (begin[0] + begin[kTimes - 1]), last = half * (end[0] + end[kTimes - 1]),
                     way = last - first, centre = half * (first + last);
    const R w = along(way, 0), u = along(way, 1), v = along(way, 2);
    const Mask<R> across = w * w <= R(Scalar<R>(0.25)) * (u * u + v * v);
    const R per_way = select(across, R(0), R(1) / select(across, R(1), w));
    Tube tube;
    tube.slope[0] = u * per_way, tube.slope[1] = v * per_way;
    // What is within the margin of a slanted line is farther from it along the other axes.
    const R slant = sqrt(fma(tube.slope[0], tube.slope[0], fma(tube.slope[1], tube.slope[1], R(1))));
    tube.low = tube.high = along(begin[0], 0);
    for (int k = 0; k < 2; ++k) {
      tube.middle[k] = fnma(tube.slope[k], along(centre, 0), along(centre, 1 + k));
      tube.half[k] = R(0);
    }
    for (int time = 0; time < kTimes; ++time)
      for (const Vector3<R>* corner : {&begin[time], &end[time]}) {
        const R at = along(*corner, 0);
        tube.low = min(tube.low, at), tube.high = max(tube.high, at);
        for (int k = 0; k < 2; ++k)
          tube.half[k] = max(tube.half[k], abs(along(*corner, 1 + k) - tube.middle_at(k, at)));
      }
    tube.low = tube.low - margin, tube.high = tube.high + margin;
    for (int k = 0; k < 2; ++k) tube.half[k] = fma(margin, slant, tube.half[k]);
    return tube;
  }

  RINGLET_KERNEL R middle_at(int k, R at) const { return fma(slope[k], at, middle[k]); }

  // Whether they may share a place.
  RINGLET_KERNEL Mask<R> meets(const Tube& other) const {
    const R from = max(low, other.low), to = min(high, other.high);
    return (from <= to) & meets_across(0, other, from, to) & meets_across(1, other, from, to);
  }

 private:
  RINGLET_KERNEL Mask<R> meets_across(int k, const Tube& other, R from, R to) const {
    const R apart = middle[k] - other.middle[k], widening = slope[k] - other.slope[k],
            near = half[k] + other.half[k];
    const R first = fma(widening, from, apart), last = fma(widening, to, apart);
    return (min(first, last) <= near) & (R(0) - near <= max(first, last));
  }
};

// One tube for all lanes.
template <class R>
RINGLET_KERNEL Tube<R> same_tube(const Tube<Scalar<R>>& one) {
  return {R(one.low),
          R(one.high),
          {R(one.middle[0]), R(one.middle[1])},
          {R(one.slope[0]), R(one.slope[1])},
          {R(one.half[0]), R(one.half[1])}};
}

// In memory the numbers of tubes lie `stride` apart, in the order in which this visits them as visit(k,
// number).
template <class R, class Visit>
RINGLET_KERNEL void for_numbers(const Tube<R>& tube, const Visit& visit) {
  visit(0, tube.low), visit(1, tube.high);
  for (int k = 0; k < 2; ++k)
    visit(2 + k, tube.middle[k]), visit(4 + k, tube.slope[k]), visit(6 + k, tube.half[k]);
}
template <class R>
RINGLET_KERNEL Tube<R> load_tube(const Scalar<R>* numbers, int stride) {
  const auto number = [=](int k) { return load<R>(numbers + k * stride); };
  return {number(0), number(1), {number(2), number(3)}, {number(4), number(5)}, {number(6), number(7)}};
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
