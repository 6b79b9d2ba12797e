// One substep of a pack of strands: forces, linearly implicit velocity, position, lengths (Algorithm 1 of the
// AMS paper; physics.md sections 1, 2 and 4).
//
//   (1 + h G + h^2 (K + Kg) + h beta K) v^{n+1} = v^n + h (f + s^n) + (h^2 + h beta) K_ghost w^{n+1}
//   x^{n+1} = x^n + h v^{n+1}
//
// per unit mass. Assembly and factorisation are one sweep, back substitution and advance the other: nothing
// larger than a window of four particles is assembled. Prescribed particles are eliminated.
#pragma once
#include "kernels/strand/air_drag.h"
#include "kernels/strand/band_solver.h"
#include "kernels/strand/couplings.h"
#include "kernels/strand/elongation.h"
#include "kernels/strand/length_projection.h"
#include "kernels/strand/step_lengths.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Scratch of one pack: per particle the factor, the new position, the new velocity and what lengths need.
inline constexpr int kStepReals = kFactorReals + 3 + 3 + 3 + kStepLengthReals;

template <class R>
struct RootMotion {
  Matrix3<R> rotation, turn;  // at the start; its change over the step
  Vector3<R> displacement;

  RINGLET_KERNEL Vector3<R> ghost_after(Vector3<R> rest) const { return rotation * rest + turn * rest; }
};

// What a step may leave out; compiled once for each choice, so that what is left out costs nothing.
template <bool kWithAir, bool kWithElongation>
struct Extras {
  static constexpr bool kAir = kWithAir, kElongation = kWithElongation;
};

// One pack's view of a StrandStep.
template <class R>
struct StrandPack {
  using T = Scalar<R>;
  const T* rest;
  const T* rest_length;
  const T* stiffness;  // or null
  const T* air;        // or null
  T* memory;           // of the elongation, or null
  T* position;
  T* velocity;
  int particles;
  R count;
  Vector3<R> preload;  // -g in the root frame
  RootMotion<R> root;
  T* figures;

  RINGLET_KERNEL StrandPack(const StrandStep<T>& step, int batch, int lane) {
    const std::int64_t row = step.batches.row[batch];
    particles = step.batches.row[batch + 1] - static_cast<int>(row);
    const std::int64_t base = row * 3 * kLanes + lane;
    rest = step.batches.rest + base, rest_length = step.batches.rest_length + base;
    position = step.state.position + base, velocity = step.state.velocity + base;
    stiffness = step.batches.stiffness ? step.batches.stiffness + row * kCouplings * kLanes + lane : nullptr;
    air = step.air.velocity ? step.air.velocity + base : nullptr;
    memory = step.elongation.memory ? step.elongation.memory + row * kLanes + lane : nullptr;
    count = load<R>(step.batches.count + batch * kLanes + lane);
    preload = load3<R>(step.batches.preload + batch * 3 * kLanes + lane, kLanes);
    const T* motion = step.roots + static_cast<std::int64_t>(batch) * kRootValues * kLanes + lane;
    RINGLET_UNROLL
    for (int k = 0; k < 9; ++k) {
      root.rotation.m[k] = load<R>(motion + k * kLanes), root.turn.m[k] = load<R>(motion + (9 + k) * kLanes);
    }
    root.displacement = load3<R>(motion + 18 * kLanes, kLanes);
    figures = step.figures + static_cast<std::int64_t>(batch) * kFigures * kLanes + lane;
  }

  RINGLET_KERNEL Vector3<R> rest_at(int i) const { return load3<R>(rest + 3 * i * kLanes, kLanes); }
  RINGLET_KERNEL R rest_length_at(int i, int a) const { return load<R>(rest_length + (3 * i + a) * kLanes); }
  RINGLET_KERNEL R kappa(const StrandParameters<T>& p, int i, int coupling) const {
    return stiffness ? load<R>(stiffness + (kCouplings * i + coupling) * kLanes) : R(p.stiffness[coupling]);
  }
};

