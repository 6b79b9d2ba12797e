// Pairs of segments that touch, have crossed, or may do so when others' contacts move them.
#pragma once
#include "kernels/backend/words.h"
#include "kernels/contact/pair_pool.h"
#include "kernels/contact/segment_list.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr std::int32_t kCrossing = 1 << 16;

// Looks for the pairs of one group of segments of the table. F: the pack that tubes are compared by; R: the
// one that pairs are looked at by.
template <class F, class R>
struct PairSearch {
  using T = Scalar<R>;
  static constexpr int kTubes = Traits<F>::kWidth, kPairs = Traits<R>::kWidth;

  SegmentTable<T> table;
  std::int32_t*
      meetings;  // [particles] how many pairs each segment is in, and kCrossing more for each that crosses
  std::int32_t* hits;  // [groups] pairs of tubes that met
  PairPool pool;

  RINGLET_FUNCTION void operator()(std::int32_t group) const {
    PairWriter writer{pool};
    const std::int32_t begin = group * kGroupSegments, end = table.segments - begin < kGroupSegments
                                                                 ? table.segments
                                                                 : begin + kGroupSegments;
    Work work(writer);
    for (std::int32_t i = begin; i < end;) {
      std::int32_t next = i + 1;
      while (next < end && table.key[next] == table.key[i] && are_close(i, next)) ++next;
      search_cell(i, next, work);
      i = next;
    }
    hits[group] = work.hits.total;
    pool.last[group] = writer.block, pool.count[group] = writer.count;
  }

 private:
  // Where in the table those are that one segment's tube meets.
  struct Hits {
    static constexpr int kRoom = 256;
    std::int32_t at[kRoom + kTubes];
    std::int32_t total = 0;  // of other strands
  };
  // Pairs waiting until there are enough for a pack, as four times where they are in the table.
  struct Suspects {
    static constexpr int kRoom = 256;
    std::int32_t a[kRoom], b[kRoom];
    int count = 0;
  };

  // The pairs of one segment that matter most: what it met earliest on its way, then what it is nearest to.
  struct Chosen {
    std::int32_t met, count, b[kMostPairs];  // met: as in `meetings`
    T key[kMostPairs];

    RINGLET_KERNEL void offer(std::int32_t other, T its_key) {
      if (count == kMostPairs && !(its_key < key[count - 1])) return;
      std::int32_t at = count < kMostPairs ? count++ : count - 1;
      for (; at > 0 && its_key < key[at - 1]; --at) key[at] = key[at - 1], b[at] = b[at - 1];
      key[at] = its_key, b[at] = other;
    }
  };

  struct Work {
    PairWriter& writer;
    SegmentList<F> own, others;
    Hits hits;
    Suspects suspects;
    std::int32_t first = 0;         // own segment of the table
    Chosen chosen[kGroupSegments];  // of each own segment

    explicit Work(PairWriter& to) : writer(to) {}
  };

  // Cells are numbered modulo a power of two: what shares one may be far apart.
  RINGLET_KERNEL bool are_close(std::int32_t i, std::int32_t other) const {
    const BoxLevel& level = table.levels.level[table.levels.level_with(table.cell_of(table.key[i]))];
    const Box one = table.box(i), another = table.box(other);
    bool close = true;
    for (int c = 0; c < 3; ++c) close = close && abs(one.low[c] - another.low[c]) < 4 * level.half_size;
    return close;
  }

  // Segments [begin, end) of one cell, which run along the same axis.
  RINGLET_FUNCTION void search_cell(std::int32_t begin, std::int32_t end, Work& work) const {
    const int axis = table.axis_of(table.key[begin]);
    SegmentList<F>&own = work.own, &others = work.others;
    own.count = others.count = 0;
    work.first = begin;
    for (std::int32_t k = 0; k < end - begin; ++k) work.chosen[k].met = work.chosen[k].count = 0;
    for_packs(begin, end, [&](std::int32_t j, std::uint32_t bits) { own.append(tubes(j, axis), j, bits); });
    own.close();
    for (int k = 0; k + 1 < own.count; ++k) meet(k, own, k + 1, work);
    const Tube<F> around = same_tube<F>(own.around());
    Box box = table.box(begin);
    for (std::int32_t i = begin + 1; i < end; ++i) box.extend(table.box(i));
    const int own_level = table.levels.level_with(table.cell_of(table.key[begin]));
    for (int level = own_level; level < kLevels; ++level)
      for_runs(table, level, box, [&](std::int32_t from, std::int32_t to) {
        // A pair is found from its first segment on: what is before these has looked for them.
        if (level == own_level && from < end) from = end;
        for_packs(from, to, [&](std::int32_t j, std::uint32_t bits) {
          const Tube<F> pack = tubes(j, axis);
          others.append(pack, j, lane_bits(pack.meets(around)) & bits);
          if (others.full()) meet_others(work);
        });
      });
    meet_others(work);
    look_at(work);
    for (std::int32_t k = 0; k < end - begin; ++k) write(table.segment[begin + k], work.chosen[k], work);
  }

  RINGLET_KERNEL Tube<F> tubes(std::int32_t first, int axis) const {
    return load_tube<F>(table.tubes + table.tube(first, axis), table.kBlock);
  }

