// The pairs of segments that contacts look at, found anew in each application.
//
// In dense hair most of what a segment would go through by the end it never gets to, where what it meets
// first holds it; yet to look for all of it is most of the work. So the search goes in rounds. In the first,
// segments look about where they start, a small part of the hair's spacing wide; in each that follows those
// that have met little go on, among themselves, farther along their way against the hair's mean motion; in
// the last to the end.
#pragma once
#include "kernels/contact/pair_search.h"
#include "kernels/contact/segment_sorter.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// F, R: the packs of PairSearch.
template <class Backend, class F, class R>
class Neighbours {
 public:
  using T = Scalar<R>;
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;

  // Returns how many pairs were found, some of them in several rounds; they hold until the next call.
  std::int32_t find(Backend& backend, const HairPlaces<T>& places) {
    const HairExtent extent = extent_.find(backend, places.start, places.strand, places.particles);
    rounds_taken_ = 0;
    if (extent.segments == 0) return 0;
    most_looked_at_ = max(static_cast<double>(kMostLookedAt), 2.0 * extent.segments);
    motion_.find(backend, places, extent);
    const float spacing = find_spacing(backend, places, extent);
    const SweptSegments swept{extent, motion_.carried(), true, motion_.slope(), kFewSpacings * spacing};
    meetings_.resize(places.particles), last_round_.resize(places.particles);
    search(backend, places, swept);
    return gather_pairs(backend);
  }

  const std::int32_t* a() const { return a_.data(); }
  const std::int32_t* b() const { return b_.data(); }
  std::size_t bytes() const {
    std::size_t rounds = 0;
    for (const auto& round : rounds_) rounds += round.bytes();
    return rounds + extent_.bytes() + motion_.bytes() + sorter_.bytes() + crowd_.bytes() + meetings_.bytes() +
           hits_.bytes() + last_round_.bytes() + kept_.bytes() + ranks_.bytes() + a_.bytes() + b_.bytes();
  }

 private:
  static constexpr int kRounds = 4;
  // Another round is not begun where it would be more work than this: hits are some 8 times those of the one
  // before, which went a quarter as far.
  static constexpr double kMostHits = 1 << 24, kHitsGrow = 8;
  static constexpr float kFewSpacings = 0.08f, kFartherEachRound = 4;
  static constexpr std::int32_t kFewNeighbours = 4;
  static constexpr int kSearchChunk = 4;  // groups

