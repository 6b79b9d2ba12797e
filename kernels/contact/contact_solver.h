// Hair against hair, segment by segment (physics.md section 5, the Lagrangian stage).
//
// Segments of different strands are in contact where they have passed through one another since the last
// application, or are nearer than the sum of their radii (segment_pair.h); each pass finds contacts anew
// among the pairs of neighbours and answers them (contact_response.h). What is through one another when an
// application ends is answered in the next (standing_crossings.h). Segments of one strand do not collide with
// one another. Prescribed particles are not moved: segments at the root are obstacles. What lies on a solid
// is seen as the solid will leave it (held_particles.h).
#pragma once
#include "kernels/contact/neighbours.h"
#include "kernels/contact/standing_crossings.h"
#include "kernels/contact/strand_response.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// F: the pack that tubes are compared by; R: the one that pairs are computed by.
template <class Backend, class F, class R>
class ContactSolver : public HairContacts<Scalar<R>> {
 public:
  using T = Scalar<R>;

  explicit ContactSolver(typename Backend::Lent lent) : backend_(lent) {}

  void settle(const HairContactStep<T>& step) override {
    if (settled_) return;
    settled_ = true;
    standing_.clear();
    if (pairs_.count == 0) return;
    lay_out_end(step, As::kTheyAre);
    standing_.find(backend_, pairs_, places());
    pairs_.count = 0;
  }

  HairContactFigures begin(const HairContactStep<T>& step) override {
    settled_ = false;
    HairContactFigures figures;
    pairs_.count = 0;
    number_particles(step);
    find_held(step);
    lay_out_start(step), lay_out_end(step);
    const std::int32_t found = neighbours_.find(backend_, places());
    pairs_.count = list_.make(backend_, neighbours_.a(), neighbours_.b(), found, standing_.keys(),
                              standing_.count(), particles_, kWidth);
    figures.pairs = pairs_.count;
    if (pairs_.count > 0) index_pairs();
    return figures;
  }

  std::int64_t pass(const HairContactStep<T>& step) override {
    if (pairs_.count == 0) return 0;
    lay_out_end(step);
    const std::int64_t contacts = find();
    if (contacts == 0) return 0;
    answer(step);
    write_back(step);
    return contacts;
  }

  void count_crossings(const HairContactStep<T>& step, HairContactFigures& figures) override {
    if (pairs_.count == 0) return;
    lay_out_end(step);
    find();
    const unsigned char* active = active_.data();
    const Touch<T>* touch = touch_.data();
    figures.crossings = static_cast<std::int64_t>(backend_.sum(
        "count crossings", pairs_.count,
        [=] RINGLET_LAMBDA(std::int32_t k) { return active[k] == 2 && touch[k].gap < T(0) ? 1.0 : 0.0; }));
    figures.depth = backend_.largest("depth", pairs_.count, 0, [=] RINGLET_LAMBDA(std::int32_t k) {
      return active[k] == 1 ? -static_cast<double>(touch[k].gap) : 0.0;
    });
  }

  std::int32_t kept() const override { return standing_.count(); }
  void copy_kept(std::uint64_t* to) const override { standing_.copy_to(to); }
  bool keep(const std::uint64_t* kept, std::int32_t count) override {
    const PairKey key(particles_);
    const std::int32_t* strand = strand_.data();
    for (std::int32_t k = 0; k < count; ++k) {
      const std::int32_t a = key.a(kept[k]), b = key.b(kept[k]);
      const bool there =
          kept[k] >> key.total_bits() == 0 && (kept[k] & 3) < PairKey::kFresh && a < b && b < particles_;
      if (!there || strand[a] < 0 || strand[b] < 0 || strand[a] == strand[b]) return false;
    }
    standing_.copy_from(kept, count), settled_ = true;
    return true;
  }

