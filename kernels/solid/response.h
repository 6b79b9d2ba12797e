// Hair-solid collision of one pack of strands at the end of a substep (AMS paper 3.3; physics.md section 6):
// velocities and push-out particle by particle (contact.h), then lengths and contacts projected in turn, the
// contact last, until both hold or the cap is met.
#pragma once
#include "kernels/solid/contact.h"
#include "kernels/strand/length_projection.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {

// Written for each strand and substep, [batches][kContactFigures].
enum ContactFigure {
  kTouched,
  kContactStrain,
  kPushed,
  kRounds,
  kSwept,
  kContactSpeed,
  kContactDiverged,
  kContactFigures
};

// In the place of a triangle that a strand grows on.
enum Skin : std::int32_t {
  kNoSkin = -1,      // it grows on none
  kIgnoresHome = -2  // and does not collide with the home solid either: its root is buried in it
};

template <class T>
struct ContactStep {
  StrandBatches<T> batches;
  StrandState<T> state;
  const double* root_points;  // [batches][3] root points at the substep's end, in the world [m]
  const std::int32_t* skin;   // [batches] the triangle of solids[home] that the strand grows on, or a Skin
  const SolidView* solids;
  std::int32_t solid_count;
  std::int32_t home;  // the solid that strands grow on; -1: none
  T step;             // h [s]
  std::int32_t clamped;
  std::int32_t rounds;             // cap on the alternation of length and contact projections
  std::int32_t length_iterations;  // 0: lengths are not projected
  T length_tolerance;
  T* figures;      // [batches][kContactFigures]: 1 where a solid moved the strand, largest strain left [-],
                   // last push-out [m], rounds, particles that travelled farther than the band, largest speed
                   // [m/s], 1 where diverged or not finite
  T strain_limit;  // a strand that a solid moved beyond either limit counts as diverged
  T speed_limit;   // [m/s]
  std::int32_t skipped_substeps;  // since lengths were last projected: their displacement took all of these
  T* touches;                     // [rows][kTouchReals], see touch.h; null: nobody asks
};

