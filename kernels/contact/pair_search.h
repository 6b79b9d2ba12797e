// Pairs of segments that touch, have crossed, or may do so when others' contacts move them.
#pragma once
#include "kernels/backend/words.h"
#include "kernels/contact/box_table.h"
#include "kernels/contact/pair_pool.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr std::int32_t kCrossing = 1 << 16;

// Looks for the pairs of one group of pieces of the table. F: the pack that boxes are compared by; R: the
// one that pairs are looked at by.
template <class F, class R>
struct PairSearch {
  using T = Scalar<R>;
  static constexpr int kBoxes = Traits<F>::kWidth, kPairs = Traits<R>::kWidth;

  BoxTable table;
  HairPlaces<T> places;
  T far;  // lines are left out that are farther apart at the start, but for how they stray [m]
  std::int32_t*
      meetings;  // [particles] how many pairs each segment is in, and kCrossing more for each that crosses
  std::int32_t* hits;  // [groups] pairs of boxes that met
  PairPool pool;

  RINGLET_FUNCTION void operator()(std::int32_t group) const {
    PairWriter writer{pool};
    const std::int32_t begin = group * kGroupPieces,
                       end = table.boxes - begin < kGroupPieces ? table.boxes : begin + kGroupPieces;
    Work work{{}, {}, {}, {}, writer};
    for (std::int32_t i = begin; i < end;) {
      std::int32_t next = i + 1;
      while (next < end && table.cell[next] == table.cell[i]) ++next;
      search_cell(i, next, work);
      i = next;
    }
    look_at(work);
    write(work);
    hits[group] = work.hits.total;
    pool.last[group] = writer.block, pool.count[group] = writer.count;
  }

 private:
  // Of the table, to look through.
  struct Runs {
    static constexpr int kRoom = 256;
    std::int32_t begin[kRoom], end[kRoom];
    int count = 0;
  };
  // The pieces whose boxes one piece's box meets.
  struct Hits {
    static constexpr int kRoom = 256;
    std::int32_t piece[kRoom + kBoxes];
    int count = 0;
    std::int32_t total = 0;  // of other strands
  };
  // Pairs of pieces waiting until there are enough for a pack.
  struct Suspects {
    static constexpr int kRoom = 256;
    std::int32_t a[kRoom], b[kRoom], a_piece[kRoom], b_piece[kRoom];
    int count = 0;
  };

  // The pairs of one piece that matter most: what it met earliest on its way, then what it is nearest to.
  struct Chosen {
    std::int32_t piece = -1, a = -1, count = 0, b[kMostPairs];
    T key[kMostPairs];

    RINGLET_KERNEL void offer(std::int32_t other, T its_key) {
      if (count == kMostPairs && !(its_key < key[count - 1])) return;
      std::int32_t at = count < kMostPairs ? count++ : count - 1;
      for (; at > 0 && its_key < key[at - 1]; --at) key[at] = key[at - 1], b[at] = b[at - 1];
      key[at] = its_key, b[at] = other;
    }
  };

  struct Work {
    Runs runs;
    Hits hits;
    Suspects suspects;
    Chosen chosen;
    PairWriter& writer;
  };

  RINGLET_KERNEL F corner(int which, std::int32_t at) const {
    return load<F>(table.corners + BoxTable::at(which, at));
  }

  // Pieces [begin, end) of one cell, which look in the same runs of the table.
  RINGLET_FUNCTION void search_cell(std::int32_t begin, std::int32_t end, Work& work) const {
    Box all = box_at(begin);
    for (std::int32_t i = begin + 1; i < end; ++i) {
      const Box box = box_at(i);
      for (int c = 0; c < 3; ++c)
        all.low[c] = min(all.low[c], box.low[c]), all.high[c] = max(all.high[c], box.high[c]);
    }
    Runs& runs = work.runs;
    const int own_level = table.levels.level_of(box_at(begin).half_size());
    for (int level = own_level; level < kLevels; ++level)
      for_runs(table, level, all, [&](std::int32_t from, std::int32_t to) {
        // A pair is found from its first piece on: what is before these has looked for them.
        if (level == own_level && from < begin) from = begin;
        if (from >= to) return;
        runs.begin[runs.count] = from, runs.end[runs.count] = to;
        if (++runs.count == Runs::kRoom) look_through(begin, end, work);
      });
    look_through(begin, end, work);
  }

