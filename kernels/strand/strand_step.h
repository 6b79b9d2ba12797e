// One substep of a pack of strands: forces, linearly implicit velocity, position, lengths (Algorithm 1 of the
// AMS paper; physics.md sections 1, 2 and 4).
//
//   (1 + h G + h^2 (K + Kg) + h beta K) v^{n+1} = v^n + h (f + s^n) + (h^2 + h beta) K_ghost w^{n+1}
//   x^{n+1} = x^n + h v^{n+1}
//
// per unit mass. Assembly, factorisation and solve are one sweep: nothing larger than a window of four
// particles is assembled. Prescribed particles are eliminated.
#pragma once
#include "kernels/strand/band_solver.h"
#include "kernels/strand/couplings.h"
#include "kernels/strand/length_projection.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Scratch of one pack: per particle the factor (which the projection reuses), the new position and the new
// velocity.
inline constexpr int kStepReals = kFactorReals + 3 + 3;

template <class R>
struct RootMotion {
  Matrix3<R> rotation, turn;  // at the start; its change over the step
  Vector3<R> displacement;

  RINGLET_KERNEL Vector3<R> ghost(Vector3<R> rest) const { return rotation * rest; }
  RINGLET_KERNEL Vector3<R> ghost_after(Vector3<R> rest) const { return rotation * rest + turn * rest; }
};

// One pack's view of a StrandStep.
template <class R>
struct StrandPack {
  using T = Scalar<R>;
  const T* rest;
  const T* rest_length;
  const T* stiffness;  // or null
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
    count = load<R>(step.batches.count + batch * kLanes + lane);
    preload = load3<R>(step.batches.preload + batch * 3 * kLanes + lane, kLanes);
    const T* motion = step.roots + static_cast<std::int64_t>(batch) * kRootValues * kLanes + lane;
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
  for (int k = 0; k < 9; ++k) {
    before.m[k] = fma(from, whole.turn.m[k], whole.rotation.m[k]);
    after.m[k] = fma(to, whole.turn.m[k], whole.rotation.m[k]);
  }
  RootMotion<R> result{orthonormal(before), orthonormal(after), R(Scalar<R>(1) / parts) * whole.displacement};
  for (int k = 0; k < 9; ++k) result.turn.m[k] = result.turn.m[k] - result.rotation.m[k];
  return result;
}

// Rows of the right-hand side and the diagonal that concern particle i alone: inertia, drag, gravity, ghosts.
template <class R>
RINGLET_KERNEL void add_own_terms(BandWindow<R>& w, const StrandPack<R>& s,
                                  const StrandParameters<Scalar<R>>& p, const RootMotion<R>& root, R h,
                                  R total, int i, Vector3<R> here, Vector3<R> before, Vector3<R> velocity) {
  const Mask<R> lives = R(Scalar<R>(i)) < s.count;
  const R kappa_integrity = select(lives, s.kappa(p, i, kIntegrity), R(0));
  const R kappa_angular = select(lives, s.kappa(p, i, kAngular), R(0));
  const Vector3<R> rest = s.rest_at(i);
  const Vector3<R> to_ghost = root.ghost(rest) - here;
  const R per_h = R(1) / h;
  const Vector3<R> ghost_velocity = per_h * (root.turn * rest + root.displacement);

  // Preloaded ghost y' = y - g / kappa_I, the offset fixed in the root frame (supplement C, sign corrected).
  const Vector3<R> offset = inverse_or_zero(kappa_integrity, R(0)) * s.preload;
  const GhostTerms<R> held = integrity(to_ghost + root.rotation * offset, kappa_integrity, p.exact_integrity);
  const Vector3<R> offset_velocity = per_h * (root.turn * offset);

  const Vector3<R> gravity = {R(p.gravity[0]), R(p.gravity[1]), R(p.gravity[2])};
  Vector3<R> force = held.force + select(lives, gravity, zero3<R>());
  Vector3<R> driven = held.stiffness * (ghost_velocity + offset_velocity);
  Symmetric3<R> stiffness = held.stiffness;
  if (i > 0) {
    const GhostTerms<R> bent =
        angular(to_ghost, here - before, s.rest_length_at(i - 1, 0), kappa_angular, p.consistent_angular);
    force = force + bent.force;
    driven = driven + bent.stiffness * ghost_velocity;
    stiffness.add(bent.stiffness);
  }
  w.right = w.right + velocity + fma(h, force, total * driven);
  w.diagonal.add_identity(fma(h, R(p.drag), R(1)));
  w.diagonal.xx = fma(total, stiffness.xx, w.diagonal.xx),
  w.diagonal.xy = fma(total, stiffness.xy, w.diagonal.xy);
  w.diagonal.xz = fma(total, stiffness.xz, w.diagonal.xz),
  w.diagonal.yy = fma(total, stiffness.yy, w.diagonal.yy);
  w.diagonal.yz = fma(total, stiffness.yz, w.diagonal.yz),
  w.diagonal.zz = fma(total, stiffness.zz, w.diagonal.zz);
}

