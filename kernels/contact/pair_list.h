// The pairs of one application, each once: those found afresh and those known from before.
#pragma once
#include "kernels/contact/contact_passes.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// A pair of segments as one number, the lower one first, with what is known of its side. Sorted by it, what
// is known comes before the same pair found afresh.
struct PairKey {
  enum Side : std::uint64_t { kPositive, kNegative, kFresh };
  int bits = 1;  // of a segment's number

  explicit PairKey(std::int32_t particles) {
    while (particles >> bits) ++bits;
  }
  int total_bits() const { return 2 * bits + 2; }
  RINGLET_KERNEL std::uint64_t key(std::int32_t one, std::int32_t other, Side side) const {
    const auto a = static_cast<std::uint64_t>(one < other ? one : other),
               b = static_cast<std::uint64_t>(one < other ? other : one);
    return (a << bits | b) << 2 | side;
  }
  RINGLET_KERNEL std::int32_t a(std::uint64_t key) const {
    return static_cast<std::int32_t>(key >> (bits + 2));
  }
  RINGLET_KERNEL std::int32_t b(std::uint64_t key) const {
    return static_cast<std::int32_t>(key >> 2 & ((std::uint64_t{1} << bits) - 1));
  }
  // As find_contact wants it.
  RINGLET_KERNEL static signed char side(std::uint64_t key) {
    const std::uint64_t side = key & 3;
    return side == kFresh ? 0 : side == kNegative ? -1 : 1;
  }
};

template <class Backend>
class PairList {
 public:
  // Returns how many pairs there are. `padding` more are set, for packs that read past the end.
  std::int32_t make(Backend& backend, const std::int32_t* a, const std::int32_t* b, std::int32_t found,
                    const std::uint64_t* known, std::int32_t known_count, std::int32_t particles,
                    std::int32_t padding) {
    const std::int32_t all = found + known_count;
    const PairKey key(particles);
    key_.resize(all), order_.resize(all), place_.resize(all + 1);
    std::uint64_t* keys = key_.data();
    std::uint32_t* order = order_.data();
    backend.parallel_for("pair keys", all, [=] RINGLET_LAMBDA(std::int32_t k) {
      keys[k] = k < found ? key.key(a[k], b[k], PairKey::kFresh) : known[k - found];
      order[k] = 0;  // only the keys are wanted
    });
    backend.sort("sort pairs", key_, order_, all, key.total_bits());
    const std::uint64_t* sorted = key_.data();
    std::int32_t* place = place_.data();
    backend.parallel_for("count pairs once", all + 1, [=] RINGLET_LAMBDA(std::int32_t k) {
      place[k] = k < all && (k == 0 || sorted[k] >> 2 != sorted[k - 1] >> 2) ? 1 : 0;
    });
    const std::int32_t pairs = backend.scan("place pairs", place_, all + 1);
    a_.resize(pairs + padding), b_.resize(pairs + padding), side_.resize(pairs + padding);
    std::int32_t *to_a = a_.data(), *to_b = b_.data();
    signed char* side = side_.data();
    backend.parallel_for("list pairs", all, [=] RINGLET_LAMBDA(std::int32_t k) {
      if (place[k] == place[k + 1]) return;
      const std::int32_t at = place[k];
      to_a[at] = key.a(sorted[k]), to_b[at] = key.b(sorted[k]), side[at] = PairKey::side(sorted[k]);
    });
    backend.parallel_for("pad pairs", pairs > 0 ? padding : 0, [=] RINGLET_LAMBDA(std::int32_t k) {
      to_a[pairs + k] = to_a[0], to_b[pairs + k] = to_b[0], side[pairs + k] = 0;
    });
    return pairs;
  }

  const std::int32_t* a() const { return a_.data(); }
  const std::int32_t* b() const { return b_.data(); }
  const signed char* side() const { return side_.data(); }
  std::size_t bytes() const {
    return key_.bytes() + order_.bytes() + place_.bytes() + a_.bytes() + b_.bytes() + side_.bytes();
  }

 private:
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;
  Buffer<std::uint64_t> key_;
  Buffer<std::uint32_t> order_;
  Buffer<std::int32_t> place_, a_, b_;
  Buffer<signed char> side_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