  std::size_t bytes() const override {
    return backend_.bytes() + first_.bytes() + strand_.bytes() + start_.bytes() + end_.bytes() +
           velocity_.bytes() + plane_.bytes() + held_.bytes() + list_first_.bytes() + list_entry_.bytes() +
           cursor_.bytes() + touch_.bytes() + record_.bytes() + active_.bytes() + list_.bytes() +
           load_.bytes() + share_.bytes() + elimination_.bytes() + kappa_.bytes() + neighbours_.bytes() +
           standing_.bytes();
  }

 private:
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;
  static constexpr int kWidth = Traits<R>::kWidth;
  static constexpr int kPackChunk = 128, kStrandChunk = 64;

  HairPlaces<T> places() const { return {start_.data(), end_.data(), strand_.data(), particles_}; }
  std::int32_t packs() const { return (pairs_.count + kWidth - 1) / kWidth; }

  void number_particles(const HairContactStep<T>& step) {
    first_.resize(step.strands + 1);
    std::int32_t* first = first_.data();
    const std::int32_t strands = step.strands;
    backend_.parallel_for("count particles", strands + 1, [=] RINGLET_LAMBDA(std::int32_t s) {
      first[s] = s < strands ? static_cast<std::int32_t>(step.batches.count[step.order[s]]) : 0;
    });
    particles_ = backend_.scan("number particles", first_, strands + 1);
    strand_.resize(particles_);
    std::int32_t* strand = strand_.data();
    backend_.parallel_for(
        "number strands", strands,
        [=] RINGLET_LAMBDA(std::int32_t s) {
          for (std::int32_t p = first[s]; p < first[s + 1]; ++p) strand[p] = p + 1 < first[s + 1] ? s : -1;
        },
        kStrandChunk);
  }

  // Where a strand has its values in the state's arrays.
  struct StrandRows {
    std::int64_t row;  // of its first particle
    std::int32_t lane;
    std::int64_t root;  // its three components are kLanes apart

    RINGLET_KERNEL StrandRows(const HairContactStep<T>& step, std::int32_t s) {
      const std::int32_t batch = step.order[s] / kLanes;
      row = step.batches.row[batch], lane = step.order[s] % kLanes;
      root = static_cast<std::int64_t>(batch) * 3 * kLanes + lane;
    }
    // The first of a particle's so many values, which are kLanes apart.
    RINGLET_KERNEL std::int64_t at(std::int32_t particle, int values) const {
      return (row + particle) * values * kLanes + lane;
    }
  };

  // Of a root point against that of the first strand: places are small numbers wherever the groom is. [3]
  RINGLET_KERNEL static Vector3<T> root_of(const HairContactStep<T>& step, const StrandRows& rows,
                                           const double* root_points) {
    const double *root = root_points + rows.root, *origin = root_points + StrandRows(step, 0).root;
    return {static_cast<T>(root[0] - origin[0]), static_cast<T>(root[kLanes] - origin[kLanes]),
            static_cast<T>(root[2 * kLanes] - origin[2 * kLanes])};
  }
  RINGLET_KERNEL static Vector3<T> value_at(const T* values) {
    return {values[0], values[kLanes], values[2 * kLanes]};
  }

  // Calls visit(particle p, where its strand's values are, root point, its number in the strand).
  template <class Visit>
  void for_particles(const char* name, const HairContactStep<T>& step, const double* root_points,
                     const Visit& visit) {
    const std::int32_t* first = first_.data();
    backend_.parallel_for(
        name, step.strands,
        [=] RINGLET_LAMBDA(std::int32_t s) {
          const StrandRows rows(step, s);
          const Vector3<T> root = root_of(step, rows, root_points);
          for (std::int32_t p = first[s], i = 0; p < first[s + 1]; ++p, ++i) visit(p, rows, root, i);
        },
        kStrandChunk);
  }