  // Of one hair to the next, where most of the hair is [m]: counted in cells twice as wide as a segment is
  // long, which far ones share.
  float find_spacing(Backend& backend, const HairPlaces<T>& places, const HairExtent& extent) {
    constexpr std::int32_t kAcross = 64, kCells = kAcross * kAcross * kAcross;
    crowd_.resize(kCells);
    std::int32_t* crowd = crowd_.data();
    const float cell = 2 * extent.segment_length;
    const MotionLattice lattice{
        {extent.low[0], extent.low[1], extent.low[2]}, 1 / cell, {1 << 20, 1 << 20, 1 << 20}};
    const auto cell_of = [=] RINGLET_LAMBDA(std::int32_t p) {
      std::int32_t number = 0;
      for (int c = 0; c < 3; ++c)
        number = number * kAcross +
                 (lattice.nearest(c, static_cast<float>((&places.start[p].x)[c])) & (kAcross - 1));
      return number;
    };
    backend.parallel_for("clear crowd", kCells, [=] RINGLET_LAMBDA(std::int32_t k) { crowd[k] = 0; });
    backend.parallel_for("crowd", places.particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      if (places.strand[p] >= 0) atomic_add(&crowd[cell_of(p)], 1);
    });
    const double segments = backend.sum(
        "segments", kCells, [=] RINGLET_LAMBDA(std::int32_t k) { return static_cast<double>(crowd[k]); });
    const double with_each = backend.sum("crowds", kCells, [=] RINGLET_LAMBDA(std::int32_t k) {
      return static_cast<double>(crowd[k]) * crowd[k];
    });
    const double length_there = with_each / max(segments, 1.0) * static_cast<double>(extent.segment_length);
    return cell * static_cast<float>(sqrt(static_cast<double>(cell) / max(length_there, 1e-12)));
  }

  void search(Backend& backend, const HairPlaces<T>& places, SweptSegments swept) {
    signed char* last_round = last_round_.data();
    const std::int32_t* meetings = meetings_.data();
    const Place<float>* carried = swept.carried;
    backend.parallel_for("all look", places.particles,
                         [=] RINGLET_LAMBDA(std::int32_t p) { last_round[p] = 0; });
    for (int round = 0; round < kRounds; ++round) {
      swept.from_anywhere = round == 0;
      rounds_taken_ = round;
      const double hits = search_round(backend, round, places, swept);
      if (hits < 0) return;
      rounds_taken_ = round + 1;
      if (round > 0 && kHitsGrow * hits > kMostHits) return;
      const float farthest = swept.farthest;
      backend.parallel_for("who goes on", places.particles, [=] RINGLET_LAMBDA(std::int32_t p) {
        const bool goes_on =
            places.strand[p] >= 0 && last_round[p] == round &&
            (meetings[p] < kCrossing || meetings[p] % kCrossing < kFewNeighbours) &&
            (is_far(places, carried, p, farthest) || is_far(places, carried, p + 1, farthest));
        if (goes_on) last_round[p] = static_cast<signed char>(round + 1);
      });
      swept.farthest = round + 2 < kRounds ? kFartherEachRound * swept.farthest : 3e18f;
    }
  }

  RINGLET_KERNEL static bool is_far(const HairPlaces<T>& places, const Place<float>* carried, std::int32_t p,
                                    float farthest) {
    const Vector3<float> way = float_vector(places.end[p]) - vector_of(carried[p]);
    return !(dot(way, way) <= farthest * farthest);
  }

  // Returns how many pairs of tubes met, -1 where nobody looks.
  double search_round(Backend& backend, int round, const HairPlaces<T>& places, const SweptSegments& swept) {
    const signed char* last_round = last_round_.data();
    const SegmentTable<T> table = sorter_.sort(
        backend, places, swept, [=] RINGLET_LAMBDA(std::int32_t p) { return last_round[p] == round; });
    if (table.segments == 0) return -1;
    const std::int32_t groups = (table.segments + kGroupSegments - 1) / kGroupSegments;
    hits_.resize(groups);
    std::int32_t *meetings = meetings_.data(), *hits = hits_.data();
    rounds_[round].fill(backend, groups, [&](const PairPool& pool) {
      backend.parallel_for("clear meetings", places.particles,
                           [=] RINGLET_LAMBDA(std::int32_t p) { meetings[p] = 0; });
      const PairSearch<F, R> search{table, meetings, hits, pool};
      backend.parallel_for("contact pairs", groups, search, kSearchChunk);
    });
    return backend.sum("hits", groups,
                       [=] RINGLET_LAMBDA(std::int32_t k) { return static_cast<double>(hits[k]); });
  }

  struct FoundPairs {
    PairPool pool[kRounds];
    std::int32_t first[kRounds];  // group of each round
    int rounds, limit;

    // Calls visit(pair) for what is kept of a group.
    template <class Visit>
    RINGLET_KERNEL void for_kept(std::int32_t group, const Visit& visit) const {
      int round = rounds - 1;
      while (group < first[round]) --round;
      pool[round].for_pairs(group - first[round], [&](const RankedPair& pair) {
        if (pair.rank < limit) visit(pair);
      });
    }
  };

  // Those of all rounds in one list. What several found is there several times.
  std::int32_t gather_pairs(Backend& backend) {
    const std::int32_t limit = rank_limit(backend);
    std::int32_t groups = 0;
    FoundPairs found{};
    for (int round = 0; round < rounds_taken_; ++round) {
      found.pool[round] = rounds_[round].pool(), found.first[round] = groups;
      groups += rounds_[round].groups();
    }
    found.rounds = rounds_taken_, found.limit = limit;
    kept_.resize(groups + 1);
    std::int32_t* kept = kept_.data();
    backend.parallel_for(
        "count pairs", groups + 1,
        [=] RINGLET_LAMBDA(std::int32_t group) {
          kept[group] = 0;
          if (group < groups) found.for_kept(group, [&](const RankedPair&) { ++kept[group]; });
        },
        kSearchChunk);
    const std::int32_t pairs = backend.scan("start pairs", kept_, groups + 1);
    a_.resize(pairs), b_.resize(pairs);
    std::int32_t *a = a_.data(), *b = b_.data();
    backend.parallel_for(
        "gather pairs", groups,
        [=] RINGLET_LAMBDA(std::int32_t group) {
          std::int32_t at = kept[group];
          found.for_kept(group, [&](const RankedPair& pair) { a[at] = pair.a, b[at] = pair.b, ++at; });
        },
        kSearchChunk);
    return pairs;
  }

  // The rank from which on pairs are left out, so that no more than kMostLookedAt remain.
  std::int32_t rank_limit(Backend& backend) {
    ranks_.resize(kRanks);
    std::int32_t* ranks = ranks_.data();
    backend.parallel_for("clear ranks", kRanks, [=] RINGLET_LAMBDA(std::int32_t rank) { ranks[rank] = 0; });
    for (int taken = 0; taken < rounds_taken_; ++taken) {
      const PairMemory<Backend>& round = rounds_[taken];
      const PairPool pool = round.pool();
      backend.parallel_for(
          "count ranks", round.groups(),
          [=] RINGLET_LAMBDA(std::int32_t group) {
            std::int32_t own[kRanks] = {};
            pool.for_pairs(group, [&](const RankedPair& pair) { ++own[pair.rank]; });
            for (int rank = 0; rank < kRanks; ++rank)
              if (own[rank] > 0) atomic_add(&ranks[rank], own[rank]);
          },
          kSearchChunk);
    }
    const double most = most_looked_at_;
    return static_cast<std::int32_t>(backend.largest("ranks", 1, 0, [=] RINGLET_LAMBDA(std::int32_t) {
      std::int32_t rank = 0;
      for (std::int64_t pairs = 0; rank < kRanks; ++rank) {
        pairs += ranks[rank];
        if (rank >= kLeastPairs && static_cast<double>(pairs) > most) break;
      }
      return static_cast<double>(rank);
    }));
  }

  // Where there are more pairs than these and than two a segment, each segment looks at fewer of its own,
  // those that matter most; never at fewer than kLeastPairs.
  static constexpr std::int64_t kMostLookedAt = 1 << 18;
  static constexpr std::int32_t kLeastPairs = 1;

  ExtentFinder<Backend, T> extent_;
  MotionField<Backend, T> motion_;
  SegmentSorter<Backend, F, T> sorter_;
  PairMemory<Backend> rounds_[kRounds];
  int rounds_taken_ = 0;
  double most_looked_at_ = 0;
  Buffer<std::int32_t> crowd_, meetings_, hits_, kept_, ranks_, a_, b_;
  Buffer<signed char> last_round_;  // [particles] that each segment looks in
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
