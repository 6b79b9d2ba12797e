// The pairs of segments that contacts look at, found anew in each application.
#pragma once
#include "kernels/contact/pair_search.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// F, R: the packs of PairSearch.
template <class Backend, class F, class R>
class Neighbours {
 public:
  using T = Scalar<R>;
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;

  // `strand`: [particles] the strand of the segment that begins there, -1 where none does. Returns how many
  // pairs there are; they hold until the next call.
  std::int32_t find(Backend& backend, const HairPlaces<T>& places, const std::int32_t* strand,
                    std::int32_t particles, T reach) {
    margin_ = T(kMarginReaches) * reach;
    const float box_margin = static_cast<float>(margin_ + reach);
    find_mean_motion(backend, places, strand, particles);
    find_boxes(backend, places, strand, particles, box_margin);
    fill_table(backend, places, strand, particles);
    search(backend, places, strand, particles, reach, box_margin);
    return gather_pairs(backend);
  }

  std::int32_t* a() { return a_.data(); }
  std::int32_t* b() { return b_.data(); }
  std::size_t bytes() const {
    return sums_.bytes() + nodes_.bytes() + filled_.bytes() + box_.bytes() + key_.bytes() + order_.bytes() +
           first_.bytes() + segment_.bytes() + strand_.bytes() + components_.bytes() + pool_.bytes() +
           next_.bytes() + last_.bytes() + count_.bytes() + kept_.bytes() + a_.bytes() + b_.bytes();
  }

 private:
  // What counts as near, in sums of radii: about as far as contacts move hair in an application.
  static constexpr double kMarginReaches = 4;
  static constexpr int kLatticeCells = 8;   // of the mean motion, along the longest axis
  static constexpr float kSteepest = 0.2f;  // slope of the mean motion that is aimed at [-]
  static constexpr int kSmoothings = 48;

  // Lowest and highest of f(particle)[axis] over particles with a segment.
  template <class Values>
  void find_bounds(Backend& backend, const std::int32_t* strand, std::int32_t particles, const Values& values,
                   float* low, float* high) {
    for (int c = 0; c < 3; ++c) {
      high[c] = static_cast<float>(
          backend.largest("contact bounds", particles, -1e30, [=] RINGLET_LAMBDA(std::int32_t p) {
            return strand[p] < 0 ? -1e30 : static_cast<double>(values(p, c));
          }));
      low[c] = static_cast<float>(
          -backend.largest("contact bounds", particles, -1e30, [=] RINGLET_LAMBDA(std::int32_t p) {
            return strand[p] < 0 ? -1e30 : -static_cast<double>(values(p, c));
          }));
    }
  }

  void make_lattice(Backend& backend, const HairPlaces<T>& places, const std::int32_t* strand,
                    std::int32_t particles) {
    float high[3];
    find_bounds(
        backend, strand, particles,
        [=] RINGLET_LAMBDA(std::int32_t p, int c) { return (&places.end[p].x)[c]; }, lattice_.low, high);
    float size = 1e-3f;
    for (int c = 0; c < 3; ++c) size = max(size, high[c] - lattice_.low[c]);
    lattice_.per_cell = static_cast<float>(kLatticeCells) / size;
    for (int c = 0; c < 3; ++c)
      lattice_.nodes[c] = static_cast<std::int32_t>((high[c] - lattice_.low[c]) * lattice_.per_cell) + 2;
  }

