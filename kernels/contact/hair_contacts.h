// Hair against hair, segment by segment (physics.md section 5, the Lagrangian stage): one application.
//
// Segments of different strands are in contact where they have passed through one another since the last
// application, or are nearer than the sum of their radii (segment_pair.h); each pass finds contacts anew
// among the pairs of neighbours and answers them (contact_response.h). Segments of one strand do not collide
// with one another. Prescribed particles are not moved: segments at the root are obstacles.
#pragma once
#include "kernels/contact/neighbours.h"
#include "kernels/contact/strand_response.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// F: the pack that boxes are compared by; R: the one that pairs are computed by, or scalars on a GPU.
template <class Backend, class F, class R>
class HairContacts {
 public:
  using T = Scalar<R>;

  // `lent`: what the backend is made of.
  template <class Lent>
  explicit HairContacts(Lent lent) : backend_(lent) {}

  // Finds the pairs that passes look at.
  HairContactFigures begin(const HairContactStep<T>& step) {
    HairContactFigures figures;
    pairs_.count = 0;
    if (!lay_out(step)) return figures;
    figures.pairs = neighbours_.find(backend_, places(), strand_.data(), particles_, reach_);
    if (figures.pairs > 0) list_pairs(step, static_cast<std::int32_t>(figures.pairs));
    return figures;
  }

  // One pass, over the state as it now is.
  void pass(const HairContactStep<T>& step, HairContactFigures& figures) {
    if (pairs_.count == 0) return;
    lay_out(step);
    figures.contacts = find();
    count_left(figures);
    if (figures.contacts == 0) return;
    answer(step);
    write_back(step);
  }

  std::size_t bytes() const {
    return backend_.bytes() + start_.bytes() + end_.bytes() + velocity_.bytes() + strand_.bytes() +
           contacts_.bytes() + list_first_.bytes() + list_entry_.bytes() + cursor_.bytes() + record_.bytes() +
           active_.bytes() + load_.bytes() + kappa_.bytes() + neighbours_.bytes();
  }

 private:
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;
  static constexpr int kWidth = Traits<R>::kWidth;
  static constexpr int kPackChunk = 128, kStrandChunk = 64;

  HairPlaces<T> places() const { return {start_.data(), end_.data()}; }
  std::int32_t packs() const { return (pairs_.count + kWidth - 1) / kWidth; }

  // The mean of the root points, so that places are small numbers wherever one strand has got to; [3].
  void find_origin(const HairContactStep<T>& step, const double* points, double* origin) {
    const T* count = step.batches.count;
    const std::int32_t strands = step.batches.batches * kLanes;
    const double there = backend_.sum(
        "count strands", strands, [=] RINGLET_LAMBDA(std::int32_t s) { return count[s] > T(0) ? 1.0 : 0.0; });
    for (int c = 0; c < 3; ++c) {
      const double sum = backend_.sum("origin", strands, [=] RINGLET_LAMBDA(std::int32_t s) {
        constexpr double kMicrometres = 1.5 * 4294967296.0;  // rounds as summable() does, to 2^-20
        const double point = points[(static_cast<std::int64_t>(s / kLanes) * 3 + c) * kLanes + s % kLanes];
        return count[s] > T(0) ? (point + kMicrometres) - kMicrometres : 0.0;
      });
      origin[c] = there > 0 ? sum / there : 0;
    }
  }

  // A place as state and root points have it.
  RINGLET_KERNEL static Place<T> place_of(const T* position, const double* root, const double* origin) {
    return {position[0] + static_cast<T>(root[0] - origin[0]),
            position[kLanes] + static_cast<T>(root[kLanes] - origin[1]),
            position[2 * kLanes] + static_cast<T>(root[2 * kLanes] - origin[2]), T(0)};
  }