  RINGLET_FUNCTION void look_through(std::int32_t begin, std::int32_t end, Work& work) const {
    for (std::int32_t i = begin; i < end; ++i) {
      const Box box = box_at(i);
      for (int run = 0; run < work.runs.count; ++run) {
        std::int32_t from = work.runs.begin[run];
        const std::int32_t to = work.runs.end[run];
        if (from <= i && i < to) from = i + 1;
        for (std::int32_t j = from & ~(kBoxes - 1); j < to; j += kBoxes) {
          std::uint32_t near = lane_bits(overlaps(box, j));
          if (j < from) near &= ~0u << (from - j);
          if (to - j < kBoxes) near &= ~(~0u << (to - j));
          Hits& hits = work.hits;
          hits.count += append_lanes<kBoxes>(hits.piece + hits.count, j, near);
          if (hits.count > Hits::kRoom - kBoxes) sift(i, work);
        }
      }
      sift(i, work);
    }
    work.runs.count = 0;
  }

  RINGLET_KERNEL Box box_at(std::int32_t i) const {
    Box box;
    for (int c = 0; c < 3; ++c)
      box.low[c] = table.corners[BoxTable::at(c, i)], box.high[c] = table.corners[BoxTable::at(3 + c, i)];
    return box;
  }

  RINGLET_KERNEL Mask<F> overlaps(const Box& box, std::int32_t j) const {
    return (corner(0, j) <= F(box.high[0])) & (F(box.low[0]) <= corner(3, j)) &
           (corner(1, j) <= F(box.high[1])) & (F(box.low[1]) <= corner(4, j)) &
           (corner(2, j) <= F(box.high[2])) & (F(box.low[2]) <= corner(5, j));
  }

  // Of a pack of hits.
  struct Others {
    alignas(64) std::int32_t segment[kPairs];
    alignas(64) T from[kPairs], to[kPairs], stray[kPairs];
    std::uint32_t elsewhere = 0;  // a bit for each that is not on the strand itself
  };

  RINGLET_KERNEL Others others_of(std::int32_t strand, const std::int32_t* pieces) const {
    Others others;
    for (int lane = 0; lane < kPairs; ++lane) {
      const Piece& piece = table.piece[pieces[lane]];
      others.segment[lane] = piece.segment, others.from[lane] = piece.from, others.to[lane] = piece.to;
      others.stray[lane] = piece.stray;
      others.elsewhere |= (places.strand[piece.segment] != strand ? 1u : 0u) << lane;
    }
    return others;
  }