// The root's motion over the `part`-th of `parts` equal pieces of the step. Rotations in between are
// interpolated entry by entry and made orthonormal again.
template <class R>
RINGLET_KERNEL Matrix3<R> orthonormal(const Matrix3<R>& a) {
  Vector3<R> x = {a.m[0], a.m[3], a.m[6]}, y = {a.m[1], a.m[4], a.m[7]};
  x = inverse_or_zero(length(x), shortest_direction<R>()) * x;
  y = fma(R(0) - dot(x, y), x, y);
  y = inverse_or_zero(length(y), shortest_direction<R>()) * y;
  const Vector3<R> z = cross(x, y);
  return {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}};
}
template <class R>
RINGLET_KERNEL RootMotion<R> piece(const RootMotion<R>& whole, int part, int parts) {
  if (parts == 1) return whole;
  const R from = R(Scalar<R>(part) / parts), to = R(Scalar<R>(part + 1) / parts);
  Matrix3<R> before, after;
  RINGLET_UNROLL
  for (int k = 0; k < 9; ++k) {
    before.m[k] = fma(from, whole.turn.m[k], whole.rotation.m[k]);
    after.m[k] = fma(to, whole.turn.m[k], whole.rotation.m[k]);
  }
  RootMotion<R> result{orthonormal(before), orthonormal(after), R(Scalar<R>(1) / parts) * whole.displacement};
  RINGLET_UNROLL
  for (int k = 0; k < 9; ++k) result.turn.m[k] = result.turn.m[k] - result.rotation.m[k];
  return result;
}

// What the ghosts do over a step: where they are at its start, and their mean velocities.
template <class R>
struct GhostMotion {
  Matrix3<R> rotation, turn_rate;  // turn_rate [1/s]
  Vector3<R> root_velocity;        // [m/s]
  Vector3<R> weight,
      weight_rate;  // the preload in the world, kappa_I (y' - y) [m/s^2], and its change [m/s^3]

  RINGLET_KERNEL GhostMotion(const RootMotion<R>& root, Vector3<R> preload, R per_h)
      : rotation(root.rotation) {
    RINGLET_UNROLL
    for (int k = 0; k < 9; ++k) turn_rate.m[k] = per_h * root.turn.m[k];
    root_velocity = per_h * root.displacement;
    weight = rotation * preload, weight_rate = turn_rate * preload;
  }
  RINGLET_KERNEL Vector3<R> velocity(Vector3<R> rest) const {
    return turn_rate.times_plus(rest, root_velocity);
  }
};

// A strand's positions and velocities, components `stride` apart.
template <class R>
struct StrandArrays {
  Scalar<R>*position, *velocity;
  int stride;

  RINGLET_KERNEL Vector3<R> position_at(int i) const { return load3<R>(position + 3 * i * stride, stride); }
  RINGLET_KERNEL Vector3<R> velocity_at(int i) const { return load3<R>(velocity + 3 * i * stride, stride); }
  RINGLET_KERNEL void put(int i, Vector3<R> x, Vector3<R> v) const {
    store3<R>(position + 3 * i * stride, stride, x);
    store3<R>(velocity + 3 * i * stride, stride, v);
  }
};

// Rows of the right-hand side and the diagonal that the air on the segments before and after a particle adds.
template <class R>
RINGLET_KERNEL void add_drag(BandWindow<R>& w, const DragTerms<R>& drag, R h) {
  Symmetric3<R> block = drag.block;
  block.scale(h);
  w.diagonal.add(block);
  w.right = fma(h, drag.pull, w.right);
}

