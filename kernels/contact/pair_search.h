// Pairs of segments that touch, have crossed, or may do so when others' contacts move them.
#pragma once
#include "kernels/contact/box_table.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Pairs in memory while they are found. Each group of segments fills blocks of its own, taken from the pool
// one by one.
inline constexpr int kPairBlock = 256, kGroupSegments = 32;

struct PairPool {
  SegmentNumbers* pairs;  // [blocks][kPairBlock]
  std::int32_t* next;     // [blocks] the group's block before it, -1: none
  std::int32_t* taken;    // blocks, also of those that there was no memory for
  std::int32_t blocks;
  std::int32_t* last;   // [groups] the group's last block
  std::int32_t* count;  // [groups]
};

struct PairWriter {
  const PairPool& pool;
  std::int32_t block = -1, count = 0;

  RINGLET_KERNEL void add(SegmentNumbers pair) {
    if (count % kPairBlock == 0) {
      const std::int32_t fresh = atomic_add(pool.taken, 1);
      if (fresh < pool.blocks) pool.next[fresh] = block, block = fresh;
      if (fresh >= pool.blocks) block = -1;
    }
    if (block >= 0) pool.pairs[static_cast<std::int64_t>(block) * kPairBlock + count % kPairBlock] = pair;
    ++count;
  }
};

// Looks for the pairs of one group of segments of the table. F: the pack that boxes are compared by; R: the
// one that pairs are looked at by.
template <class F, class R>
struct PairSearch {
  using T = Scalar<R>;
  static constexpr int kBoxes = Traits<F>::kWidth, kPairs = Traits<R>::kWidth;

  BoxTable table;
  HairPlaces<T> places;
  const std::int32_t* strand;  // [particles] of the segment that begins there
  std::int32_t particles;
  float box_margin;  // boxes farther apart than this at both times, along an axis, are left out [m]
  T margin;          // as segments are that are farther apart at the end, of those that have not crossed [m]
  T reach;           // the largest sum of radii [m]
  PairPool pool;

  RINGLET_FUNCTION void operator()(std::int32_t group) const {
    PairWriter writer{pool};
    const std::int32_t begin = group * kGroupSegments,
                       end = table.boxes - begin < kGroupSegments ? table.boxes : begin + kGroupSegments;
    Suspects suspects;
    for (std::int32_t i = begin; i < end; ++i) search(i, suspects, writer);
    look_at(suspects, writer);
    pool.last[group] = writer.block, pool.count[group] = writer.count;
  }

 private:
  // Pairs waiting until there are enough for a pack.
  struct Suspects {
    static constexpr int kRoom = 256;
    std::int32_t a[kRoom], b[kRoom];
    int count = 0;
  };

  RINGLET_KERNEL F component(int which, std::int32_t at) const {
    return load<F>(table.components + static_cast<std::int64_t>(which) * table.stride + at);
  }

  RINGLET_FUNCTION void search(std::int32_t i, Suspects& suspects, PairWriter& writer) const {
    float own[kBoxComponents];
    for (int k = 0; k < kBoxComponents; ++k)
      own[k] = table.components[static_cast<std::int64_t>(k) * table.stride + i];
    const Box box{{own[0], own[1], own[2]}, {own[3], own[4], own[5]}};
    const int own_level = table.levels.level_of(box.half_size());
    for (int level = own_level; level < kLevels; ++level)
      for_runs(table, level, box, [&](std::int32_t begin, std::int32_t end) {
        if (level == own_level && begin <= i) begin = i + 1;  // a pair is found from its first box on
        for (std::int32_t j = begin & ~(kBoxes - 1); j < end; j += kBoxes) {
          std::uint32_t near = lane_bits(overlaps(own, j));
          if (j < begin) near &= ~0u << (begin - j);
          if (end - j < kBoxes) near &= ~(~0u << (end - j));
          if (near == 0) continue;
          near &= ~lane_bits(stay_apart(own, j));
          for (; near; near &= near - 1) suspect(i, j + __builtin_ctz(near), suspects, writer);
        }
      });
  }

  RINGLET_KERNEL Mask<F> overlaps(const float* own, std::int32_t j) const {
    return (component(0, j) <= F(own[3])) & (F(own[0]) <= component(3, j)) & (component(1, j) <= F(own[4])) &
           (F(own[1]) <= component(4, j)) & (component(2, j) <= F(own[5])) & (F(own[2]) <= component(5, j));
  }

