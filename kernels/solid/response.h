// Hair-solid collision of one pack of strands at the end of a substep (AMS paper 3.3; physics.md section 6).
//
// A particle found inside at x + h v first loses the part of its velocity that goes into the solid, with
// Coulomb friction:    v' = v_solid + max(0, 1 - mu |u_n| / |u_t|) u_t,   u = v - v_solid and moves to x + h
// v'; if that is still inside it is pushed out along the normal (the paper's sign pushes deeper). Lengths and
// contacts are then projected in turn, the contact last, until both hold or the cap is met. A particle that
// travels farther than the narrow band in one substep is looked for along its way, though a solid thinner
// than the travel but within the band can still be passed.
#pragma once
#include "kernels/solid/surface.h"
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

template <class T>
struct ContactStep {
  StrandBatches<T> batches;
  StrandState<T> state;
  const double* root_points;  // [batches][3] root points at the substep's end, in the world [m]
  const T* collides;  // [batches] 1 where the strand collides, 0 where it is left alone (buried roots)
  const SolidView* solids;
  std::int32_t solid_count;
  T step;  // h [s]
  std::int32_t clamped;
  std::int32_t rounds;             // cap on the alternation of length and contact projections
  std::int32_t length_iterations;  // 0: lengths are not projected
  T length_tolerance;
  T* figures;      // [batches][kContactFigures]: 1 where a solid moved the strand, largest strain left [-],
                   // last push-out [m], rounds, particles swept, largest speed [m/s], 1 where diverged or not
                   // finite
  T strain_limit;  // a strand that a solid moved beyond either limit counts as diverged
  T speed_limit;   // [m/s]
  std::int32_t skipped_substeps;  // since lengths were last projected: their displacement took all of these
};

