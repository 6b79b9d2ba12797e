// Segments that are through one another still when an application ends: which side they belong on is kept, or
// hair that did not get back at once would have got through for good.
#pragma once
#include "kernels/contact/pair_list.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Looks at the pairs of an application, with what moved after it: those through one another are written, each
// as the two segments that now cut through one another. For a pack of pairs.
template <class R>
struct FindStanding {
  using T = Scalar<R>;
  static constexpr int kWidth = Traits<R>::kWidth;
  ContactPairs<T> pairs;
  HairPlaces<T> places;
  T deepest;  // [m]
  PairKey key;
  std::uint64_t* found;
  std::int32_t* count;
  std::int32_t room;

  RINGLET_FUNCTION void operator()(std::int32_t pack) const {
    const std::int32_t first = pack * kWidth;
    fetch_ahead<R>(pairs, places, first);
    const PackOfPairs<R> gathered(places, pairs.a + first, pairs.b + first);
    const SegmentPair<R> pair = gathered.places();
    const R side = load_sides<R>(pairs.side + first);
    const PairContact<R> contact = find_contact(pair, gathered.largest_reach(), side);
    // What stood before may have slid along the strands, away from these segments.
    const std::uint32_t known = lane_bits((side < R(0)) | (side > R(0)));
    std::uint32_t through = lane_bits(contact.crossed & (contact.distance < R(0))) | known;
    if (pairs.count - first < kWidth) through &= ~(~0u << (pairs.count - first));
    if (through == 0) return;
    const std::uint32_t negative_side = lane_bits(side < R(0)),
                        negative_start = lane_bits(tetrahedron_volume(pair.a_start, pair.b_start) < R(0));
    const std::uint32_t negative = (known & negative_side) | (~known & negative_start);
    for (; through; through &= through - 1) {
      const int lane = __builtin_ctz(through);
      write(pairs.a[first + lane], pairs.b[first + lane], (negative >> lane & 1) != 0);
    }
  }

 private:
  static constexpr int kAround = 2;  // segments that a crossing may have slid along

  // Follows the crossing of the strands from two of their segments to the two that it is on now. Where that
  // leads nowhere, among segments that are parallel or bent, the nearest of all pairs about is taken.
  RINGLET_FUNCTION void write(std::int32_t a, std::int32_t b, bool negative) const {
    std::int32_t one = a, other = b;
    for (int step = 0; step <= 2 * kAround; ++step) {
      const Segment<T> here = segment_at<T>(places.end, one), there = segment_at<T>(places.end, other);
      const LineProducts<T> products(here.along(), there.along(), there.begin - here.begin);
      if (products.determinant <= parallel_sine2<T>() * (products.uu * products.ww)) break;
      const T s = products.s(), u = products.u();
      const bool reached = within_unit(s) && within_unit(u);
      if (reached && (tetrahedron_volume(here, there) < T(0)) == negative) return;  // on their own sides
      if (reached && write_cut(one, other, negative)) return;
      if (reached) break;
      one += beyond(s), other += beyond(u);
      if (!near_on_strand(a, one) || !near_on_strand(b, other)) return;
    }
    for (int far = 0; far <= kAround; ++far)
      for (int i = -far; i <= far; ++i)
        for (int j = -far; j <= far; ++j)
          if ((i == far || i == -far || j == far || j == -far) && near_on_strand(a, a + i) &&
              near_on_strand(b, b + j) && write_cut(a + i, b + j, negative))
            return;
  }
  RINGLET_KERNEL static std::int32_t beyond(T place) { return place < T(0) ? -1 : place > T(1) ? 1 : 0; }
  RINGLET_KERNEL bool near_on_strand(std::int32_t from, std::int32_t segment) const {
    return segment - from <= kAround && from - segment <= kAround && places.on_one_strand(from, segment);
  }
  // If the two cut through one another.
  RINGLET_FUNCTION bool write_cut(std::int32_t a, std::int32_t b, bool negative) const {
    const Segment<T> one = segment_at<T>(places.end, a), other = segment_at<T>(places.end, b);
    if ((tetrahedron_volume(one, other) < T(0)) == negative) return false;
    const LineProducts<T> products(one.along(), other.along(), other.begin - one.begin);
    if (products.determinant <= parallel_sine2<T>() * (products.uu * products.ww)) return false;
    const PairContact<T> contact =
        standing_contact(SegmentPair<T>{one, other, one, other}, products, negative ? T(-1) : T(1));
    if (!contact.crossed || !(-contact.distance < deepest)) return false;
    const std::int32_t at = atomic_add(count, 1);
    if (at < room) found[at] = key.key(a, b, negative ? PairKey::kNegative : PairKey::kPositive);
    return true;
  }
};

template <class Backend, class R>
class StandingCrossings {
 public:
  using T = Scalar<R>;

  std::int32_t count() const { return count_; }
  void clear() { count_ = 0; }

  // Those among an application's pairs, by where the segments are at the end.
  void find(Backend& backend, const ContactPairs<T>& pairs, const HairPlaces<T>& places) {
    const PairKey key(places.particles);
    constexpr int kWidth = Traits<R>::kWidth, kPackChunk = 128;
    taken_.resize(1);
    std::int32_t room;
    do {
      room = static_cast<std::int32_t>(key_.size());
      std::int32_t* taken = taken_.data();
      backend.parallel_for("clear standing", 1, [=] RINGLET_LAMBDA(std::int32_t) { *taken = 0; });
      const FindStanding<R> found{pairs, places, T(kDeepest), key, key_.data(), taken, room};
      backend.parallel_for("find standing", (pairs.count + kWidth - 1) / kWidth, found, kPackChunk);
      count_ = static_cast<std::int32_t>(backend.largest(
          "standing", 1, 0, [=] RINGLET_LAMBDA(std::int32_t) { return static_cast<double>(*taken); }));
      const std::int32_t grown = count_ + count_ / 2;  // there will be more in the frames that follow
      if (count_ > room) key_.resize(grown), order_.resize(grown);
    } while (count_ > room);
    std::uint32_t* order = order_.data();
    backend.parallel_for("order standing", count_, [=] RINGLET_LAMBDA(std::int32_t k) { order[k] = 0; });
    backend.sort("sort standing", key_, order_, count_, key.total_bits());
  }

  const std::uint64_t* keys() const { return key_.data(); }
  void copy_to(std::uint64_t* keys) const {
    for (std::int32_t k = 0; k < count_; ++k) keys[k] = key_.data()[k];
  }
  void copy_from(const std::uint64_t* keys, std::int32_t count) {
    if (static_cast<std::size_t>(count) > key_.size()) key_.resize(count), order_.resize(count);
    for (std::int32_t k = 0; k < count; ++k) key_.data()[k] = keys[k];
    count_ = count;
  }
  std::size_t bytes() const { return key_.bytes() + order_.bytes() + taken_.bytes(); }

 private:
  // Of two that are farther through one another than this nobody can tell any more how they got there [m].
  static constexpr double kDeepest = 0.03;

  std::int32_t count_ = 0;
  typename Backend::template Buffer<std::uint64_t> key_;
  typename Backend::template Buffer<std::uint32_t> order_;
  typename Backend::template Buffer<std::int32_t> taken_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