  // Whether some axis separates the boxes in the same order at both times, and so throughout.
  RINGLET_KERNEL Mask<F> stay_apart(const float* own, std::int32_t j) const {
    const F margin(box_margin);
    Mask<F> apart = margin < margin;
    RINGLET_UNROLL
    for (int c = 0; c < 3; ++c) {
      const Mask<F> above =
          (component(6 + c, j) - F(own[9 + c]) > margin) & (component(12 + c, j) - F(own[15 + c]) > margin);
      const Mask<F> below =
          (F(own[6 + c]) - component(9 + c, j) > margin) & (F(own[12 + c]) - component(15 + c, j) > margin);
      apart = apart | above | below;
    }
    return apart;
  }

  RINGLET_KERNEL void suspect(std::int32_t i, std::int32_t j, Suspects& suspects, PairWriter& writer) const {
    if (table.strand[i] == table.strand[j]) return;
    const std::int32_t one = table.segment[i], other = table.segment[j];
    const bool first = comes_first(places.end, one, other);
    suspects.a[suspects.count] = first ? one : other, suspects.b[suspects.count] = first ? other : one;
    if (++suspects.count == Suspects::kRoom) look_at(suspects, writer);
  }

  // Writes those of the suspects that are pairs, and forgets all.
  RINGLET_FUNCTION void look_at(Suspects& suspects, PairWriter& writer) const {
    const int count = suspects.count;
    suspects.count = 0;
    if (count == 0) return;
    for (int k = count; k % kPairs; ++k) suspects.a[k] = suspects.a[0], suspects.b[k] = suspects.b[0];
    for (int k = 0; k < count; k += kPairs) {
      const std::int32_t *a = suspects.a + k, *b = suspects.b + k;
      const SegmentPair<R> pair = gather_pair<R>(places, a, b);
      if (!any(may_touch(pair))) continue;
      const PairContact<R> contact = find_contact(pair, R(reach));
      std::uint32_t found = lane_bits(contact.crossed | (contact.distance < R(reach + margin)));
      alignas(64) T beyond[kPairs];  // in segment lengths
      const R shorter = min(length(pair.a.along()), length(pair.b.along()));
      store(beyond, select(contact.crossed, -contact.distance, R(0)) * inverse_or_zero(shorter, R(T(1e-9))));
      if (count - k < kPairs) found &= ~(~0u << (count - k));
      for (; found; found &= found - 1) {
        const int lane = __builtin_ctz(found);
        writer.add({a[lane], b[lane]});
        if (beyond[lane] > T(kFar)) add_around(a[lane], b[lane], beyond[lane], writer);
      }
    }
  }

  // What went past another by more than this share of its length may come to meet it with another segment
  // when it is put back: the next, or one farther on.
  static constexpr double kFar = 0.25;
  static constexpr std::int32_t kMostAround = 4;

  // Not lines that are farther apart than is near, and on the same sides as before.
  RINGLET_KERNEL Mask<R> may_touch(const SegmentPair<R>& pair) const {
    const R near = R(reach + margin);
    const R first = tetrahedron_volume(pair.a_start, pair.b_start), last = tetrahedron_volume(pair.a, pair.b);
    const Vector3<R> across = cross(pair.a.along(), pair.b.along());
    return differ_in_sign(first, last) | !(near * near * dot(across, across) < last * last);
  }

  RINGLET_FUNCTION void add_around(std::int32_t a, std::int32_t b, T beyond, PairWriter& writer) const {
    const std::int32_t around = 1 + static_cast<std::int32_t>(min(T(kFar) * beyond, T(kMostAround - 1)));
    for (std::int32_t i = -around * kLanes; i <= around * kLanes; i += kLanes)
      for (std::int32_t j = -around * kLanes; j <= around * kLanes; j += kLanes) {
        const std::int32_t one = a + i, other = b + j;
        if ((i == 0 && j == 0) || !same_strand(a, one) || !same_strand(b, other)) continue;
        const bool first = comes_first(places.end, one, other);
        writer.add({first ? one : other, first ? other : one});
      }
  }
  RINGLET_KERNEL bool same_strand(std::int32_t segment, std::int32_t other) const {
    return other >= 0 && other < particles && strand[other] == strand[segment];
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