inline namespace RINGLET_ISA {

inline constexpr int kContactReals = 3 + 3 + 3 + kProjectionReals;  // position, velocity, normal, projection

// Push-outs under this [m] do not ask for another round.
template <class T>
RINGLET_FUNCTION T settled_push() {
  return T(2e-6);
}

// One lane's strand against one solid.
template <class T>
struct LaneContact {
  const SolidView& solid;
  Vector3<T> root;  // root point in level-set axes, relative to their origin
  T step;
  T voxel, band;  // [m]

  RINGLET_FUNCTION LaneContact(const SolidView& s, const double* root_point, T h)
      : solid(s),
        step(h),
        voxel(static_cast<T>(s.level_set[0].voxel_size)),
        band(static_cast<T>(s.level_set[0].background)) {
    const double away[3] = {root_point[0] - s.translation[0], root_point[kLanes] - s.translation[1],
                            root_point[2 * kLanes] - s.translation[2]};
    const auto along = [&](int axis) {
      return static_cast<T>(s.rotation[axis] * away[0] + s.rotation[3 + axis] * away[1] +
                            s.rotation[6 + axis] * away[2]);
    };
    root = {along(0), along(1), along(2)};
  }

  // `x` relative to the root point, world axes.
  RINGLET_FUNCTION SurfaceSample<T> sample(Vector3<T> x) const {
    return sample_surface(solid, root + rotate_back(solid.rotation, x));
  }
  // The same where only what is well inside matters: outside the level set's word is enough.
  RINGLET_FUNCTION SurfaceSample<T> sample_inside(Vector3<T> x) const {
    return sample_surface(solid, root + rotate_back(solid.rotation, x), T(0));
  }
  RINGLET_FUNCTION Vector3<T> world_normal(const SurfaceSample<T>& at) const {
    return rotate(solid.rotation, at.normal);
  }

  // The velocity stage at a sample inside the solid.
  RINGLET_FUNCTION Vector3<T> respond(const SurfaceSample<T>& at, Vector3<T> normal, Vector3<T> v) const {
    const Vector3<T> solid_velocity = (T(1) / step) * surface_displacement(solid, at);
    const Vector3<T> u = v - solid_velocity;
    const T along = dot(u, normal);
    if (along > T(0)) return v;  // separating
    const Vector3<T> tangential = fma(-along, normal, u);
    const T slip = length(tangential);
    const T keep =
        max(T(0), fma(static_cast<T>(solid.friction) * along, inverse_or_zero(slip, T(1e-12)), T(1)));
    return fma(keep, tangential, solid_velocity);
  }

  // The first place inside the solid on the way to x, looked for in steps of half the band; x itself where
  // none is.
  RINGLET_FUNCTION Vector3<T> first_inside(Vector3<T> x, Vector3<T> travel, T distance) const {
    constexpr int kMostProbes = 256;
    const int probes = static_cast<int>(min(T(kMostProbes), T(2) * distance / band)) + 1;
    for (int k = 1; k < probes; ++k) {
      const Vector3<T> on_way = fma(static_cast<T>(k) / static_cast<T>(probes) - T(1), travel, x);
      const SurfaceSample<T> at = sample(on_way);
      if (at.distance < T(0)) return on_way;
    }
    return x;
  }
};

template <class T>
struct LaneFigures {
  bool touched = false;
  T pushed = T(0);  // largest push-out of the last round
  int swept = 0;
};

// The velocity and push-out stages for one particle; true where it touched.
template <class T>
RINGLET_FUNCTION bool collide_particle(const LaneContact<T>& contact, Vector3<T>& x, Vector3<T>& v,
                                       Vector3<T>& normal, LaneFigures<T>& figures) {
  // Relative to the solid's own motion: a solid that sweeps over resting hair is as fast as hair that flies
  // into it.
  SurfaceSample<T> at = contact.sample(x);
  if (!(at.distance < T(0))) {
    const SolidView& s = contact.solid;
    const Vector3<T> shift = {static_cast<T>(s.translation[0] - s.translation_before[0]),
                              static_cast<T>(s.translation[1] - s.translation_before[1]),
                              static_cast<T>(s.translation[2] - s.translation_before[2])};
    const Vector3<T> travel = contact.step * v - shift;
    const T distance = length(travel);
    if (!(distance > contact.band)) return false;
    ++figures.swept;
    const Vector3<T> found = contact.first_inside(x, travel, distance);
    at = contact.sample(found);
    if (!(at.distance < T(0)) || !at.exact) return false;
    x = found;
    normal = contact.world_normal(at);
    v = contact.respond(at, normal, v);
    x = fma(-at.distance, normal, x);
    return true;
  }
  if (!at.exact) return false;
  normal = contact.world_normal(at);
  const Vector3<T> changed = contact.respond(at, normal, v);
  x = fma(contact.step, changed - v, x);
  v = changed;
  at = contact.sample(x);
  if (at.distance < T(0) && at.exact) {
    normal = contact.world_normal(at);
    x = fma(-at.distance, normal, x);
  }
  return true;
}

// A pack's strands in scratch, and one lane of it as scalars.
template <class R>
struct ContactPack {
  using T = Scalar<R>;
  T *position, *velocity, *normal, *projection;
  int stride;

  RINGLET_FUNCTION Vector3<T> get(const T* array, int particle, int lane) const {
    const T* p = array + 3 * particle * stride + lane;
    return {p[0], p[stride], p[2 * stride]};
  }
  RINGLET_FUNCTION void set(T* array, int particle, int lane, Vector3<T> a) const {
    T* p = array + 3 * particle * stride + lane;
    p[0] = a.x, p[stride] = a.y, p[2 * stride] = a.z;
  }
};

// How deep a segment may dip into the solid between its particles, in voxels: hair that lies on a round head
// is a polyline of chords. What is deeper is a thin part of the solid between two particles.
inline constexpr float kChordVoxels = 0.25f;

// Segments longer than two voxels are sampled along their length too, or fingers pass between particles: a
// sample that is inside moves both ends. The root's own segment comes out of the solid and is left alone.
template <class R, class T>
RINGLET_FUNCTION void push_segments(const ContactPack<R>& s, const LaneContact<T>& contact, int lane,
                                    int first, int count, LaneFigures<T>& figures) {
  const T allowed = static_cast<T>(kChordVoxels) * contact.voxel;
  for (int i = first; i + 1 < count; ++i) {
    Vector3<T> a = s.get(s.position, i, lane), b = s.get(s.position, i + 1, lane);
    const int pieces = static_cast<int>(min(T(64), length(b - a) / (T(2) * contact.voxel))) + 1;
    for (int k = 1; k < pieces; ++k) {
      const T t = static_cast<T>(k) / static_cast<T>(pieces);
      const SurfaceSample<T> at = contact.sample_inside(fma(t, b - a, a));
      const T depth = T(0) - at.distance - allowed;
      if (!(depth > T(0)) || !at.exact) continue;
      const Vector3<T> n = contact.world_normal(at);
      const T share = T(1) / fma(T(1) - t, T(1) - t, t * t);
      a = fma((T(1) - t) * share * depth, n, a), b = fma(t * share * depth, n, b);
      // The sample's velocity responds as a particle's: left alone it would come back faster every time.
      const Vector3<T> va = s.get(s.velocity, i, lane), vb = s.get(s.velocity, i + 1, lane);
      const Vector3<T> v = fma(t, vb - va, va), changed = contact.respond(at, n, v) - v;
      s.set(s.velocity, i, lane, fma((T(1) - t) * share, changed, va));
      s.set(s.velocity, i + 1, lane, fma(t * share, changed, vb));
      s.set(s.position, i, lane, a), s.set(s.normal, i, lane, n);
      s.set(s.position, i + 1, lane, b), s.set(s.normal, i + 1, lane, n);
      figures.touched = true;
      figures.pushed = max(figures.pushed, depth);
    }
  }
}

// Pushes out whatever is inside, without changing the particles' own velocities; notes the normals.
template <class R, class T>
RINGLET_FUNCTION void push_out(const ContactPack<R>& s, const LaneContact<T>& contact, int lane, int first,
                               int count, LaneFigures<T>& figures) {
  for (int i = first; i < count; ++i) {
    const Vector3<T> x = s.get(s.position, i, lane);
    const SurfaceSample<T> at = contact.sample(x);
    if (!(at.distance < T(0)) || !at.exact) continue;
    const Vector3<T> n = contact.world_normal(at);
    s.set(s.position, i, lane, fma(-at.distance, n, x));
    s.set(s.normal, i, lane, n);
    figures.touched = true;
    figures.pushed = max(figures.pushed, -at.distance);
  }
}

template <class R>
struct ContactLane {
  using T = Scalar<R>;
  const ContactStep<T>& step;
  const ContactPack<R>& pack;
  int batch, lane;  // lane within the batch
  int in_pack;      // lane within the pack
  int count;

  RINGLET_FUNCTION int first() const { return step.clamped > 1 ? step.clamped : 1; }
  RINGLET_FUNCTION LaneContact<T> against(int solid) const {
    return LaneContact<T>(step.solids[solid],
                          step.root_points + static_cast<std::int64_t>(batch) * 3 * kLanes + lane, step.step);
  }
  RINGLET_FUNCTION void collide(LaneFigures<T>& figures) const {
    for (int solid = 0; solid < step.solid_count; ++solid) {
      const LaneContact<T> contact = against(solid);
      for (int i = first(); i < count; ++i) {
        Vector3<T> x = pack.get(pack.position, i, in_pack), v = pack.get(pack.velocity, i, in_pack), n;
        if (!collide_particle(contact, x, v, n, figures)) continue;
        figures.touched = true;
        pack.set(pack.position, i, in_pack, x), pack.set(pack.velocity, i, in_pack, v),
            pack.set(pack.normal, i, in_pack, n);
      }
      push_segments(pack, contact, in_pack, first(), count, figures);
    }
  }
  // Segments too in the early rounds only: one that is threaded through an ear has ends on both sides, which
  // no push could reconcile with its length.
  RINGLET_FUNCTION void push(LaneFigures<T>& figures, bool segments) const {
    figures.pushed = T(0);
    for (int solid = 0; solid < step.solid_count; ++solid) {
      if (segments) push_segments(pack, against(solid), in_pack, first(), count, figures);
      push_out(pack, against(solid), in_pack, first(), count, figures);
    }
  }
};

// The contact stage of one pack; `lane` is its first lane in the batch, `scratch` holds kContactReals values
// a particle, `stride` apart.
template <class R>
RINGLET_FUNCTION void collide_strands(const ContactStep<Scalar<R>>& step, int batch, int lane,
                                      Scalar<R>* scratch, int stride) {
  using T = Scalar<R>;
  constexpr int kWidth = Traits<R>::kWidth;
  const int row = step.batches.row[batch], n = step.batches.row[batch + 1] - row;
  const std::int64_t base = static_cast<std::int64_t>(row) * 3 * kLanes + lane;
  T *x = step.state.position + base, *v = step.state.velocity + base;
  const ContactPack<R> pack{scratch, scratch + 3 * n * stride, scratch + 6 * n * stride,
                            scratch + 9 * n * stride, stride};
  for (int k = 0; k < 3 * n; ++k) {
    store(pack.position + k * stride, load<R>(x + k * kLanes));
    store(pack.velocity + k * stride, load<R>(v + k * kLanes));
    store(pack.normal + k * stride, R(0));
  }
  LaneFigures<T> figures[kWidth];
  T open[kWidth], counts[kWidth] = {}, strains[kWidth], rounds[kWidth];
  alignas(64) T open_now[kWidth], left[kWidth];
  bool any_open = false;
  const auto at_lane = [&](int l) {
    return ContactLane<R>{step, pack, batch, lane + l, l, static_cast<int>(counts[l])};
  };
  for (int l = 0; l < kWidth; ++l) {
    counts[l] = step.batches.count[batch * kLanes + lane + l];
    if (step.collides[batch * kLanes + lane + l] > T(0)) at_lane(l).collide(figures[l]);
    open[l] = figures[l].touched ? T(1) : T(0), strains[l] = T(0), rounds[l] = T(0);
    any_open = any_open || figures[l].touched;
  }
  const R count = load<R>(step.batches.count + batch * kLanes + lane);
  ProjectedStrand<R> lengths{pack.position,
                             pack.velocity,
                             R(T(1) / (step.step * T(1 + step.skipped_substeps))),
                             step.batches.rest_length + base,
                             kLanes,
                             pack.normal,
                             pack.projection,
                             stride,
                             n,
                             count,
                             step.clamped};
  for (int round = 0; any_open && step.length_iterations > 0 && round < step.rounds; ++round) {
    for (int l = 0; l < kWidth; ++l) open_now[l] = open[l];
    // In turn: along the surface, and freely, for a particle that its lengths pull off the surface.
    lengths.normal = round % 2 == 0 ? pack.normal : nullptr;
    project_lengths(lengths, R(step.length_tolerance), step.length_iterations, load<R>(open_now) > R(0));
    for (int l = 0; l < kWidth; ++l)
      if (open[l] > T(0)) at_lane(l).push(figures[l], 2 * round < step.rounds), rounds[l] += T(1);
    store(left, eliminate_lengths(lengths));
    any_open = false;
    for (int l = 0; l < kWidth; ++l) {
      if (!(open[l] > T(0))) continue;
      strains[l] = left[l];
      const bool settled =
          figures[l].pushed <= settled_push<T>() && strains[l] <= T(2) * step.length_tolerance;
      if (settled) open[l] = T(0);
      any_open = any_open || !settled;
    }
  }
  if (step.length_iterations == 0) {  // lengths are not held, but limits and figures want to know them
    store(left, eliminate_lengths(lengths));
    for (int l = 0; l < kWidth; ++l) strains[l] = left[l];
  }
  R speed2 = R(0), check = R(0);  // `check` turns NaN where anything is not finite
  for (int i = 0; i < n; ++i) {
    const Vector3<R> position = load3<R>(pack.position + 3 * i * stride, stride);
    const Vector3<R> velocity = load3<R>(pack.velocity + 3 * i * stride, stride);
    store3<R>(x + 3 * i * kLanes, kLanes, position);
    store3<R>(v + 3 * i * kLanes, kLanes, velocity);
    speed2 = max(speed2, dot(velocity, velocity));
    check = fma(R(0), dot(velocity, velocity) + dot(position, position), check);
  }
  store(left, speed2 + check);
  T* out = step.figures + static_cast<std::int64_t>(batch) * kContactFigures * kLanes + lane;
  for (int l = 0; l < kWidth; ++l) {
    out[kTouched * kLanes + l] = figures[l].touched ? T(1) : T(0);
    out[kContactStrain * kLanes + l] = strains[l];
    out[kPushed * kLanes + l] = figures[l].pushed;
    out[kRounds * kLanes + l] = rounds[l];
    out[kSwept * kLanes + l] = static_cast<T>(figures[l].swept);
    out[kContactSpeed * kLanes + l] = sqrt(left[l]);
    const bool healthy = strains[l] <= step.strain_limit && left[l] <= step.speed_limit * step.speed_limit;
    out[kContactDiverged * kLanes + l] = figures[l].touched && !healthy ? T(1) : T(0);
  }
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
