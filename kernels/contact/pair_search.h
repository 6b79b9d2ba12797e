// Pairs of segments that touch, have crossed, or may do so when others' contacts move them.
#pragma once
#include "kernels/contact/box_table.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Pairs in memory while they are found. Each group of segments fills blocks of its own, taken from the pool
// one by one.
inline constexpr int kPairBlock = 256, kGroupSegments = 32;

// Of one segment, with those that come after it in the table.
inline constexpr int kMostPairs = 48;

// `rank`: among a's pairs, by how much they matter.
struct RankedPair {
  std::int32_t a, b, rank;
};

struct PairPool {
  RankedPair* pairs;    // [blocks][kPairBlock]
  std::int32_t* next;   // [blocks] the group's block before it, -1: none
  std::int32_t* taken;  // blocks, also of those that there was no memory for
  std::int32_t blocks;
  std::int32_t* last;   // [groups] the group's last block
  std::int32_t* count;  // [groups]
  std::int32_t* ranks;  // [kMostPairs] how many pairs have each
};

struct PairWriter {
  const PairPool& pool;
  std::int32_t block = -1, count = 0, ranks[kMostPairs] = {};

  RINGLET_KERNEL void add(const RankedPair& pair) {
    ++ranks[pair.rank];
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
    Work work{{}, {}, writer};
    for (std::int32_t i = begin; i < end; ++i) search(i, work);
    look_at(work);
    write(work);
    pool.last[group] = writer.block, pool.count[group] = writer.count;
    for (std::int32_t rank = 0; rank < kMostPairs; ++rank)
      if (writer.ranks[rank] > 0) atomic_add(&pool.ranks[rank], writer.ranks[rank]);
  }

 private:
  // Pairs waiting until there are enough for a pack.
  struct Suspects {
    static constexpr int kRoom = 256;
    std::int32_t a[kRoom], b[kRoom];
    int count = 0;
  };

  // The pairs of one segment that matter most: what it met earliest on its way, then what it is nearest to.
  // In dense hair that moves far in a frame a segment would meet dozens of others, all but the first of which
  // it never gets to where those hold it.
  struct Chosen {
    std::int32_t a = -1, count = 0, b[kMostPairs];
    T key[kMostPairs], beyond[kMostPairs];

    RINGLET_KERNEL void offer(std::int32_t other, T its_key, T its_beyond) {
      if (count == kMostPairs && !(its_key < key[count - 1])) return;
      std::int32_t at = count < kMostPairs ? count++ : count - 1;
      for (; at > 0 && its_key < key[at - 1]; --at)
        key[at] = key[at - 1], b[at] = b[at - 1], beyond[at] = beyond[at - 1];
      key[at] = its_key, b[at] = other, beyond[at] = its_beyond;
    }
  };

  RINGLET_KERNEL F component(int which, std::int32_t at) const {
    return load<F>(table.components + BoxTable::at(which, at));
  }
  RINGLET_KERNEL Segment<F> segments(int begin, int along, std::int32_t at) const {
    const Vector3<F> from{component(begin, at), component(begin + 1, at), component(begin + 2, at)};
    return {from,
            from + Vector3<F>{component(along, at), component(along + 1, at), component(along + 2, at)}};
  }
  // One of the table, the same in all lanes.
  RINGLET_KERNEL static Segment<F> segment(const float* own, int begin, int along) {
    const Vector3<F> from{F(own[begin]), F(own[begin + 1]), F(own[begin + 2])};
    return {from, from + Vector3<F>{F(own[along]), F(own[along + 1]), F(own[along + 2])}};
  }

  struct Work {
    Suspects suspects;
    Chosen chosen;
    PairWriter& writer;
  };

  RINGLET_FUNCTION void search(std::int32_t i, Work& work) const {
    float own[kBoxComponents];
    for (int k = 0; k < kBoxComponents; ++k) own[k] = table.components[BoxTable::at(k, i)];
    const Box box{{own[kLow], own[kLow + 1], own[kLow + 2]}, {own[kHigh], own[kHigh + 1], own[kHigh + 2]}};
    const Segment<F> start = segment(own, kStartBegin, kStartAlong), end = segment(own, kEndBegin, kEndAlong);
    const int own_level = table.levels.level_of(box.half_size());
    for (int level = own_level; level < kLevels; ++level)
      for_runs(table, level, box, [&](std::int32_t begin, std::int32_t finish) {
        if (level == own_level && begin <= i) begin = i + 1;  // a pair is found from its first box on
        for (std::int32_t j = begin & ~(kBoxes - 1); j < finish; j += kBoxes) {
          std::uint32_t near = lane_bits(overlaps(own, j));
          if (j < begin) near &= ~0u << (begin - j);
          if (finish - j < kBoxes) near &= ~(~0u << (finish - j));
          if (near == 0) continue;
          near &= lane_bits(may_meet(start, end, j));
          for (; near; near &= near - 1) suspect(i, j + __builtin_ctz(near), work);
        }
      });
  }

  RINGLET_KERNEL Mask<F> overlaps(const float* own, std::int32_t j) const {
    return (component(kLow, j) <= F(own[kHigh])) & (F(own[kLow]) <= component(kHigh, j)) &
           (component(kLow + 1, j) <= F(own[kHigh + 1])) & (F(own[kLow + 1]) <= component(kHigh + 1, j)) &
           (component(kLow + 2, j) <= F(own[kHigh + 2])) & (F(own[kLow + 2]) <= component(kHigh + 2, j));
  }