// The elongation that this step's integrity is taken at, into the memory.
template <class R>
RINGLET_KERNEL void remember_elongation(const StrandPack<R>& s, const StrandStep<Scalar<R>>& step, int batch,
                                        int lane) {
  const R per_length = load<R>(step.batches.per_length + batch * kLanes + lane);
  for (int i = 0; i < s.particles; ++i) {
    const Vector3<R> here = load3<R>(s.position + 3 * i * kLanes, kLanes);
    const R now = per_length * length(s.root.rotation * s.rest_at(i) - here);
    const R largest = step.elongation.permanent ? max(load<R>(s.memory + i * kLanes), now) : now;
    store(s.memory + i * kLanes, select(R(Scalar<R>(i)) < s.count, largest, R(0)));
  }
}

template <class R>
RINGLET_KERNEL void add_coupling(BandWindow<R>& w, const GhostTerms<R>& terms, Vector3<R> ghost_velocity, R h,
                                 R total) {
  const R along = total * terms.stiffness;
  w.right = fma(h, terms.force, fma(along * dot(terms.direction, ghost_velocity), terms.direction, w.right));
  w.diagonal.add_outer(along, terms.direction);
}

// Rows of the right-hand side and the diagonal that concern particle i alone: inertia, drag, gravity, ghosts.
// `segment` comes from the particle before.
template <class Extra, class R>
RINGLET_KERNEL void add_own_terms(BandWindow<R>& w, const StrandPack<R>& s, const StrandStep<Scalar<R>>& step,
                                  const GhostMotion<R>& ghosts, R h, R total, int i, Vector3<R> here,
                                  Vector3<R> velocity, Vector3<R> segment, R segment_length) {
  const StrandParameters<Scalar<R>>& p = step.parameters;
  const Mask<R> lives = R(Scalar<R>(i)) < s.count;
  R kappa = select(lives, s.kappa(p, i, kIntegrity), R(0));
  const Vector3<R> rest = s.rest_at(i);
  const Vector3<R> to_ghost = ghosts.rotation * rest - here;
  const Vector3<R> ghost_velocity = ghosts.velocity(rest);

  // Preloaded ghost y' = y - g / kappa_I, the offset fixed in the root frame (supplement C, sign corrected),
  // so that kappa_I (y' - x) = kappa_I (y - x) + weight.
  const Mask<R> held = kappa > R(0);
  Vector3<R> weight = select(held, ghosts.weight, zero3<R>());
  Vector3<R> weight_rate = select(held, ghosts.weight_rate, zero3<R>());
  if constexpr (Extra::kElongation) {
    const R share = secant(step.elongation.curve, load<R>(s.memory + i * kLanes));
    kappa = share * kappa, weight = share * weight, weight_rate = share * weight_rate;
  }
  const Vector3<R> gravity = {R(p.gravity[0]), R(p.gravity[1]), R(p.gravity[2])};
  Vector3<R> force = select(lives, gravity, zero3<R>());
  w.diagonal.add_identity(fma(h, R(p.drag), R(1)));
  w.right = w.right + velocity;
  if (p.exact_integrity) {
    force = fma(kappa, to_ghost, force + weight);
    w.diagonal.add_identity(total * kappa);
    w.right = fma(total, fma(kappa, ghost_velocity, weight_rate), w.right);
  } else {
    const R per_kappa = inverse_or_zero(kappa, R(0));
    add_coupling(w, directed_integrity(fma(per_kappa, weight, to_ghost), kappa),
                 fma(per_kappa, weight_rate, ghost_velocity), h, total);
  }
  w.right = fma(h, force, w.right);
  if (i > 0)
    add_coupling(w,
                 angular(to_ghost, segment, segment_length, s.rest_length_at(i - 1, 0),
                         s.kappa(p, i, kAngular), p.consistent_angular),
                 ghost_velocity, h, total);
}

