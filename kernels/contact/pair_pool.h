// Pairs in memory while they are found: nobody knows how many there will be. Each group of segments fills
// blocks of its own, taken from the pool one by one.
#pragma once
#include "kernels/backend/atomic.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr int kPairBlock = 256, kGroupSegments = 64;

// Of one segment, with those that come after it in the table. In dense hair that moves far in a frame a
// segment would meet dozens of others, all but the first of which it never gets to where those hold it.
inline constexpr int kMostPairs = 96;

// `rank`: among the pairs of a, by how much they matter; of those that have not crossed, kNearRank more.
inline constexpr int kNearRank = 8, kRanks = kMostPairs + kNearRank;
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

  // Calls visit(pair) for the pairs of a group.
  template <class Visit>
  RINGLET_KERNEL void for_pairs(std::int32_t group, const Visit& visit) const {
    std::int32_t left = count[group];
    for (std::int32_t block = last[group]; left > 0; block = next[block]) {
      const std::int32_t from = (left - 1) / kPairBlock * kPairBlock;
      for (std::int32_t k = from; k < left; ++k)
        visit(pairs[static_cast<std::int64_t>(block) * kPairBlock + k - from]);
      left = from;
    }
  }
};

struct PairWriter {
  const PairPool& pool;
  std::int32_t block = -1, count = 0;

  RINGLET_KERNEL void add(const RankedPair& pair) {
    if (count % kPairBlock == 0) {
      const std::int32_t fresh = atomic_add(pool.taken, 1);
      if (fresh < pool.blocks) pool.next[fresh] = block, block = fresh;
      if (fresh >= pool.blocks) block = -1;
    }
    if (block >= 0) pool.pairs[static_cast<std::int64_t>(block) * kPairBlock + count % kPairBlock] = pair;
    ++count;
  }
};

// The memory of a pool.
template <class Backend>
class PairMemory {
 public:
  // Calls search(pool), which is to fill the pool's groups: again with more memory where that was too little,
  // and more than that, for pairs that grow in number frame by frame would be looked for twice in each.
  template <class Search>
  void fill(Backend& backend, std::int32_t groups, const Search& search) {
    groups_ = groups;
    last_.resize(groups), count_.resize(groups), taken_.resize(1);
    std::int32_t needed = groups + 1;
    do {
      if (const std::int32_t room = needed + needed / 2; needed > static_cast<std::int32_t>(next_.size()))
        next_.resize(room), pairs_.resize(static_cast<std::size_t>(room) * kPairBlock);
      std::int32_t* taken = taken_.data();
      backend.parallel_for("clear pool", 1, [=] RINGLET_LAMBDA(std::int32_t) { *taken = 0; });
      search(pool());
      needed = static_cast<std::int32_t>(backend.largest(
          "pool", 1, 0, [=] RINGLET_LAMBDA(std::int32_t) { return static_cast<double>(*taken); }));
    } while (needed > static_cast<std::int32_t>(next_.size()));
  }

  PairPool pool() const {
    return {pairs_.data(), next_.data(), taken_.data(), static_cast<std::int32_t>(next_.size()),
            last_.data(),  count_.data()};
  }
  std::int32_t groups() const { return groups_; }
  std::size_t bytes() const {
    return pairs_.bytes() + next_.bytes() + last_.bytes() + count_.bytes() + taken_.bytes();
  }

 private:
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;
  std::int32_t groups_ = 0;
  Buffer<RankedPair> pairs_;
  Buffer<std::int32_t> next_, last_, count_, taken_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