  // Not where the lines are on the same sides as before and farther apart than is near; nor where an axis
  // separates the segments in the same order at both times, and so throughout.
  RINGLET_KERNEL Mask<F> may_meet(const Segment<F>& start, const Segment<F>& end, std::int32_t j) const {
    const Segment<F> other_start = segments(kStartBegin, kStartAlong, j),
                     other_end = segments(kEndBegin, kEndAlong, j);
    const Mask<F> possible = on_other_side_or_near(start, end, other_start, other_end, F(box_margin));
    if (!some(possible)) return possible;
    return possible & !stay_apart(&Vector3<F>::x, start, end, other_start, other_end) &
           !stay_apart(&Vector3<F>::y, start, end, other_start, other_end) &
           !stay_apart(&Vector3<F>::z, start, end, other_start, other_end);
  }

  template <class P>
  RINGLET_KERNEL static Mask<P> on_other_side_or_near(const Segment<P>& a_start, const Segment<P>& a,
                                                      const Segment<P>& b_start, const Segment<P>& b,
                                                      P near) {
    const P first = tetrahedron_volume(a_start, b_start), last = tetrahedron_volume(a, b);
    const Vector3<P> across = cross(a.along(), b.along());
    return differ_in_sign(first, last) | !(near * near * dot(across, across) < last * last);
  }

  RINGLET_KERNEL Mask<F> stay_apart(F Vector3<F>::*axis, const Segment<F>& a_start, const Segment<F>& a,
                                    const Segment<F>& b_start, const Segment<F>& b) const {
    const F margin(box_margin);
    const auto low = [&](const Segment<F>& s) { return min(s.begin.*axis, s.end.*axis); };
    const auto high = [&](const Segment<F>& s) { return max(s.begin.*axis, s.end.*axis); };
    const Mask<F> above = (low(b) - high(a) > margin) & (low(b_start) - high(a_start) > margin);
    const Mask<F> below = (low(a) - high(b) > margin) & (low(a_start) - high(b_start) > margin);
    return above | below;
  }

  RINGLET_KERNEL void suspect(std::int32_t i, std::int32_t j, Work& work) const {
    if (table.strand[i] == table.strand[j]) return;
    Suspects& suspects = work.suspects;
    suspects.a[suspects.count] = table.segment[i], suspects.b[suspects.count] = table.segment[j];
    if (++suspects.count == Suspects::kRoom) look_at(work);
  }

  // Chooses among the suspects, and forgets them.
  RINGLET_FUNCTION void look_at(Work& work) const {
    Suspects& suspects = work.suspects;
    const int count = suspects.count;
    suspects.count = 0;
    for (int k = count; k % kPairs; ++k) suspects.a[k] = suspects.a[0], suspects.b[k] = suspects.b[0];
    for (int k = 0; k < count; k += kPairs) {
      const std::int32_t *a = suspects.a + k, *b = suspects.b + k;
      const SegmentPair<R> pair = gather_pair<R>(places, a, b);
      const PairContact<R> contact = find_contact(pair, R(reach));
      std::uint32_t found = lane_bits(contact.crossed | (contact.distance < R(reach + margin)));
      if (count - k < kPairs) found &= ~(~0u << (count - k));
      if (found == 0) continue;
      alignas(64) T key[kPairs], beyond[kPairs];  // the latter in segment lengths
      const R shorter = min(length(pair.a.along()), length(pair.b.along()));
      store(key, select(contact.crossed, -contact.later, contact.distance));
      store(beyond, select(contact.crossed, -contact.distance, R(0)) * inverse_or_zero(shorter, R(T(1e-9))));
      for (; found; found &= found - 1) {
        const int lane = __builtin_ctz(found);
        if (work.chosen.a != a[lane]) write(work), work.chosen.a = a[lane];
        work.chosen.offer(b[lane], key[lane], beyond[lane]);
      }
    }
  }

  // Writes what was chosen for a segment.
  RINGLET_FUNCTION void write(Work& work) const {
    Chosen& chosen = work.chosen;
    for (std::int32_t k = 0; k < chosen.count; ++k) {
      work.writer.add({chosen.a, chosen.b[k], k});
      if (chosen.beyond[k] > T(kFar)) add_around({chosen.a, chosen.b[k], k}, chosen.beyond[k], work.writer);
    }
    chosen.count = 0;
  }

  // What went past another by more than this share of its length may come to meet it with another segment
  // when it is put back: the next, or one farther on.
  static constexpr double kFar = 0.25;
  static constexpr std::int32_t kMostAround = 4, kAroundLater = 8;

  RINGLET_FUNCTION void add_around(const RankedPair& pair, T beyond, PairWriter& writer) const {
    const std::int32_t around = 1 + static_cast<std::int32_t>(min(T(kFar) * beyond, T(kMostAround - 1)));
    for (std::int32_t i = -around * kLanes; i <= around * kLanes; i += kLanes)
      for (std::int32_t j = -around * kLanes; j <= around * kLanes; j += kLanes) {
        const std::int32_t one = pair.a + i, other = pair.b + j;
        if ((i == 0 && j == 0) || !same_strand(pair.a, one) || !same_strand(pair.b, other)) continue;
        const bool first = comes_first(places.end, one, other);
        writer.add({first ? one : other, first ? other : one, pair.rank});
      }
  }
  RINGLET_KERNEL bool same_strand(std::int32_t segment, std::int32_t other) const {
    return other >= 0 && other < particles && strand[other] == strand[segment];
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