  // Places and velocities of particles; false where there is no pair of strands to speak of.
  bool lay_out(const HairContactStep<T>& step) {
    find_origin(step, step.root_points, origin_.now),
        find_origin(step, step.start_root_points, origin_.start);
    particles_ = step.row_count * kLanes;
    start_.resize(particles_), end_.resize(particles_), velocity_.resize(particles_);
    strand_.resize(particles_);
    Place<T>*start = start_.data(), *end = end_.data(), *velocity = velocity_.data();
    std::int32_t* strand = strand_.data();
    const Origins origin = origin_;
    backend_.parallel_for(
        "lay out contacts", step.batches.batches * kLanes,
        [=] RINGLET_LAMBDA(std::int32_t s) {
          const std::int32_t batch = s / kLanes, lane = s % kLanes;
          const auto count = static_cast<std::int32_t>(step.batches.count[s]);
          const double *root = step.root_points + static_cast<std::int64_t>(batch) * 3 * kLanes + lane,
                       *first = step.start_root_points + static_cast<std::int64_t>(batch) * 3 * kLanes + lane;
          for (std::int32_t row = step.batches.row[batch]; row < step.batches.row[batch + 1]; ++row) {
            const std::int32_t p = row * kLanes + lane, i = row - step.batches.row[batch];
            strand[p] = i + 1 < count ? s : -1;
            if (i >= count) continue;
            const std::int64_t at = static_cast<std::int64_t>(row) * 3 * kLanes + lane;
            start[p] = place_of(step.start + at, first, origin.start);
            end[p] = place_of(step.state.position + at, root, origin.now);
            start[p].extra = i < step.clamped ? T(0) : T(1), end[p].extra = step.radius[p];
            const T* v = step.state.velocity + at;
            velocity[p] = {v[0], v[kLanes], v[2 * kLanes], T(0)};
          }
        },
        kStrandChunk);
    const T* radius = step.radius;
    const double largest = backend_.largest("radius", particles_, -1, [=] RINGLET_LAMBDA(std::int32_t p) {
      return strand[p] < 0
                 ? -1.0
                 : static_cast<double>(radius[p] < radius[p + kLanes] ? radius[p + kLanes] : radius[p]);
    });
    reach_ = static_cast<T>(2 * largest);
    return largest >= 0;
  }

  // Which pairs each segment has.
  void list_pairs(const HairContactStep<T>& step, std::int32_t pairs) {
    load_.resize(particles_), kappa_.resize(step.batches.batches * kLanes);
    record_.resize(pairs + kWidth), active_.resize(pairs + kWidth), contacts_.resize(particles_);
    list_first_.resize(particles_ + 1), cursor_.resize(particles_),
        list_entry_.resize(2 * static_cast<std::size_t>(pairs));
    pairs_ = {neighbours_.a(), neighbours_.b(), record_.data(), active_.data(), contacts_.data(), pairs};
    std::int32_t *first = list_first_.data(), *cursor = cursor_.data(), *entry = list_entry_.data();
    const std::int32_t *a = pairs_.a, *b = pairs_.b;
    backend_.parallel_for("clear lists", particles_ + 1,
                          [=] RINGLET_LAMBDA(std::int32_t p) { first[p] = 0; });
    backend_.parallel_for("count lists", pairs, [=] RINGLET_LAMBDA(std::int32_t k) {
      atomic_add(&first[a[k]], 1), atomic_add(&first[b[k]], 1);
    });
    backend_.scan("start lists", list_first_, particles_ + 1);
    backend_.parallel_for("copy lists", particles_,
                          [=] RINGLET_LAMBDA(std::int32_t p) { cursor[p] = first[p]; });
    // In no particular order: what is summed over a list is the same in any.
    backend_.parallel_for("fill lists", pairs, [=] RINGLET_LAMBDA(std::int32_t k) {
      entry[atomic_add(&cursor[a[k]], 1)] = 2 * k, entry[atomic_add(&cursor[b[k]], 1)] = 2 * k + 1;
    });
    // Packs read beyond the last pair.
    std::int32_t *pad_a = neighbours_.a(), *pad_b = neighbours_.b();
    backend_.parallel_for("pad pairs", 1, [=] RINGLET_LAMBDA(std::int32_t) {
      for (std::int32_t k = pairs; k < pairs + kWidth; ++k) pad_a[k] = pad_a[0], pad_b[k] = pad_b[0];
    });
  }