inline namespace RINGLET_ISA {

// Position, velocity, touch but for its load, clearance, projection.
inline constexpr int kContactReals = 3 + 3 + kTouchLoad + 1 + kProjectionReals;

// Push-outs under this [m] do not ask for another round.
template <class T>
RINGLET_FUNCTION T settled_push() {
  return T(2e-6);
}

// Deeper than anything lies in a solid [m].
template <class T>
RINGLET_FUNCTION T far_inside() {
  return T(1e9);
}

// A pack's strands in scratch, and one lane of it as scalars.
template <class R>
struct ContactPack {
  using T = Scalar<R>;
  T *position, *velocity;
  T *normal, *surface_velocity, *friction, *home;  // where the particle has touched last
  T* clearance;  // [particles] of the solid at hand: how far outside it the particle is at least
  T* projection;
  int stride;

  RINGLET_FUNCTION Vector3<T> get(const T* array, int particle, int lane) const {
    const T* p = array + 3 * particle * stride + lane;
    return {p[0], p[stride], p[2 * stride]};
  }
  RINGLET_FUNCTION void set(T* array, int particle, int lane, Vector3<T> a) const {
    T* p = array + 3 * particle * stride + lane;
    p[0] = a.x, p[stride] = a.y, p[2 * stride] = a.z;
  }
  RINGLET_FUNCTION void set_touch(int particle, int lane, const SurfaceTouch<T>& touch) const {
    set(normal, particle, lane, touch.normal), set(surface_velocity, particle, lane, touch.velocity);
    friction[particle * stride + lane] = touch.friction, home[particle * stride + lane] = touch.home;
  }
};

// One lane's strand.
template <class R>
struct ContactLane {
  using T = Scalar<R>;
  const ContactStep<T>& step;
  const ContactPack<R>& pack;
  int batch, lane;  // lane within the batch
  int in_pack;      // lane within the pack
  int count;
  Patch skin;  // of the home solid

  RINGLET_FUNCTION int first() const { return step.clamped > 1 ? step.clamped : 1; }
  RINGLET_FUNCTION StrandContact<T> against(int solid) const {
    StrandContact<T> contact(step.solids[solid],
                             step.root_points + static_cast<std::int64_t>(batch) * 3 * kLanes + lane,
                             step.step);
    if (solid == step.home) contact.skin = skin, contact.home = T(1);
    return contact;
  }
  // Begins a walk along the strand. Roots lie on the home solid, and deeper in it only as a groom is kept
  // there. With a solid that its root is in deeper than it is long a strand does not collide at all. Hair
  // whose lengths are free comes out of anything.
  RINGLET_FUNCTION void begin(StrandContact<T>& contact) const {
    const bool lengths_held = step.length_iterations > 0 || step.skipped_substeps > 0;
    const bool home = step.home >= 0 && &contact.solid == step.solids + step.home;
    if (lengths_held && !home) contact.begin_at_root();
    T longest = T(0);
    for (int i = 1; i < count && contact.slack > T(0); ++i) longest = longest + segment_before(i);
    if (contact.slack > longest) contact.slack = far_inside<T>();
    for (int i = 1; i < first(); ++i) go_to(contact, i);
  }
  RINGLET_FUNCTION void go_to(StrandContact<T>& contact, int i) const {
    if (!(contact.slack > T(0))) return;
    contact.go_along(segment_before(i));
  }
  RINGLET_FUNCTION T segment_before(int i) const {
    const std::int64_t row = step.batches.row[batch] + i - 1;
    return step.batches.rest_length[row * 3 * kLanes + lane];
  }
  template <class Visit>
  RINGLET_FUNCTION void for_each_solid(const Visit& visit) const {
    for (int solid = 0; solid < step.solid_count; ++solid)
      if (solid != step.home || skin.triangle != kIgnoresHome) visit(against(solid));
  }

  // To be called once a substep, before what follows.
  RINGLET_FUNCTION void find_skin() {
    skin.triangle = step.skin[batch * kLanes + lane];
    if (skin.triangle < 0 || step.home < 0) return;
    const StrandContact<T> home = against(step.home);
    skin.covered = is_covered(home.solid, skin.triangle, home.root);
  }

  // How far from its root the strand reaches over the substep.
  RINGLET_FUNCTION T extent() const {
    T most = T(0);
    for (int i = 0; i < count; ++i)
      most = max(most, length(pack.get(pack.position, i, in_pack)) +
                           step.step * length(pack.get(pack.velocity, i, in_pack)));
    return most;
  }

  RINGLET_FUNCTION void collide(LaneFigures<T>& figures) const {
    const T reach = extent();
    for_each_solid([&](StrandContact<T> contact) {
      if (!contact.within_reach(reach)) return;
      begin(contact);
      for (int i = first(); i < count; ++i) {
        go_to(contact, i);
        Vector3<T> x = position(i), v = pack.get(pack.velocity, i, in_pack);
        SurfaceTouch<T> touch = last_touch(i);
        if (!collide_particle(contact, x, v, touch, clearance(i), figures)) continue;
        figures.touched = true;
        pack.set(pack.position, i, in_pack, x), pack.set(pack.velocity, i, in_pack, v);
        pack.set_touch(i, in_pack, touch);
      }
      push_segments(contact, figures);
    });
  }

  // Segments too in the early rounds only: one that is threaded through an ear has ends on both sides, which
  // no push could reconcile with its length.
  RINGLET_FUNCTION void push(LaneFigures<T>& figures, bool segments) const {
    figures.pushed = T(0);
    for_each_solid([&](StrandContact<T> contact) {
      if (segments) {
        for (int i = 0; i < count; ++i) clearance(i) = T(0) - contact.band;  // lengths have moved all
        push_segments(contact, figures);
      }
      begin(contact);
      for (int i = first(); i < count; ++i) {
        go_to(contact, i);
        push_particle(contact, i, contact.sample(position(i)), figures);
      }
    });
  }

  // Where particles that came to lie on several sheets of the home solid hold the lengths apart, as in a fold
  // of skin: those inside go to the one sheet that the strand grows on, followed from the root along the
  // strand.
  RINGLET_FUNCTION void push_to_own_sheet(LaneFigures<T>& figures) const {
    figures.pushed = T(0);
    for_each_solid([&](StrandContact<T> contact) {
      begin(contact);
      for (int i = first(); i < count; ++i) {
        go_to(contact, i);
        SurfaceSample<T> at = contact.sample(position(i));
        if (contact.skin.triangle >= 0) {
          const SurfaceSample<T> own =
              sample_sheet(contact.solid, contact.local(position(i)), contact.skin.triangle);
          contact.skin.triangle = own.triangle;
          if (at.distance + static_cast<T>(contact.solid.offset) < T(0)) at = own;
        }
        push_particle(contact, i, at, figures);
      }
    });
  }

 private:
  RINGLET_FUNCTION T& clearance(int i) const { return pack.clearance[i * pack.stride + in_pack]; }
  RINGLET_FUNCTION Vector3<T> position(int i) const { return pack.get(pack.position, i, in_pack); }
  RINGLET_FUNCTION SurfaceTouch<T> last_touch(int i) const {
    if (!step.touches) return {};
    const std::int64_t row = step.batches.row[batch] + i;
    const T* touch = step.touches + row * kTouchReals * kLanes + lane;
    return {{touch[0], touch[kLanes], touch[2 * kLanes]},
            {},
            T(0),
            touch[kTouchHome * kLanes],
            touch[kTouchLoad * kLanes]};
  }

  // Out of the solid, without a change of the particle's own velocity; notes the touch.
  RINGLET_FUNCTION void push_particle(const StrandContact<T>& contact, int i, const SurfaceSample<T>& at,
                                      LaneFigures<T>& figures) const {
    if (!(at.distance < T(0)) || !at.exact) return;
    const SurfaceTouch<T> touch = contact.touch(at);
    pack.set(pack.position, i, in_pack, fma(-at.distance, touch.normal, position(i)));
    pack.set_touch(i, in_pack, touch);
    figures.touched = true;
    figures.pushed = max(figures.pushed, -at.distance);
  }

  // Segments longer than two voxels are sampled along their length too, or fingers pass between particles: a
  // sample that is inside moves both ends. The root's own segment comes out of the solid and is left alone.
  RINGLET_FUNCTION void push_segments(StrandContact<T> contact, LaneFigures<T>& figures) const {
    const T allowed = static_cast<T>(kChordVoxels) * contact.voxel;
    begin(contact);
    for (int i = first(); i + 1 < count; ++i) {
      go_to(contact, i);
      Vector3<T> a = position(i), b = position(i + 1);
      const T along = length(b - a);
      if (clearance(i) + clearance(i + 1) > along) continue;  // distances change no faster than places
      const int pieces = static_cast<int>(min(T(64), along / (T(2) * contact.voxel))) + 1;
      for (int k = 1; k < pieces; ++k) {
        const T t = static_cast<T>(k) / static_cast<T>(pieces);
        const SurfaceSample<T> at = contact.sample_inside(fma(t, b - a, a));
        const T depth = T(0) - at.distance - allowed;
        if (!(depth > T(0)) || !at.exact) continue;
        const SurfaceTouch<T> touch = contact.touch(at);
        const T share = T(1) / fma(T(1) - t, T(1) - t, t * t);
        a = fma((T(1) - t) * share * depth, touch.normal, a), b = fma(t * share * depth, touch.normal, b);
        // The sample's velocity responds as a particle's: left alone it would come back faster every time.
        const Vector3<T> va = pack.get(pack.velocity, i, in_pack),
                         vb = pack.get(pack.velocity, i + 1, in_pack);
        const Vector3<T> v = fma(t, vb - va, va), changed = touch.respond(v) - v;
        pack.set(pack.velocity, i, in_pack, fma((T(1) - t) * share, changed, va));
        pack.set(pack.velocity, i + 1, in_pack, fma(t * share, changed, vb));
        pack.set(pack.position, i, in_pack, a), pack.set_touch(i, in_pack, touch);
        pack.set(pack.position, i + 1, in_pack, b), pack.set_touch(i + 1, in_pack, touch);
        figures.touched = true;
        figures.pushed = max(figures.pushed, depth);
      }
    }
  }
};

// Strains above this many tolerances after the last round are no matter of a few rounds more.
inline constexpr float kStuckTolerances = 10.0f;

template <class R>
struct PackContacts {
  using T = Scalar<R>;
  static constexpr int kWidth = Traits<R>::kWidth;
  const ContactStep<T>& step;
  int batch, lane, particles;
  T *x, *v;  // the state's
  R count;
  ContactPack<R> pack;
  ProjectedStrand<R> lengths;
  LaneFigures<T> figures[kWidth];
  Patch skins[kWidth];
  alignas(64) T open[kWidth], left[kWidth];

  // `first_lane` is the pack's first lane in the batch, `scratch` holds kContactReals values a particle,
  // `stride` apart.
  RINGLET_FUNCTION PackContacts(const ContactStep<T>& contact_step, int batch_number, int first_lane,
                                T* scratch, int stride)
      : step(contact_step),
        batch(batch_number),
        lane(first_lane),
        particles(step.batches.row[batch + 1] - step.batches.row[batch]),
        x(step.state.position + base()),
        v(step.state.velocity + base()),
        count(load<R>(step.batches.count + batch * kLanes + lane)),
        pack{scratch,
             scratch + 3 * particles * stride,
             scratch + 6 * particles * stride,
             scratch + 9 * particles * stride,
             scratch + 12 * particles * stride,
             scratch + 13 * particles * stride,
             scratch + 14 * particles * stride,
             scratch + 15 * particles * stride,
             stride},
        lengths{pack.position,
                pack.velocity,
                R(T(1) / (step.step * T(1 + step.skipped_substeps))),
                step.batches.rest_length + base(),
                kLanes,
                pack.normal,
                pack.projection,
                stride,
                particles,
                count,
                step.clamped} {
    for (int k = 0; k < 3 * particles; ++k) {
      store(pack.position + k * stride, load<R>(x + k * kLanes));
      store(pack.velocity + k * stride, load<R>(v + k * kLanes));
      store(pack.normal + k * stride, R(0)), store(pack.surface_velocity + k * stride, R(0));
    }
    for (int i = 0; i < particles; ++i)
      store(pack.friction + i * stride, R(0)), store(pack.home + i * stride, R(0));
  }

  RINGLET_FUNCTION std::int64_t base() const {
    return static_cast<std::int64_t>(step.batches.row[batch]) * 3 * kLanes + lane;
  }
  RINGLET_FUNCTION ContactLane<R> strand(int l) const {
    return {step,     pack, batch,
            lane + l, l,    static_cast<int>(step.batches.count[batch * kLanes + lane + l]),
            skins[l]};
  }

  // The velocity and push-out stages; lanes that touched are open.
  RINGLET_FUNCTION void collide() {
    for (int l = 0; l < kWidth; ++l) {
      ContactLane<R> one = strand(l);
      if (one.count > 0) one.find_skin(), one.collide(figures[l]);
      skins[l] = one.skin;
      open[l] = figures[l].touched ? T(1) : T(0);
    }
  }

  // Lengths and contacts in turn. With `own_sheet` contacts as in push_to_own_sheet.
  RINGLET_FUNCTION void settle(bool own_sheet) {
    for (int round = 0; round < step.rounds && any(load<R>(open) > R(0)); ++round) {
      // In turn: along the surface, and freely, for a particle that its lengths pull off the surface.
      lengths.normal = round % 2 == 0 ? pack.normal : nullptr;
      project_lengths(lengths, R(step.length_tolerance), step.length_iterations, load<R>(open) > R(0));
      for (int l = 0; l < kWidth; ++l) {
        if (!(open[l] > T(0))) continue;
        if (own_sheet)
          strand(l).push_to_own_sheet(figures[l]);
        else
          strand(l).push(figures[l], 2 * round < step.rounds);
        figures[l].rounds += T(1);
      }
      find_strains();
      for (int l = 0; l < kWidth; ++l)
        if (figures[l].pushed <= settled_push<T>() && figures[l].strain <= T(2) * step.length_tolerance)
          open[l] = T(0);
    }
  }

  // Of the open lanes.
  RINGLET_FUNCTION void find_strains() {
    store(left, eliminate_lengths(lengths));
    for (int l = 0; l < kWidth; ++l)
      if (open[l] > T(0)) figures[l].strain = left[l];
  }

  // Strands whose lengths cannot hold where contacts have put them try again on their own sheet, and keep
  // what strains less.
  RINGLET_FUNCTION void settle_stuck() {
    const T limit = static_cast<T>(kStuckTolerances) * step.length_tolerance;
    LaneFigures<T> before[kWidth];
    bool stuck = false;
    for (int l = 0; l < kWidth; ++l) {
      before[l] = figures[l];
      open[l] = open[l] > T(0) && figures[l].strain > limit && skins[l].triangle >= 0 ? T(1) : T(0);
      stuck = stuck || open[l] > T(0);
    }
    if (!stuck) return;
    for (int i = 0; i < particles; ++i) store3<R>(pack.normal + 3 * i * pack.stride, pack.stride, zero3<R>());
    alignas(64) T better[kWidth];
    for (int l = 0; l < kWidth; ++l) better[l] = open[l];
    settle(true);
    for (int l = 0; l < kWidth; ++l) {
      if (better[l] > T(0) && figures[l].strain < before[l].strain) continue;
      better[l] = T(0), figures[l].strain = before[l].strain, figures[l].pushed = before[l].pushed;
    }
    // Velocities stay as they were: what brought a particle to its sheet is a correction, not a motion.
    write_back(load<R>(better) > R(0), x, pack.position);
  }

  // No particle is faster than it has moved: against the surface that it touches, or against its root, both
  // of which move with a scene that moves. A push out of the solid is no motion, but lengths that pull back
  // what was pushed take that for one: what a solid presses would lie still at a speed. Where lengths make up
  // for several substeps, how far this one has led is not known.
  RINGLET_FUNCTION void limit_velocities() {
    if (step.skipped_substeps > 0) return;
    const Vector3<R> root = load3<R>(v, kLanes);
    for (int i = 0; i < particles; ++i) {
      const int at = 3 * i * pack.stride;
      const Vector3<R> surface = load3<R>(pack.surface_velocity + at, pack.stride),
                       own = load3<R>(pack.velocity + at, pack.stride),
                       way = load3<R>(pack.position + at, pack.stride) - load3<R>(x + 3 * i * kLanes, kLanes),
                       moved = fma(lengths.per_h, way, load3<R>(v + 3 * i * kLanes, kLanes));
      const auto slower_against = [&](Vector3<R> frame) {
        return dot(moved - frame, moved - frame) < dot(own - frame, own - frame);
      };
      // Where nothing has pushed they differ by rounding alone.
      const Mask<R> faster = slower_against(surface) | slower_against(root);
      store3<R>(pack.velocity + at, pack.stride, select(faster, moved, own));
    }
  }

  RINGLET_FUNCTION void write_back(Mask<R> chosen) {
    write_back(chosen, x, pack.position);
    write_back(chosen, v, pack.velocity);
  }
  RINGLET_FUNCTION void write_back(Mask<R> chosen, T* to, const T* from) {
    for (int i = 0; i < particles; ++i) {
      T* there = to + 3 * i * kLanes;
      const Vector3<R> changed = load3<R>(from + 3 * i * pack.stride, pack.stride);
      store3<R>(there, kLanes, select(chosen, changed, load3<R>(there, kLanes)));
    }
  }

  // A solid that jumps is not taken to go on at that speed: along the normal no faster than the particle
  // does.
  RINGLET_FUNCTION void write_touches() {
    if (!step.touches) return;
    const std::int64_t row = step.batches.row[batch];
    const Vector3<R> root = load3<R>(v, kLanes);
    for (int i = 0; i < particles; ++i) {
      const int at = 3 * i * pack.stride;
      const Vector3<R> normal = load3<R>(pack.normal + at, pack.stride),
                       surface = load3<R>(pack.surface_velocity + at, pack.stride),
                       own = load3<R>(pack.velocity + at, pack.stride);
      const R home = load<R>(pack.home + i * pack.stride);
      const Vector3<R> followed = fma(min(R(0), dot(own - surface, normal)), normal, surface);
      T* to = step.touches + (row + i) * kTouchReals * kLanes + lane;
      store3<R>(to + kTouchNormal * kLanes, kLanes, normal);
      store3<R>(to + kTouchVelocity * kLanes, kLanes, fma(R(0) - home, root, followed));
      store(to + kTouchFriction * kLanes, load<R>(pack.friction + i * pack.stride));
      store(to + kTouchHome * kLanes, home), store(to + kTouchLoad * kLanes, R(0));
    }
  }

  RINGLET_FUNCTION void write_figures() {
    R speed2 = R(0), check = R(0);  // `check` turns NaN where anything is not finite
    for (int i = 0; i < particles; ++i) {
      const Vector3<R> position = load3<R>(x + 3 * i * kLanes, kLanes),
                       velocity = load3<R>(v + 3 * i * kLanes, kLanes);
      speed2 = max(speed2, dot(velocity, velocity));
      check = fma(R(0), dot(velocity, velocity) + dot(position, position), check);
    }
    store(left, speed2 + check);
    T* out = step.figures + static_cast<std::int64_t>(batch) * kContactFigures * kLanes + lane;
    for (int l = 0; l < kWidth; ++l) {
      const LaneFigures<T>& f = figures[l];
      const bool healthy = f.strain <= step.strain_limit && left[l] <= step.speed_limit * step.speed_limit;
      out[kTouched * kLanes + l] = f.touched ? T(1) : T(0);
      out[kContactStrain * kLanes + l] = f.strain;
      out[kPushed * kLanes + l] = f.pushed;
      out[kRounds * kLanes + l] = f.rounds;
      out[kSwept * kLanes + l] = static_cast<T>(f.swept);
      out[kContactSpeed * kLanes + l] = sqrt(left[l]);
      out[kContactDiverged * kLanes + l] = f.touched && !healthy ? T(1) : T(0);
    }
  }
};

// The contact stage of one pack; `lane` is its first lane in the batch, `scratch` holds kContactReals values
// a particle, `stride` apart.
template <class R>
RINGLET_FUNCTION void collide_strands(const ContactStep<Scalar<R>>& step, int batch, int lane,
                                      Scalar<R>* scratch, int stride) {
  PackContacts<R> contacts(step, batch, lane, scratch, stride);
  contacts.collide();
  if (step.length_iterations > 0)
    contacts.settle(false), contacts.limit_velocities();
  else
    contacts.find_strains();  // lengths are not held, but limits and figures want to know them
  contacts.write_back(R(1) > R(0));
  contacts.write_touches();  // before the last resort forgets them
  if (step.length_iterations > 0) contacts.settle_stuck();
  contacts.write_figures();
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