// The velocities at the end of a step h from the state in `position` and `velocity` (components `stride`
// apart), into `velocity`.
template <class R>
RINGLET_KERNEL void solve_velocities(const StrandPack<R>& s, const StrandParameters<Scalar<R>>& p,
                                     const RootMotion<R>& root, R h, const Scalar<R>* position,
                                     Scalar<R>* velocity, Scalar<R>* factor, int stride) {
  const R total = h * (h + R(p.damping));
  const ImplicitWeights<R> weights{h * h, total, h * h * R(p.geometric_stiffness)};
  const int n = s.particles;
  const auto reach_of = [n](int i) { return n - 1 - i < kBand ? n - 1 - i : kBand; };
  BandWindow<R> w;
  w.clear();
  Vector3<R> ahead[kBand + 1], before = zero3<R>();  // positions of i .. i+3
  for (int a = 0; a <= kBand; ++a)
    ahead[a] = a < n ? load3<R>(position + 3 * a * stride, stride) : zero3<R>();
  for (int i = 0; i < n; ++i) {
    const int reach = reach_of(i);
    RINGLET_UNROLL
    for (int a = 0; a < kBand; ++a) {
      if (a >= reach) continue;
      const Mask<R> joined = R(Scalar<R>(i + 1 + a)) < s.count;
      const R kappa = select(joined, s.kappa(p, i, kEdge + a), R(0));
      const SpringTerms<R> terms = spring(ahead[a + 1] - ahead[0], s.rest_length_at(i, a), kappa, weights);
      w.right = fma(h, terms.force, w.right);
      w.next_right[a] = fma(R(0) - h, terms.force, w.next_right[a]);
      w.diagonal.add(terms.block);
      w.couple(a, terms.block);
    }
    Scalar<R>* row = factor + kFactorReals * i * stride;
    if (i < p.clamped) {
      // Prescribed: its known velocity moves to the right-hand side of those it pulls on.
      const Vector3<R> rest = s.rest_at(i);
      const Vector3<R> known = (R(1) / h) * (root.turn * rest + root.displacement);
      for (int a = 0; a < reach; ++a) w.next_right[a] = w.next_right[a] - w.below[a] * known;
      store3<R>(row + 30 * stride, stride, known);
    } else {
      add_own_terms(w, s, p, root, h, total, i, ahead[0], before,
                    load3<R>(velocity + 3 * i * stride, stride));
      eliminate(w, reach, row, stride);
    }
    w.advance();
    before = ahead[0], ahead[0] = ahead[1], ahead[1] = ahead[2], ahead[2] = ahead[3];
    if (i + 1 + kBand < n) ahead[kBand] = load3<R>(position + 3 * (i + 1 + kBand) * stride, stride);
  }
  Vector3<R> later[kBand] = {zero3<R>(), zero3<R>(), zero3<R>()};
  for (int i = n - 1; i >= 0; --i) {
    const Scalar<R>* row = factor + kFactorReals * i * stride;
    const Vector3<R> v = i < p.clamped ? load3<R>(row + 30 * stride, stride)
                                       : substitute_back(later, reach_of(i), row, stride);
    store3<R>(velocity + 3 * i * stride, stride, v);
    later[2] = later[1], later[1] = later[0], later[0] = v;
  }
}

template <class R>
struct SubstepResult {
  R strain, iterations;
};