  // Leaves those hits of a piece that may be pairs, and forgets them: where the lines of the segments have
  // changed sides, or are near at the end.
  RINGLET_FUNCTION void sift(std::int32_t i, Work& work) const {
    Hits& hits = work.hits;
    const int count = hits.count;
    hits.count = 0;
    if (count == 0) return;
    const Piece& own = table.piece[i];
    const Segment<R> start = segment_at<R>(places.start, own.segment),
                     end = segment_at<R>(places.end, own.segment);
    const R radius(thickest(places.end, own.segment));
    const std::int32_t strand = places.strand[own.segment];
    for (int k = count; k % kPairs; ++k) hits.piece[k] = i;
    for (int k = 0; k < count; k += kPairs) {
      const Others others = others_of(strand, hits.piece + k);
      hits.total += ones(others.elsewhere);
      const Segment<R> other_start = gather_segment<R>(places.start, others.segment).places;
      const Mask<R> possible = may_meet(start, other_start, own, others);
      if ((lane_bits(possible) & others.elsewhere) == 0) continue;
      const GatheredSegment<R> other = gather_segment<R>(places.end, others.segment);
      const R near = R(T(kNear)) * (radius + max(other.begin_extra, other.end_extra));
      std::uint32_t left =
          lane_bits(possible & on_other_side_or_near(start, end, other_start, other.places, near)) &
          others.elsewhere;
      for (; left; left &= left - 1) {
        const int lane = __builtin_ctz(left);
        suspect(own.segment, others.segment[lane], i, hits.piece[k + lane], work);
      }
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

  // Whether the lines at the start are so near that they can have met, on the pieces, before either had gone
  // as far as it is looked for.
  RINGLET_KERNEL Mask<R> may_meet(const Segment<R>& a, const Segment<R>& b, const Piece& own,
                                  const Others& others) const {
    const LineProducts<R> lines(a.along(), b.along(), b.begin - a.begin);
    const R sine2 = fma(parallel_sine2<R>() * lines.uu, lines.ww, lines.determinant);
    const R most = R(far + T(own.stray)) + load<R>(others.stray), volume = tetrahedron_volume(a, b);
    // Places shift by the distance over the sine of the angle.
    const R per_sine = most * inverse_or_zero(sqrt(lines.determinant), R(T(1e-18)));
    const R s = lines.s(), u = lines.u(), shift_a = per_sine * sqrt(lines.ww),
            shift_b = per_sine * sqrt(lines.uu);
    const Mask<R> on_a = (R(T(own.from)) - shift_a <= s) & (s <= R(T(own.to)) + shift_a),
                  on_b = (load<R>(others.from) - shift_b <= u) & (u <= load<R>(others.to) + shift_b);
    const Mask<R> parallel = lines.determinant <= R(T(1e-4)) * lines.uu * lines.ww;
    return (volume * volume <= most * most * sine2) & (parallel | (on_a & on_b));
  }

  RINGLET_KERNEL void suspect(std::int32_t a, std::int32_t b, std::int32_t i, std::int32_t j,
                              Work& work) const {
    Suspects& suspects = work.suspects;
    suspects.a[suspects.count] = a, suspects.b[suspects.count] = b;
    suspects.a_piece[suspects.count] = i, suspects.b_piece[suspects.count] = j;
    if (++suspects.count == Suspects::kRoom) look_at(work);
  }

  // Chooses among the suspects, and forgets them. A pair counts for the two pieces that the contact is on.
  RINGLET_FUNCTION void look_at(Work& work) const {
    Suspects& suspects = work.suspects;
    const int count = suspects.count;
    suspects.count = 0;
    for (int k = count; k % kPairs; ++k) suspects.a[k] = suspects.a[0], suspects.b[k] = suspects.b[0];
    for (int k = 0; k < count; k += kPairs) {
      const std::int32_t *a = suspects.a + k, *b = suspects.b + k;
      const PackOfPairs<R> gathered(places, a, b);
      const SegmentPair<R> pair = gathered.places();
      const R reach = gathered.largest_reach();
      const PairContact<R> contact = find_contact(pair, reach, R(0));
      std::uint32_t found = lane_bits(contact.crossed | (contact.distance < R(T(kNear)) * reach));
      if (count - k < kPairs) found &= ~(~0u << (count - k));
      if (found == 0) continue;
      alignas(64) T key[kPairs], on_a[kPairs], on_b[kPairs];
      store(key, select(contact.crossed, R(-1) - contact.later, contact.distance));
      store(on_a, contact.s), store(on_b, contact.u);
      for (; found; found &= found - 1) {
        const int lane = __builtin_ctz(found);
        const std::int32_t i = suspects.a_piece[k + lane];
        if (!table.piece[i].holds(static_cast<float>(on_a[lane])) ||
            !table.piece[suspects.b_piece[k + lane]].holds(static_cast<float>(on_b[lane])))
          continue;
        if (work.chosen.piece != i) write(work), work.chosen.piece = i, work.chosen.a = a[lane];
        work.chosen.offer(b[lane], key[lane]);
        const std::int32_t met = key[lane] < T(0) ? 1 + kCrossing : 1;
        atomic_add(&meetings[a[lane]], met), atomic_add(&meetings[b[lane]], met);
      }
    }
  }

  // Writes what was chosen for a piece.
  RINGLET_FUNCTION void write(Work& work) const {
    Chosen& chosen = work.chosen;
    for (std::int32_t k = 0; k < chosen.count; ++k)
      work.writer.add({chosen.a, chosen.b[k], chosen.key[k] < T(0) ? k : k + kNearRank});
    chosen.count = 0;
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