  void lay_out_start(const HairContactStep<T>& step) {
    start_.resize(particles_);
    for_particles("lay out start", step, step.start_root_points,
                  [=, start = start_.data()] RINGLET_LAMBDA(std::int32_t p, const StrandRows& rows,
                                                            Vector3<T> root, std::int32_t i) {
                    const Vector3<T> then = root + value_at(step.start + rows.at(i, 3));
                    start[p] = {then.x, then.y, then.z, i < step.clamped ? T(0) : T(1)};
                  });
  }

  RINGLET_KERNEL static Motion<T> motion_of(const HairContactStep<T>& step, const StrandRows& rows,
                                            Vector3<T> root, std::int32_t i) {
    const std::int64_t at = rows.at(i, 3);
    return {root + value_at(step.state.position + at), value_at(step.state.velocity + at)};
  }
  // The head has gone on with the roots, other solids as they went.
  RINGLET_KERNEL static HeldParticle<T> held_particle(const HairContactStep<T>& step, const StrandRows& rows,
                                                      std::int32_t i, const Place<T>& plane) {
    const T* touch = step.touches + rows.at(i, kTouchReals);
    const T home = touch[kTouchHome * kLanes];
    const Vector3<T> velocity =
        fma(home, value_at(step.state.velocity + rows.at(0, 3)), value_at(touch + kTouchVelocity * kLanes));
    return {{value_at(touch), velocity, touch[kTouchFriction * kLanes], home, touch[kTouchLoad * kLanes]},
            plane,
            step.step};
  }

  // The planes that solids hold particles in, as the state now has it.
  void find_held(const HairContactStep<T>& step) {
    if (!step.touches) return;
    plane_.resize(particles_), held_.resize(particles_);
    for_particles("find held", step, step.root_points,
                  [=, plane = plane_.data()] RINGLET_LAMBDA(std::int32_t p, const StrandRows& rows,
                                                            Vector3<T> root, std::int32_t i) {
                    plane[p] = held_particle(step, rows, i, {}).plane_of(motion_of(step, rows, root, i));
                  });
  }

  // Places and velocities as the state now has them, or as the solids will leave it.
  enum class As { kTheyAre, kHeld };
  void lay_out_end(const HairContactStep<T>& step, As as = As::kHeld) {
    end_.resize(particles_), velocity_.resize(particles_);
    Place<T>*end = end_.data(), *velocity = velocity_.data(), *held = held_.data();
    const Place<T>* plane = as == As::kHeld && step.touches ? plane_.data() : nullptr;
    for_particles(
        "lay out end", step, step.root_points,
        [=] RINGLET_LAMBDA(std::int32_t p, const StrandRows& rows, Vector3<T> root, std::int32_t i) {
          Motion<T> now = motion_of(step, rows, root, i);
          if (plane) {
            const HeldParticle<T> particle = held_particle(step, rows, i, plane[p]);
            const bool holds = particle.holds(now);
            held[p] = holds ? plane[p] : Place<T>{};
            if (holds) now = particle.seen(now);
          }
          end[p] = {now.place.x, now.place.y, now.place.z, step.radius[rows.at(i, 1)]};
          velocity[p] = {now.velocity.x, now.velocity.y, now.velocity.z, T(0)};
        });
  }

  // Which pairs each segment has.
  void index_pairs() {
    const std::int32_t pairs = pairs_.count;
    load_.resize(std::size_t{kLoads} * particles_), share_.resize(particles_),
        elimination_.resize(particles_), kappa_.resize(first_.size() - 1);
    touch_.resize(pairs + kWidth), record_.resize(pairs + kWidth), active_.resize(pairs + kWidth);
    list_first_.resize(particles_ + 1), cursor_.resize(particles_),
        list_entry_.resize(2 * static_cast<std::size_t>(pairs) + ContactLists::kPadding);
    pairs_ = {list_.a(), list_.b(), list_.side(), touch_.data(), record_.data(), active_.data(), pairs};
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
    backend_.parallel_for("pad lists", ContactLists::kPadding,
                          [=] RINGLET_LAMBDA(std::int32_t k) { entry[2 * pairs + k] = 0; });
    // In no particular order: what is summed over a list is the same in any.
    backend_.parallel_for("fill lists", pairs, [=] RINGLET_LAMBDA(std::int32_t k) {
      entry[atomic_add(&cursor[a[k]], 1)] = 2 * k, entry[atomic_add(&cursor[b[k]], 1)] = 2 * k + 1;
    });
  }