// Assembles and eliminates the system of a step h for the velocities at its end, particle by particle.
template <class Extra, class R>
RINGLET_KERNEL void factorise(const StrandPack<R>& s, const StrandStep<Scalar<R>>& step,
                              const GhostMotion<R>& ghosts, R h, const StrandArrays<R>& from,
                              Scalar<R>* factor, int stride) {
  const StrandParameters<Scalar<R>>& p = step.parameters;
  const R total = h * (h + R(p.damping));
  const ImplicitWeights<R> weights{total, h * h * R(p.geometric_stiffness)};
  const int n = s.particles;
  BandWindow<R> w;
  w.clear();
  Vector3<R> ahead[kBand + 1], segment = zero3<R>();  // positions of i .. i+3; from i-1 to i
  R segment_length = R(0), rest_before = R(0);
  DragTerms<R> drag_before = no_drag<R>();
  RINGLET_UNROLL
  for (int a = 0; a <= kBand; ++a) ahead[a] = a < n ? from.position_at(a) : zero3<R>();
  for (int i = 0; i < n; ++i) {
    const R later = s.count - R(Scalar<R>(i + 1));  // particles after this one
    SpringTerms<R> edge;
    RINGLET_UNROLL
    for (int a = kBand - 1; a >= 0; --a) {
      const R kappa = select(later > R(Scalar<R>(a)), s.kappa(p, i, kEdge + a), R(0));
      edge = spring(ahead[a + 1] - ahead[0], s.rest_length_at(i, a), kappa, weights);
      w.right = fma(h, edge.force, w.right);
      w.next_right[a] = fma(-h, edge.force, w.next_right[a]);
      w.couple(a, edge.block);
    }
    if constexpr (Extra::kAir) {
      const R rest_after = select(later > R(0), s.rest_length_at(i, 0), R(0));
      const Vector3<R> next_velocity = i + 1 < n ? from.velocity_at(i + 1) : zero3<R>();
      const DragTerms<R> drag_after =
          segment_drag(step.air, load3<R>(s.air + 3 * i * kLanes, kLanes), ahead[1] - ahead[0], edge.length,
                       R(Scalar<R>(0.5)) * (from.velocity_at(i) + next_velocity));
      add_drag(w, particle_drag(drag_before, rest_before, drag_after, rest_after), h);
      drag_before = drag_after, rest_before = rest_after;
    }
    if (i < p.clamped) {
      // Prescribed: its known velocity moves to the right-hand side of those it pulls on.
      const Vector3<R> known = ghosts.velocity(s.rest_at(i));
      RINGLET_UNROLL
      for (int a = 0; a < kBand; ++a) w.next_right[a] = w.next_right[a] - w.below[a] * known;
    } else {
      add_own_terms<Extra>(w, s, step, ghosts, h, total, i, ahead[0], from.velocity_at(i), segment,
                           segment_length);
      eliminate(w, factor + kFactorReals * i * stride, stride);
    }
    w.advance();
    segment = ahead[1] - ahead[0], segment_length = edge.length;
    ahead[0] = ahead[1], ahead[1] = ahead[2], ahead[2] = ahead[3];
    ahead[kBand] = i + 1 + kBand < n ? from.position_at(i + 1 + kBand) : zero3<R>();
  }
}

template <class R>
struct SubstepResult {
  R strain, iterations;
};

// The strand after a step h that led to `to`, as the projection sees it. `scratch` holds kProjectionReals
// values a particle, `to.stride` apart.
template <class R>
RINGLET_KERNEL ProjectedStrand<R> stepped_strand(const StrandPack<R>& s, const StrandParameters<Scalar<R>>& p,
                                                 R h, const StrandArrays<R>& to, Scalar<R>* scratch) {
  const R per_h = R(1) / (h * R(Scalar<R>(1 + p.skipped_substeps)));
  return {to.position, to.velocity, per_h,       s.rest_length, kLanes,   nullptr,
          scratch,     to.stride,   s.particles, s.count,       p.clamped};
}