  // Returns how many contacts there are.
  std::int64_t find() {
    std::int32_t* contacts = contacts_.data();
    backend_.parallel_for("clear contacts", particles_,
                          [=] RINGLET_LAMBDA(std::int32_t p) { contacts[p] = 0; });
    backend_.parallel_for("find contacts", packs(), FindContacts<R>{pairs_, places(), reach_}, kPackChunk);
    return static_cast<std::int64_t>(backend_.sum(
               "count contacts", particles_,
               [=] RINGLET_LAMBDA(std::int32_t p) { return static_cast<double>(contacts[p]); })) /
           2;
  }

  void answer(const HairContactStep<T>& step) {
    const std::int32_t strands = step.batches.batches * kLanes;
    const ContactStrands<T> work{pairs_,           {list_first_.data(), list_entry_.data()},
                                 step.batches.row, step.batches.count,
                                 start_.data(),    end_.data(),
                                 velocity_.data(), load_.data(),
                                 kappa_.data(),    step.clamped};
    backend_.parallel_for("respond to contacts", strands, FindResponse<T>{work}, kStrandChunk);
    backend_.parallel_for("weigh contacts", packs(),
                          WeighContacts<R>{pairs_, velocity_.data(), step.friction}, kPackChunk);
    backend_.parallel_for("apply contacts", strands, ApplyContacts<T>{work}, kStrandChunk);
  }

  void count_left(HairContactFigures& figures) {
    const unsigned char* active = active_.data();
    const ContactRecord<T>* record = record_.data();
    figures.crossings = static_cast<std::int64_t>(backend_.sum(
        "count crossings", pairs_.count,
        [=] RINGLET_LAMBDA(std::int32_t k) { return active[k] == 2 && record[k].gap < T(0) ? 1.0 : 0.0; }));
    figures.depth = backend_.largest("depth", pairs_.count, 0, [=] RINGLET_LAMBDA(std::int32_t k) {
      return active[k] == 1 ? -static_cast<double>(record[k].gap) : 0.0;
    });
  }

  // What has not been touched stays as it is, bit for bit.
  void write_back(const HairContactStep<T>& step) {
    const Place<T>*end = end_.data(), *velocity = velocity_.data();
    const Origins origin = origin_;
    backend_.parallel_for(
        "hand back contacts", step.batches.batches * kLanes,
        [=] RINGLET_LAMBDA(std::int32_t s) {
          const std::int32_t batch = s / kLanes, lane = s % kLanes;
          const auto count = static_cast<std::int32_t>(step.batches.count[s]);
          const double* root = step.root_points + static_cast<std::int64_t>(batch) * 3 * kLanes + lane;
          for (std::int32_t i = step.clamped; i < count; ++i) {
            const std::int32_t row = step.batches.row[batch] + i, p = row * kLanes + lane;
            T* x = step.state.position + static_cast<std::int64_t>(row) * 3 * kLanes + lane;
            T* v = step.state.velocity + static_cast<std::int64_t>(row) * 3 * kLanes + lane;
            const Place<T> before = place_of(x, root, origin.now);
            x[0] += end[p].x - before.x, x[kLanes] += end[p].y - before.y,
                x[2 * kLanes] += end[p].z - before.z;
            v[0] = velocity[p].x, v[kLanes] = velocity[p].y, v[2 * kLanes] = velocity[p].z;
          }
        },
        kStrandChunk);
  }

  struct Origins {
    double now[3], start[3];
  };

  Backend backend_;
  Neighbours<Backend, F, R> neighbours_;
  ContactPairs<T> pairs_{};
  std::int32_t particles_ = 0;
  T reach_ = T(0);
  Origins origin_{};
  Buffer<Place<T>> start_, end_, velocity_;
  Buffer<std::int32_t> strand_, contacts_, list_first_, list_entry_, cursor_;
  Buffer<ContactRecord<T>> record_;
  Buffer<unsigned char> active_;
  Buffer<ParticleLoad> load_;
  Buffer<double> kappa_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