// One step h in place: velocities, positions relative to the moved root, lengths with their velocity
// correction.
template <class R>
RINGLET_KERNEL SubstepResult<R> advance_strand(const StrandPack<R>& s, const StrandParameters<Scalar<R>>& p,
                                               const RootMotion<R>& root, R h, Scalar<R>* position,
                                               Scalar<R>* velocity, Scalar<R>* factor, int stride,
                                               Mask<R> active) {
  solve_velocities(s, p, root, h, position, velocity, factor, stride);
  for (int i = 0; i < s.particles; ++i) {
    Scalar<R>* at = position + 3 * i * stride;
    Vector3<R> x =
        fma(h, load3<R>(velocity + 3 * i * stride, stride), load3<R>(at, stride) - root.displacement);
    if (i < p.clamped) x = root.ghost_after(s.rest_at(i));  // exact, without the error that sums would gather
    store3<R>(at, stride, select(R(Scalar<R>(i)) < s.count, x, zero3<R>()));
  }
  ProjectedStrand<R> lengths{position, s.rest_length, kLanes,  nullptr,  factor,
                             stride,   s.particles,   s.count, p.clamped};
  if (p.length_iterations == 0) return {eliminate_lengths(lengths), R(0)};
  // The factor is free by now: it keeps the positions before the projection, past the projection's own
  // scratch.
  Scalar<R>* unprojected = factor + kProjectionReals * s.particles * stride;
  for (int k = 0; k < 3 * s.particles; ++k) store(unprojected + k * stride, load<R>(position + k * stride));
  const ProjectionResult<R> result =
      project_lengths(lengths, R(p.length_tolerance), p.length_iterations, active);
  if (any(result.iterations > R(0))) {
    const R per_h = R(1) / h;
    for (int k = 0; k < 3 * s.particles; ++k) {
      const R moved = load<R>(position + k * stride) - load<R>(unprojected + k * stride);
      store(velocity + k * stride, fma(per_h, moved, load<R>(velocity + k * stride)));
    }
  }
  return {result.strain, result.iterations};
}

// A strand whose lengths did not come within the tolerance takes the step again in 2, 4, ... up to this many
// pieces.
inline constexpr int kMostPieces = 16;

// The substep of one pack of strands: `lane` is its first lane in the batch. `scratch` holds kStepReals
// values a particle, `stride` apart.
template <class R>
RINGLET_KERNEL void step_strands(const StrandStep<Scalar<R>>& step, int batch, int lane, Scalar<R>* scratch,
                                 int stride) {
  using T = Scalar<R>;
  const StrandPack<R> s(step, batch, lane);
  const StrandParameters<T>& p = step.parameters;
  T* position = scratch + kFactorReals * s.particles * stride;
  T* velocity = position + 3 * s.particles * stride;
  R strain = R(0), iterations = R(0), pieces = R(0);
  Mask<R> open = s.count > R(0);
  if (!any(open)) return;  // no strands here
  for (int parts = 1; parts <= kMostPieces; parts *= 2) {
    for (int k = 0; k < 3 * s.particles; ++k) {
      store(position + k * stride, load<R>(s.position + k * kLanes));
      store(velocity + k * stride, load<R>(s.velocity + k * kLanes));
    }
    R worst = R(0);
    for (int part = 0; part < parts; ++part) {
      const SubstepResult<R> result = advance_strand(s, p, piece(s.root, part, parts), R(p.step / T(parts)),
                                                     position, velocity, scratch, stride, open);
      worst = select(open, result.strain, worst);
      iterations = iterations + select(open, result.iterations, R(0));
    }
    strain = select(open, worst, strain), pieces = select(open, R(T(parts)), pieces);
    const Mask<R> late = open & (worst > R(p.length_tolerance));
    const bool last = p.length_iterations == 0 || 2 * parts > kMostPieces || !any(late);
    // Lanes that are done, or all of them at the last try, take their result; the others start again from
    // memory.
    const Mask<R> done = last ? open : open & !late;
    for (int k = 0; k < 3 * s.particles; ++k) {
      T *to_x = s.position + k * kLanes, *to_v = s.velocity + k * kLanes;
      store(to_x, select(done, load<R>(position + k * stride), load<R>(to_x)));
      store(to_v, select(done, load<R>(velocity + k * stride), load<R>(to_v)));
    }
    if (last) break;
    open = late;
  }
  R speed2 = R(0), check = R(0);  // `check` turns NaN where anything is not finite
  for (int i = 0; i < s.particles; ++i) {
    const Vector3<R> v = load3<R>(s.velocity + 3 * i * kLanes, kLanes);
    speed2 = max(speed2, dot(v, v));
    check = fma(R(0), dot(v, v), check);
  }
  store(s.figures + kStrain * kLanes, strain);
  store(s.figures + kIterations * kLanes, iterations);
  store(s.figures + kSubdivisions * kLanes, pieces);
  store(s.figures + kSpeed * kLanes, sqrt(speed2));
  const Mask<R> healthy =
      (strain <= R(p.strain_limit)) & (speed2 <= R(p.speed_limit * p.speed_limit)) & (check <= R(0));
  store(s.figures + kDiverged * kLanes, select(healthy, R(0), R(1)));
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