// Holds the lengths of a step h: by the step's own matrix first, what is left by masses. `last_try`: strands
// are not to try again, what is still off is laid out.
template <class Chain, class R>
RINGLET_KERNEL SubstepResult<R> hold_step_lengths(const StrandPack<R>& s,
                                                  const StrandParameters<Scalar<R>>& p, R h,
                                                  const Chain& chain, Mask<R> active, bool last_try) {
  const R tolerance = R(p.length_tolerance);
  const ProjectedStrand<R>& lengths = chain.lengths;
  const R total = h * (h + R(p.damping));
  const auto stiffness = [&](int segment) { return total * s.kappa(p, segment, kEdge); };
  R strain = eliminate_lengths(lengths), iterations = R(0);
  Mask<R> open = active & (strain > tolerance);
  int corrections = 0;
  const int most = p.lengths_in_step ? kStepCorrections : 0;
  for (; corrections < most && corrections < p.length_iterations && any(open); ++corrections) {
    correct_lengths(chain, open, stiffness);
    strain = eliminate_lengths(lengths);
    iterations = iterations + select(open, R(1), R(0));
    open = open & (strain > tolerance);
  }
  if (any(open)) {
    const ProjectionResult<R> rest = project_lengths(lengths, tolerance, p.length_iterations, open);
    strain = rest.strain, iterations = iterations + rest.iterations;
  }
  const Mask<R> late = open & (strain > tolerance);
  if (last_try && p.length_iterations > 0 && any(late)) {
    lay_out_lengths(lengths, late);
    strain = eliminate_lengths(lengths);
  }
  return {strain, iterations};
}

// A strand whose lengths did not come within the tolerance takes the step again in 2, 4, ... up to this many
// pieces; in the last of these tries lengths that are still off are laid out.
inline constexpr int kMostPieces = 16;

// Moves the lanes that are `done` from scratch to the state. Returns their largest squared speed, NaN where
// anything is not finite.
template <class R>
RINGLET_KERNEL R write_back(const StrandArrays<R>& from, const StrandArrays<R>& to, int particles,
                            Mask<R> done) {
  R speed2 = R(0), check = R(0);  // `check` turns NaN where anything is not finite
  for (int i = 0; i < particles; ++i) {
    const Vector3<R> x = from.position_at(i), v = from.velocity_at(i);
    store3<R>(to.position + 3 * i * to.stride, to.stride, select(done, x, to.position_at(i)));
    store3<R>(to.velocity + 3 * i * to.stride, to.stride, select(done, v, to.velocity_at(i)));
    const R square = dot(v, v);
    speed2 = max(speed2, square);
    check = fma(R(0), square, check);
  }
  return speed2 + check;
}

// How an AMS strand takes a step.
template <class Extra, class R>
struct AugmentedMassSpring {
  using T = Scalar<R>;
  using Arrays = StrandArrays<R>;
  const StrandPack<R>& s;
  const StrandStep<T>& step;

  RINGLET_KERNEL AugmentedMassSpring(const StrandPack<R>& pack, const StrandStep<T>& whole, int batch,
                                     int lane)
      : s(pack), step(whole) {
    if constexpr (Extra::kElongation) remember_elongation(s, step, batch, lane);
  }
  RINGLET_KERNEL Arrays state() const { return {s.position, s.velocity, kLanes}; }
  RINGLET_KERNEL Arrays stepped(T* scratch, int stride) const {
    T* position = scratch + kFactorReals * s.particles * stride;
    return {position, position + 3 * s.particles * stride, stride};
  }