  void find_mean_motion(Backend& backend, const HairPlaces<T>& places, const std::int32_t* strand,
                        std::int32_t particles) {
    make_lattice(backend, places, strand, particles);
    const MotionLattice lattice = lattice_;
    sums_.resize(lattice.total()), nodes_.resize(lattice.total()), filled_.resize(lattice.total());
    MotionSum* sums = sums_.data();
    backend.parallel_for("clear motion", lattice.total(),
                         [=] RINGLET_LAMBDA(std::int32_t k) { sums[k] = MotionSum{}; });
    backend.parallel_for("sum motion", particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      if (strand[p] < 0) return;
      const Place<T>&end = places.end[p], &start = places.start[p];
      std::int32_t node[3];
      for (int c = 0; c < 3; ++c) node[c] = lattice.nearest(c, static_cast<float>((&end.x)[c]));
      MotionSum& sum = sums[lattice.number(node[0], node[1], node[2])];
      for (int c = 0; c < 3; ++c)
        atomic_add(&sum.displacement[c],
                   static_cast<std::int64_t>(((&end.x)[c] - (&start.x)[c]) * (1 / kMotionUnit)));
      atomic_add(&sum.count, std::int64_t{1});
    });
    MotionNode* nodes = nodes_.data();
    backend.parallel_for("mean motion", lattice.total(),
                         [=] RINGLET_LAMBDA(std::int32_t k) { nodes[k] = mean_of(sums[k]); });
    const auto sweep = [&](const char* name, int sweeps, const auto& change) {
      for (int k = 0; k < sweeps; ++k) {
        const MotionNode* from = nodes_.data();
        MotionNode* to = filled_.data();
        backend.parallel_for(name, lattice.total(),
                             [=] RINGLET_LAMBDA(std::int32_t node) { to[node] = change(from, node); });
        nodes_.swap(filled_);
      }
    };
    sweep("fill motion", kLatticeCells, [=] RINGLET_LAMBDA(const MotionNode* from, std::int32_t node) {
      return from[node].known ? from[node] : mean_of_neighbours(lattice, from, node);
    });
    const float most = kSteepest / lattice.per_cell;
    sweep("smooth motion", kSmoothings, [=] RINGLET_LAMBDA(const MotionNode* from, std::int32_t node) {
      return less_steep(lattice, from, node, most);
    });
    const MotionNode* smooth = nodes_.data();
    const double left = backend.largest("steepness", lattice.total(), 0, [=] RINGLET_LAMBDA(std::int32_t k) {
      return static_cast<double>(steepness(lattice, smooth, k));
    });
    slope_ = static_cast<float>(left) * lattice.per_cell;
  }

  void find_boxes(Backend& backend, const HairPlaces<T>& places, const std::int32_t* strand,
                  std::int32_t particles, float margin) {
    box_.resize(particles);
    Box* boxes = box_.data();
    const MotionLattice lattice = lattice_;
    const MotionNode* nodes = nodes_.data();
    const float slope = min(slope_, 0.9f);
    backend.parallel_for("contact boxes", particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      if (strand[p] >= 0) boxes[p] = swept_box(places, p, lattice, nodes, slope, margin);
    });
  }

  // Holds the segment's places at the end, and at the start moved along with the mean motion.
  RINGLET_FUNCTION static Box swept_box(const HairPlaces<T>& places, std::int32_t p,
                                        const MotionLattice& lattice, const MotionNode* nodes, float slope,
                                        float margin) {
    const auto vector = [](const Place<T>& at) {
      return Vector3<float>{static_cast<float>(at.x), static_cast<float>(at.y), static_cast<float>(at.z)};
    };
    const Segment<float> end{vector(places.end[p]), vector(places.end[p + kLanes])},
        start{vector(places.start[p]), vector(places.start[p + kLanes])};
    const auto pieces = static_cast<int>(min(length(end.along()) * lattice.per_cell, 64.0f)) + 1;
    Box box{{3e38f, 3e38f, 3e38f}, {-3e38f, -3e38f, -3e38f}};
    float spread[3] = {}, apart = 0;
    for (int k = 0; k <= pieces; ++k) {
      const float s = static_cast<float>(k) / static_cast<float>(pieces);
      const Vector3<float> now = end.at(s), then = start.at(s);
      const float last[3] = {now.x, now.y, now.z}, first[3] = {then.x, then.y, then.z};
      const MeanMotion motion = mean_motion(lattice, nodes, last);
      for (int c = 0; c < 3; ++c) {
        const float moved = first[c] + motion.mean[c];
        box.low[c] = min(box.low[c], min(moved, last[c]));
        box.high[c] = max(box.high[c], max(moved, last[c]));
        spread[c] = max(spread[c], motion.spread[c]), apart = max(apart, abs(moved - last[c]));
      }
    }
    // A neighbour that it meets is as far away at the end as both have left the mean motion, and that much
    // more as the mean motion differs between them; within their own lengths by the slope just here.
    const float beyond = slope / (1 - slope) * apart, half = box.half_size();
    for (int c = 0; c < 3; ++c) {
      const float more = min(spread[c], slope) * half + beyond + 0.5f * margin;
      box.low[c] -= more, box.high[c] += more;
    }
    return box;
  }

  void fill_table(Backend& backend, const HairPlaces<T>& places, const std::int32_t* strand,
                  std::int32_t particles) {
    const Box* boxes = box_.data();
    const double segments = backend.sum("contact segments", particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      return strand[p] < 0 ? 0.0 : 1.0;
    });
    const double sizes = backend.sum("contact sizes", particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      return strand[p] < 0 ? 0.0 : static_cast<double>(boxes[p].half_size());
    });
    float low[3], high[3];
    find_bounds(
        backend, strand, particles,
        [=] RINGLET_LAMBDA(std::int32_t p, int c) { return 0.5f * (boxes[p].low[c] + boxes[p].high[c]); },
        low, high);
    table_.boxes = static_cast<std::int32_t>(segments);
    table_.levels =
        BoxLevels::make(low, high, static_cast<float>(sizes / (segments > 0 ? segments : 1)), table_.boxes);
    sort_boxes(backend, strand, particles);
    order_cells(backend, places);
    gather_boxes(backend, places, strand);
  }

  void sort_boxes(Backend& backend, const std::int32_t* strand, std::int32_t particles) {
    const std::int32_t cells = table_.levels.total_cells;
    key_.resize(particles), order_.resize(particles), first_.resize(cells + 1);
    std::uint64_t* keys = key_.data();
    std::uint32_t* order = order_.data();
    const Box* boxes = box_.data();
    const BoxLevels levels = table_.levels;
    backend.parallel_for("contact cells", particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      keys[p] = static_cast<std::uint64_t>(strand[p] < 0 ? cells : levels.cell_of(boxes[p]));
      order[p] = static_cast<std::uint32_t>(p);
    });
    int bits = 1;
    while (cells >> bits) ++bits;
    backend.sort("sort contacts", key_, order_, particles, bits);
    std::int32_t* first = first_.data();
    const std::uint64_t* sorted = key_.data();
    backend.parallel_for("contact cell starts", particles, [=] RINGLET_LAMBDA(std::int32_t k) {
      const auto here = static_cast<std::int32_t>(sorted[k]);
      for (std::int32_t cell = k == 0 ? 0 : static_cast<std::int32_t>(sorted[k - 1]) + 1; cell <= here;
           ++cell)
        first[cell] = k;
      if (k + 1 < particles) return;
      for (std::int32_t cell = here + 1; cell <= cells; ++cell) first[cell] = particles;
    });
  }

  void order_cells(Backend& backend, const HairPlaces<T>& places) {
    std::uint32_t* order = order_.data();
    const std::int32_t* first = first_.data();
    const Place<T>* end = places.end;
    backend.parallel_for("order contact cells", table_.levels.total_cells,
                         [=] RINGLET_LAMBDA(std::int32_t cell) {
                           for (std::int32_t k = first[cell] + 1; k < first[cell + 1]; ++k) {
                             const std::uint32_t moved = order[k];
                             std::int32_t to = k;
                             for (; to > first[cell]; --to) {
                               if (comes_first(end, static_cast<std::int32_t>(order[to - 1]),
                                               static_cast<std::int32_t>(moved)))
                                 break;
                               order[to] = order[to - 1];
                             }
                             order[to] = moved;
                           }
                         });
  }

  void gather_boxes(Backend& backend, const HairPlaces<T>& places, const std::int32_t* strand) {
    // Whole blocks, for packs read past the end.
    const std::int32_t boxes = table_.boxes,
                       room = (boxes + BoxTable::kBlock - 1) / BoxTable::kBlock * BoxTable::kBlock;
    segment_.resize(boxes), strand_.resize(boxes);
    components_.resize(static_cast<std::size_t>(room) * kBoxComponents);
    float* components = components_.data();
    std::int32_t *segments = segment_.data(), *strands = strand_.data();
    const std::uint32_t* order = order_.data();
    const Box* box = box_.data();
    backend.parallel_for("gather boxes", room, [=] RINGLET_LAMBDA(std::int32_t k) {
      const auto put = [&](int which, float value) { components[BoxTable::at(which, k)] = value; };
      if (k >= boxes) {
        for (int c = 0; c < kBoxComponents; ++c) put(c, 3e38f);
        return;
      }
      const auto p = static_cast<std::int32_t>(order[k]);
      segments[k] = p, strands[k] = strand[p];
      for (int c = 0; c < 3; ++c) {
        put(kLow + c, box[p].low[c]), put(kHigh + c, box[p].high[c]);
        const float start = static_cast<float>((&places.start[p].x)[c]),
                    end = static_cast<float>((&places.end[p].x)[c]);
        put(kStartBegin + c, start), put(kEndBegin + c, end);
        put(kStartAlong + c, static_cast<float>((&places.start[p + kLanes].x)[c]) - start);
        put(kEndAlong + c, static_cast<float>((&places.end[p + kLanes].x)[c]) - end);
      }
    });
    table_.first = first_.data(), table_.segment = segments, table_.strand = strands;
    table_.components = components;
  }

  // Again with more memory where the pool was too small.
  void search(Backend& backend, const HairPlaces<T>& places, const std::int32_t* strand,
              std::int32_t particles, T reach, float box_margin) {
    groups_ = (table_.boxes + kGroupSegments - 1) / kGroupSegments;
    last_.resize(groups_), count_.resize(groups_), kept_.resize(groups_ + 1);
    taken_.resize(1), ranks_.resize(kMostPairs);
    std::int32_t needed = groups_ + groups_ / 2 + 1;
    do {
      if (static_cast<std::size_t>(needed) > next_.size())
        next_.resize(needed), pool_.resize(static_cast<std::size_t>(needed) * kPairBlock);
      std::int32_t *taken = taken_.data(), *ranks = ranks_.data();
      backend.parallel_for("clear pool", kMostPairs,
                           [=] RINGLET_LAMBDA(std::int32_t rank) { *taken = ranks[rank] = 0; });
      const PairPool pool{pool_.data(), next_.data(),  taken, static_cast<std::int32_t>(next_.size()),
                          last_.data(), count_.data(), ranks};
      const PairSearch<F, R> work{table_, places, strand, particles, box_margin, margin_, reach, pool};
      backend.parallel_for("contact pairs", groups_, work, kSearchChunk);
      needed = static_cast<std::int32_t>(backend.largest(
          "pool", 1, 0, [=] RINGLET_LAMBDA(std::int32_t) { return static_cast<double>(*taken); }));
    } while (needed > static_cast<std::int32_t>(next_.size()));
  }

  // Calls visit(pair, its number among the group's) for those of a group's pairs that have a lower rank.
  template <class Visit>
  RINGLET_KERNEL static void for_ranked(const PairPool& pool, std::int32_t group, std::int32_t rank,
                                        const Visit& visit) {
    std::int32_t number = 0;
    for (std::int32_t block = pool.last[group], count = pool.count[group]; count > 0;
         block = pool.next[block]) {
      const std::int32_t from = (count - 1) / kPairBlock * kPairBlock;
      for (std::int32_t k = from; k < count; ++k) {
        const RankedPair& pair = pool.pairs[static_cast<std::int64_t>(block) * kPairBlock + k - from];
        if (pair.rank < rank) visit(pair, number++);
      }
      count = from;
    }
  }

  // The rank from which on pairs are left out, so that no more than kMostLookedAt remain.
  std::int32_t rank_limit(Backend& backend) {
    std::int32_t* ranks = ranks_.data();
    return static_cast<std::int32_t>(backend.largest("ranks", 1, 0, [=] RINGLET_LAMBDA(std::int32_t) {
      std::int32_t rank = 0;
      for (std::int64_t pairs = 0; rank < kMostPairs; ++rank) {
        pairs += ranks[rank];
        if (rank >= kLeastPairs && pairs > kMostLookedAt) break;
      }
      return static_cast<double>(rank);
    }));
  }

  // From the groups' blocks into one list, in the order of the table.
  std::int32_t gather_pairs(Backend& backend) {
    const std::int32_t groups = groups_, limit = rank_limit(backend);
    const PairPool pool{pool_.data(), next_.data(), nullptr, 0, last_.data(), count_.data(), nullptr};
    std::int32_t* kept = kept_.data();
    backend.parallel_for(
        "count pairs", groups + 1,
        [=] RINGLET_LAMBDA(std::int32_t group) {
          kept[group] = 0;
          if (group < groups)
            for_ranked(pool, group, limit, [&](const RankedPair&, std::int32_t) { ++kept[group]; });
        },
        kSearchChunk);
    const std::int32_t pairs = backend.scan("start pairs", kept_, groups + 1);
    constexpr int kPad = 16;
    a_.resize(pairs + kPad), b_.resize(pairs + kPad);
    std::int32_t *a = a_.data(), *b = b_.data();
    backend.parallel_for(
        "gather pairs", groups,
        [=] RINGLET_LAMBDA(std::int32_t group) {
          for_ranked(pool, group, limit, [&](const RankedPair& pair, std::int32_t number) {
            a[kept[group] + number] = pair.a, b[kept[group] + number] = pair.b;
          });
        },
        kSearchChunk);
    return pairs;
  }

  // Where there are more pairs, in dense hair that moves far in a frame, each segment looks at fewer of its
  // own, those that matter most; never at fewer than kLeastPairs.
  static constexpr std::int64_t kMostLookedAt = 1 << 19;
  static constexpr std::int32_t kLeastPairs = 2;
  static constexpr int kSearchChunk = 8;  // groups

  T margin_ = T(0);
  MotionLattice lattice_{};
  float slope_ = 0;  // of the mean motion, at most [-]
  BoxTable table_{};
  std::int32_t groups_ = 0;
  Buffer<MotionSum> sums_;
  Buffer<MotionNode> nodes_, filled_;
  Buffer<Box> box_;
  Buffer<std::uint64_t> key_;
  Buffer<std::uint32_t> order_;
  Buffer<std::int32_t> first_, segment_, strand_, next_, last_, count_, kept_, taken_, ranks_, a_, b_;
  Buffer<float> components_;
  Buffer<RankedPair> pool_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