  // Returns how many contacts there are.
  std::int64_t find() {
    backend_.parallel_for("find contacts", packs(), FindContacts<R>{pairs_, places()}, kPackChunk);
    const unsigned char* active = active_.data();
    return static_cast<std::int64_t>(
        backend_.sum("count contacts", pairs_.count,
                     [=] RINGLET_LAMBDA(std::int32_t k) { return active[k] != 0 ? 1.0 : 0.0; }));
  }

  void answer(const HairContactStep<T>& step) {
    const ContactStrands<T> work{pairs_,
                                 {list_first_.data(), list_entry_.data()},
                                 first_.data(),
                                 start_.data(),
                                 end_.data(),
                                 velocity_.data(),
                                 kappa_.data(),
                                 share_.data(),
                                 elimination_.data(),
                                 load_.data(),
                                 step.clamped};
    backend_.parallel_for("respond to contacts", step.strands, FindResponse<T>{work}, kStrandChunk);
    backend_.parallel_for(
        "weigh contacts", packs(),
        WeighContacts<R>{pairs_, velocity_.data(), step.touches ? held_.data() : nullptr, step.friction},
        kPackChunk);
    backend_.parallel_for("apply contacts", step.strands, ApplyContacts<T>{work}, kStrandChunk);
  }

  // What has not been touched stays as it is, bit for bit.
  void write_back(const HairContactStep<T>& step) {
    const Place<T>*end = end_.data(), *velocity = velocity_.data(),
          *held = step.touches ? held_.data() : nullptr;
    const std::int32_t* first = first_.data();
    const double* kappa = kappa_.data();
    backend_.parallel_for(
        "hand back contacts", step.strands,
        [=] RINGLET_LAMBDA(std::int32_t s) {
          if (kappa[s] < 0) return;
          const StrandRows rows(step, s);
          const Vector3<T> root = root_of(step, rows, step.root_points);
          for (std::int32_t i = step.clamped, p = first[s] + i; p < first[s + 1]; ++p, ++i) {
            const Motion<T> was = motion_of(step, rows, root, i);
            Motion<T> now{vector_of(end[p]), vector_of(velocity[p])};
            if (held && dot(vector_of(held[p]), vector_of(held[p])) > T(0))
              now = held_particle(step, rows, i, held[p])
                        .after(was, now, step.touches[rows.at(i, kTouchReals) + kTouchLoad * kLanes]);
            const std::int64_t at = rows.at(i, 3);
            T *x = step.state.position + at, *v = step.state.velocity + at;
            const Vector3<T> moved = now.place - was.place;
            x[0] += moved.x, x[kLanes] += moved.y, x[2 * kLanes] += moved.z;
            v[0] = now.velocity.x, v[kLanes] = now.velocity.y, v[2 * kLanes] = now.velocity.z;
          }
        },
        kStrandChunk);
  }

  Backend backend_;
  Neighbours<Backend, F, R> neighbours_;
  StandingCrossings<Backend, R> standing_;
  PairList<Backend> list_;
  bool settled_ = true;  // standing_ is by how the strands are
  ContactPairs<T> pairs_{};
  std::int32_t particles_ = 0;
  Buffer<Place<T>> start_, end_, velocity_, plane_, held_;
  Buffer<std::int32_t> first_, strand_, list_first_, list_entry_, cursor_;
  Buffer<Touch<T>> touch_;
  Buffer<ContactRecord<T>> record_;
  Buffer<unsigned char> active_;
  Buffer<ParticleLoad> load_;
  Buffer<Elimination> elimination_;
  Buffer<double> kappa_, share_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
