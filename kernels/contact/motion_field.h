// Finds the hair's mean motion, and carries the start along with it.
#pragma once
#include "kernels/contact/hair_extent.h"
#include "kernels/contact/mean_motion.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class Backend, class T>
class MotionField {
 public:
  // `extent`: of the start.
  void find(Backend& backend, const HairPlaces<T>& places, const HairExtent& extent) {
    lattice_ = MotionLattice::over(extent.low, extent.high, extent.longest() / kLatticeCells);
    sum_motion(backend, places, extent);
    smooth(backend);
    carry(backend, places);
  }

  // [particles] where the mean motion takes it from its start to the end; extra: how far it takes the middle
  // of the segment that begins there from the middle of where it takes its ends [m].
  const Place<float>* carried() const { return carried_.data(); }
  // How much the mean displacement changes over a distance in any direction, at most [-].
  float slope() const { return slope_; }
  std::size_t bytes() const { return sums_.bytes() + nodes_.bytes() + next_.bytes() + carried_.bytes(); }

 private:
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;
  static constexpr int kLatticeCells = 8;   // along the longest axis
  static constexpr float kSteepest = 0.1f;  // of a component along an axis, aimed at [-]
  static constexpr double kFarthest = 1e3;  // that anything moves; what is not a number is left out too [m]
  static constexpr int kSmoothings = 48, kRunChunk = 32;

  void sum_motion(Backend& backend, const HairPlaces<T>& places, const HairExtent& extent) {
    const MotionLattice lattice = lattice_;
    sums_.resize(lattice.total()), nodes_.resize(lattice.total()), next_.resize(lattice.total());
    MotionSum* sums = sums_.data();
    MotionNode* nodes = nodes_.data();
    backend.parallel_for("clear motion", lattice.total(),
                         [=] RINGLET_LAMBDA(std::int32_t k) { sums[k] = MotionSum{}; });
    constexpr std::int32_t kRun = 64;  // of neighbours on strands: most go to one node
    backend.parallel_for(
        "sum motion", (places.particles + kRun - 1) / kRun,
        [=] RINGLET_LAMBDA(std::int32_t run) {
          const std::int32_t end = (run + 1) * kRun < places.particles ? (run + 1) * kRun : places.particles;
          std::int32_t node = -1;
          MotionSum sum{};
          for (std::int32_t p = run * kRun; p < end; ++p) {
            if (places.strand[p] < 0 || !extent.holds(float_vector(places.start[p])) ||
                !(length(vector_of(places.end[p]) - vector_of(places.start[p])) < T(kFarthest)))
              continue;
            const std::int32_t here = nearest_node(lattice, places.start[p]);
            if (here != node && node >= 0) add(sums[node], sum), sum = MotionSum{};
            node = here;
            for (int c = 0; c < 3; ++c)
              sum.displacement[c] += static_cast<std::int64_t>(
                  ((&places.end[p].x)[c] - (&places.start[p].x)[c]) * (1 / kMotionUnit));
            ++sum.count;
          }
          if (node >= 0) add(sums[node], sum);
        },
        kRunChunk);
    backend.parallel_for("mean motion", lattice.total(),
                         [=] RINGLET_LAMBDA(std::int32_t k) { nodes[k] = mean_of(sums[k]); });
  }

  RINGLET_FUNCTION static std::int32_t nearest_node(const MotionLattice& lattice, const Place<T>& place) {
    std::int32_t node[3];
    for (int c = 0; c < 3; ++c) node[c] = lattice.nearest(c, static_cast<float>((&place.x)[c]));
    return lattice.number(node[0], node[1], node[2]);
  }
  RINGLET_FUNCTION static void add(MotionSum& to, const MotionSum& sum) {
    for (int c = 0; c < 3; ++c) atomic_add(&to.displacement[c], sum.displacement[c]);
    atomic_add(&to.count, sum.count);
  }

  template <class Change>
  void sweep(Backend& backend, const char* name, int sweeps, const Change& change) {
    for (int k = 0; k < sweeps; ++k) {
      const MotionNode* from = nodes_.data();
      MotionNode* to = next_.data();
      backend.parallel_for(name, lattice_.total(),
                           [=] RINGLET_LAMBDA(std::int32_t node) { to[node] = change(from, node); });
      nodes_.swap(next_);
    }
  }

  void smooth(Backend& backend) {
    const MotionLattice lattice = lattice_;
    sweep(backend, "fill motion", kLatticeCells,
          [=] RINGLET_LAMBDA(const MotionNode* from, std::int32_t node) {
            return from[node].known ? from[node] : mean_of_neighbours(lattice, from, node);
          });
    const float most = kSteepest / lattice.per_cell;
    sweep(backend, "smooth motion", kSmoothings,
          [=] RINGLET_LAMBDA(const MotionNode* from, std::int32_t node) {
            return less_steep(lattice, from, node, most);
          });
    const MotionNode* nodes = nodes_.data();
    // Between the nodes the mean is trilinear: its slope along an axis is a mean of theirs.
    float square = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto most_along = static_cast<float>(
          backend.largest("steepness", lattice.total(), 0, [=] RINGLET_LAMBDA(std::int32_t k) {
            return static_cast<double>(steepness(lattice, nodes, k, axis));
          }));
      square += most_along * most_along;
    }
    slope_ = lattice.per_cell * sqrt(square);
  }

  void carry(Backend& backend, const HairPlaces<T>& places) {
    carried_.resize(places.particles);
    Place<float>* carried = carried_.data();
    const MotionLattice lattice = lattice_;
    const MotionNode* nodes = nodes_.data();
    backend.parallel_for("carry starts", places.particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      const Vector3<float> start = float_vector(places.start[p]),
                           moved = start + mean_motion(lattice, nodes, start);
      carried[p] = {moved.x, moved.y, moved.z, 0};
    });
    backend.parallel_for("how they stray", places.particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      if (places.strand[p] < 0) return;
      const Vector3<float> middle =
          0.5f * (float_vector(places.start[p]) + float_vector(places.start[p + 1]));
      const Vector3<float> of_ends = 0.5f * (vector_of(carried[p]) + vector_of(carried[p + 1]));
      carried[p].extra = length(middle + mean_motion(lattice, nodes, middle) - of_ends);
    });
  }

  MotionLattice lattice_{};
  float slope_ = 0;
  Buffer<MotionSum> sums_;
  Buffer<MotionNode> nodes_, next_;
  Buffer<Place<float>> carried_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