  // One step h from the state in `from` to that in `to` (which may be the same): velocities, positions
  // relative to the moved root, lengths with their velocity correction. `factor` is the pack's scratch.
  RINGLET_KERNEL SubstepResult<R> advance(const RootMotion<R>& root, R h, const Arrays& from,
                                          const Arrays& to, T* factor, Mask<R> active, bool last_try) const {
    const StrandParameters<T>& p = step.parameters;
    const GhostMotion<R> ghosts(root, s.preload, R(1) / h);
    const int stride = to.stride;
    factorise<Extra>(s, step, ghosts, h, from, factor, stride);
    Vector3<R> later[kBand] = {zero3<R>(), zero3<R>(), zero3<R>()};
    for (int i = s.particles - 1; i >= 0; --i) {
      Vector3<R> v, x;
      if (i < p.clamped) {
        const Vector3<R> rest = s.rest_at(i);
        v = ghosts.velocity(rest);
        x = root.ghost_after(rest);  // exact, without the error that sums would gather
      } else {
        v = substitute_back(later, factor + kFactorReals * i * stride, stride);
        x = fma(h, v, from.position_at(i) - root.displacement);
      }
      const Mask<R> lives = R(T(i)) < s.count;
      to.put(i, select(lives, x, zero3<R>()), select(lives, v, zero3<R>()));
      later[2] = later[1], later[1] = later[0], later[0] = v;
    }
    const int rows = s.particles * stride;
    T *moved = to.velocity + 3 * rows, *tension = moved + 3 * rows;
    T* projection =
        p.lengths_in_step ? tension + 3 * rows : factor;  // by masses alone nobody asks for the factor
    const TensionedChain<1, Arrays, R> chain{
        stepped_strand(s, p, h, to, projection), to, s.particles, p.clamped, factor, tension, moved};
    return hold_step_lengths(s, p, h, chain, active, last_try);
  }

  RINGLET_KERNEL R write_back(const Arrays& from, const Arrays& to, Mask<R> done) const {
    return kernels::write_back(from, to, s.particles, done);
  }
};

// The substep of one pack of strands by a model: `lane` is its first lane in the batch. `scratch` holds
// the model's values a particle, `stride` apart.
template <class Model, class R>
RINGLET_KERNEL void step_strands(const StrandStep<Scalar<R>>& step, int batch, int lane, Scalar<R>* scratch,
                                 int stride) {
  using T = Scalar<R>;
  using Arrays = typename Model::Arrays;
  const StrandPack<R> s(step, batch, lane);
  Mask<R> open = s.count > R(0);
  if (!any(open)) return;  // no strands here
  const StrandParameters<T>& p = step.parameters;
  const Model model(s, step, batch, lane);
  const Arrays stepped = model.stepped(scratch, stride), state = model.state();
  R strain = R(0), iterations = R(0), pieces = R(0), speed2 = R(0);
  for (int parts = 1; parts <= kMostPieces; parts *= 2) {
    R worst = R(0);
    for (int part = 0; part < parts; ++part) {
      const Arrays from = part == 0 ? state : stepped;
      const SubstepResult<R> result = model.advance(piece(s.root, part, parts), R(p.step / T(parts)), from,
                                                    stepped, scratch, open, 2 * parts > kMostPieces);
      worst = select(open, result.strain, worst);
      iterations = iterations + select(open, result.iterations, R(0));
    }
    strain = select(open, worst, strain), pieces = select(open, R(T(parts)), pieces);
    const Mask<R> late = open & (worst > R(p.length_tolerance));
    const bool last = p.length_iterations == 0 || 2 * parts > kMostPieces || !any(late);
    // Lanes that are done, or all of them at the last try, take their result; the others start again.
    const Mask<R> done = last ? open : open & !late;
    speed2 = select(done, model.write_back(stepped, state, done), speed2);
    if (last) break;
    open = late;
  }
  store(s.figures + kStrain * kLanes, strain);
  store(s.figures + kIterations * kLanes, iterations);
  store(s.figures + kSubdivisions * kLanes, pieces);
  store(s.figures + kSpeed * kLanes, sqrt(speed2));
  const Mask<R> healthy = (strain <= R(p.strain_limit)) & (speed2 <= R(p.speed_limit * p.speed_limit));
  store(s.figures + kDiverged * kLanes, select(healthy, R(0), R(1)));
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