  // Calls visit(first, bits) for the packs of the table that hold segments [begin, end), a bit for each.
  template <class Visit>
  RINGLET_KERNEL void for_packs(std::int32_t begin, std::int32_t end, const Visit& visit) const {
    for (std::int32_t j = begin & ~(kTubes - 1); j < end; j += kTubes) {
      std::uint32_t bits = (1u << kTubes) - 1;
      if (j < begin) bits &= ~0u << (begin - j);
      if (end - j < kTubes) bits &= ~(~0u << (end - j));
      visit(j, bits);
    }
  }

  RINGLET_FUNCTION void meet_others(Work& work) const {
    work.others.close();
    for (int k = 0; k < work.own.count; ++k) meet(k, work.others, 0, work);
    work.others.count = 0;
  }

  // Looks for those that own segment k may meet in a list, from its `from` on.
  RINGLET_KERNEL void meet(int k, const SegmentList<F>& list, int from, Work& work) const {
    const Tube<F> tube = same_tube<F>(work.own.tube(k));
    std::int32_t* to = work.hits.at;
    int count = 0;  // in a register, for all that the compiler knows of what `to` is next to
    const int last = list.count;
    for (int j = from & ~(kTubes - 1); j < last; j += kTubes) {
      std::uint32_t near = lane_bits(list.pack(j).meets(tube));
      if (j < from) near &= ~0u << (from - j);
      count += append_selected<kTubes>(to + count, list.at + j, near);
      if (count > Hits::kRoom - kTubes) sift(work.own.at[k], count, work), count = 0;
    }
    sift(work.own.at[k], count, work);
  }

  // Leaves those hits of a segment that may be pairs: where the lines of the segments have
  // changed sides, or are near at the end.
  RINGLET_FUNCTION void sift(std::int32_t i, int count, Work& work) const {
    Hits& hits = work.hits;
    if (count == 0) return;
    const SegmentPlaces<T>& own = table.places[i];
    const Segment<R> start = segment_at<R>(&own.start.begin, 0), end = segment_at<R>(&own.end.begin, 0);
    const R radius(max(own.end.begin.extra, own.end.end.extra)), strand(own.start.begin.extra);
    for (int k = 0; k < count; ++k) prefetch(&table.places[hits.at[k]]);
    for (int k = count; k % kPairs; ++k) hits.at[k] = i;
    for (int k = 0; k < count; k += kPairs) {
      alignas(64) std::int32_t quads[kPairs];
      for (int lane = 0; lane < kPairs; ++lane) quads[lane] = 4 * hits.at[k + lane];
      const GatheredSegment<R> other_start = gather_ends<R>(table.places->start, quads),
                               other = gather_ends<R>(table.places->end, quads);
      const Mask<R> elsewhere = (other_start.begin_extra < strand) | (strand < other_start.begin_extra);
      hits.total += ones(lane_bits(elsewhere));
      const R near = R(T(kNear)) * (radius + max(other.begin_extra, other.end_extra));
      std::uint32_t left =
          lane_bits(elsewhere & on_other_side_or_near(start, end, other_start.places, other.places, near));
      for (; left; left &= left - 1) suspect(4 * i, quads[__builtin_ctz(left)], work);
    }
  }

  RINGLET_KERNEL Mask<R> on_other_side_or_near(const Segment<R>& a_start, const Segment<R>& a,
                                               const Segment<R>& b_start, const Segment<R>& b, R near) const {
    const R first = tetrahedron_volume(a_start, b_start), last = tetrahedron_volume(a, b);
    const Vector3<R> u = a.along(), w = b.along(), across = cross(u, w);
    // Of lines that are nearly parallel the volume tells little more than its rounding.
    const R sine2 = fma(parallel_sine2<R>() * dot(u, u), dot(w, w), dot(across, across));
    return differ_in_sign(first, last) | (last * last <= near * near * sine2);
  }

  RINGLET_KERNEL void suspect(std::int32_t a, std::int32_t b, Work& work) const {
    Suspects& suspects = work.suspects;
    suspects.a[suspects.count] = a, suspects.b[suspects.count] = b;
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
      const SegmentPlaces<T>& all = *table.places;
      const PackOfPairs<R> gathered(gather_ends<R>(all.start, a), gather_ends<R>(all.start, b),
                                    gather_ends<R>(all.end, a), gather_ends<R>(all.end, b));
      const R reach = gathered.largest_reach();
      const PairContact<R> contact = find_contact(gathered.places(), reach, R(0));
      std::uint32_t found = lane_bits(contact.crossed | (contact.distance < R(T(kNear)) * reach));
      if (count - k < kPairs) found &= ~(~0u << (count - k));
      if (found == 0) continue;
      alignas(64) T key[kPairs];
      store(key, select(contact.crossed, R(-1) - contact.later, contact.distance));
      for (; found; found &= found - 1) {
        const int lane = __builtin_ctz(found);
        choose(work.chosen[a[lane] / 4 - work.first], table.segment[b[lane] / 4], key[lane]);
      }
    }
  }

  RINGLET_KERNEL void choose(Chosen& chosen, std::int32_t b, T key) const {
    chosen.offer(b, key);
    const std::int32_t met = key < T(0) ? 1 + kCrossing : 1;
    chosen.met += met, atomic_add(&meetings[b], met);
  }

  // Writes what was chosen for a segment.
  RINGLET_FUNCTION void write(std::int32_t a, const Chosen& chosen, Work& work) const {
    if (chosen.met != 0) atomic_add(&meetings[a], chosen.met);
    for (std::int32_t k = 0; k < chosen.count; ++k)
      work.writer.add({a, chosen.b[k], chosen.key[k] < T(0) ? k : k + kNearRank});
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
