// One substep of a pack of strands of the plain mass-spring model, the baseline beside AMS (Selle et al.
// 2008; physics.md section 7). No ghosts hold the shape: springs and tetrahedra do.
//
// A chain of 2N - 1 nodes: node 2i is particle i of the hair, node 2i + 1 its companion, which stands off the
// middle of segment i, so that any four nodes in a row make a proper tetrahedron even where the hair is
// straight. Springs join nodes 1, 2 and 3 apart: `edge` where they hold the hair's segments and its
// companions to it, `bend` from companion to companion, `twist` three apart and for the altitudes. All of it
// has half-bandwidth 3 and goes through the same elimination as AMS, over a chain twice as long. The air
// drags on a companion as on its segment: it stands for hair too.
#pragma once
#include "kernels/strand/altitude.h"
#include "kernels/strand/strand_step.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Positions and velocities of the chain: the hair's and the companions'.
template <class R>
struct ChainArrays {
  StrandArrays<R> hair, companions;

  RINGLET_KERNEL const StrandArrays<R>& of(int node) const { return node % 2 ? companions : hair; }
  RINGLET_KERNEL Vector3<R> position_at(int node) const { return of(node).position_at(node / 2); }
  RINGLET_KERNEL Vector3<R> velocity_at(int node) const { return of(node).velocity_at(node / 2); }
  RINGLET_KERNEL void put(int node, Vector3<R> x, Vector3<R> v) const { of(node).put(node / 2, x, v); }
};

// Scratch of a pack, values a particle: factor, new position, new velocity and displacement of two nodes, and
// what the lengths of one segment need.
inline constexpr int kMassSpringReals = 2 * (kFactorReals + 3 + 3 + 3) + kStepLengthReals;

// How a mass-spring strand takes a step; `Extra` as for AMS, elongation excepted.
template <class Extra, class R>
struct MassSpring {
  using T = Scalar<R>;
  using Arrays = ChainArrays<R>;

  const StrandPack<R>& s;
  const StrandStep<T>& step;
  const T* rest_companion;
  T *companion_position, *companion_velocity;
  R nodes;  // of each lane

  RINGLET_KERNEL MassSpring(const StrandPack<R>& pack, const StrandStep<T>& whole, int batch, int lane)
      : s(pack), step(whole), nodes(max(R(0), fma(R(T(2)), pack.count, R(T(-1))))) {
    const std::int64_t base = std::int64_t{whole.batches.row[batch]} * 3 * kLanes + lane;
    rest_companion = whole.batches.rest_companion + base;
    companion_position = whole.state.companion_position + base;
    companion_velocity = whole.state.companion_velocity + base;
  }

  RINGLET_KERNEL int last() const { return 2 * s.particles - 1; }  // nodes of the longest lane
  // The clamped particles and the companions between them: one is a hinge, two hold the tangent and the turn
  // about it.
  RINGLET_KERNEL int clamped() const { return 2 * step.parameters.clamped - 1; }
  RINGLET_KERNEL Mask<R> lives(int node) const { return R(T(node)) < nodes; }
  RINGLET_KERNEL Vector3<R> rest_at(int node) const {
    return load3<R>((node % 2 ? rest_companion : s.rest) + 3 * (node / 2) * kLanes, kLanes);
  }
  RINGLET_KERNEL Arrays state() const {
    return {{s.position, s.velocity, kLanes}, {companion_position, companion_velocity, kLanes}};
  }
  RINGLET_KERNEL Arrays stepped(T* scratch, int stride) const {
    const std::int64_t one = std::int64_t{3} * s.particles * stride;
    T* x = scratch + std::int64_t{2} * kFactorReals * s.particles * stride;
    return {{x, x + one, stride}, {x + 2 * one, x + 3 * one, stride}};
  }

  // What holds the node and the one `span` after it [1/s^2]; 0 past the strand's end.
  RINGLET_KERNEL R kappa(int node, int span) const {
    const int coupling = span == 3 ? kTwist : span == 2 && node % 2 ? kBend : kEdge;
    return select(lives(node + span), s.kappa(step.parameters, node / 2, coupling), R(0));
  }

  // The altitude spring of the node at hand and the next three: a rank-one block between all four, without
  // the geometric stiffness that springs between two nodes have.
  RINGLET_KERNEL void add_altitude(BandWindow<R>& w, int node, const Vector3<R> (&x)[4],
                                   const Vector3<R> (&rest)[4], R h, R total) const {
    const Altitude<R> a = shortest_altitude(x, rest);
    const R stiffness = kappa(node, 3);
    const R pull = h * stiffness * (a.length - a.rest_length);
    w.right = fma(-pull * a.weight[0], a.normal, w.right);
    RINGLET_UNROLL
    for (int k = 0; k < kBand; ++k) w.next_right[k] = fma(-pull * a.weight[k + 1], a.normal, w.next_right[k]);
    w.add_rank_one(total * stiffness, a.normal, a.weight);
  }

  // Drag on the node at hand: on a particle by the hair's segments on both sides, on a companion by its own.
  // `segment` begins at the particle.
  RINGLET_KERNEL void add_air(BandWindow<R>& w, int node, const Arrays& from, R h, Vector3<R> segment,
                              DragTerms<R>& before, R& rest_before) const {
    if (node % 2 == 1) {
      add_drag(w, before, h);
      return;
    }
    const int i = node / 2;
    const R rest_after = select(lives(node + 2), s.rest_length_at(i, 0), R(0));
    const Vector3<R> next_velocity = i + 1 < s.particles ? from.hair.velocity_at(i + 1) : zero3<R>();
    const DragTerms<R> after =
        segment_drag(step.air, load3<R>(s.air + 3 * i * kLanes, kLanes), segment, length(segment),
                     R(T(0.5)) * (from.hair.velocity_at(i) + next_velocity));
    add_drag(w, particle_drag(before, rest_before, after, rest_after), h);
    before = after, rest_before = rest_after;
  }

  RINGLET_KERNEL void factorise(const GhostMotion<R>& frame, R h, const Arrays& from, T* factor,
                                int stride) const {
    const StrandParameters<T>& p = step.parameters;
    const R total = h * (h + R(p.damping));
    const ImplicitWeights<R> weights{total, h * h * R(p.geometric_stiffness)};
    const Vector3<R> gravity = {R(p.gravity[0]), R(p.gravity[1]), R(p.gravity[2])};
    const int n = last();
    BandWindow<R> w;
    w.clear();
    Vector3<R> x[kBand + 1], rest[kBand + 1];
    const auto look = [&](int slot, int node) {
      x[slot] = node < n ? from.position_at(node) : zero3<R>();
      rest[slot] = node < n ? rest_at(node) : zero3<R>();
    };
    RINGLET_UNROLL
    for (int a = 0; a <= kBand; ++a) look(a, a);
    DragTerms<R> drag_before = no_drag<R>();
    R rest_before = R(0);
    for (int node = 0; node < n; ++node) {
      RINGLET_UNROLL
      for (int a = 0; a < kBand; ++a) {
        const SpringTerms<R> terms =
            spring(x[a + 1] - x[0], length(rest[a + 1] - rest[0]), kappa(node, a + 1), weights);
        w.right = fma(h, terms.force, w.right);
        w.next_right[a] = fma(-h, terms.force, w.next_right[a]);
        w.couple(a, terms.block);
      }
      add_altitude(w, node, x, rest, h, total);
      if constexpr (Extra::kAir) add_air(w, node, from, h, x[2] - x[0], drag_before, rest_before);
      if (node < clamped()) {
        const Vector3<R> known = select(lives(node), frame.velocity(rest[0]), zero3<R>());
        RINGLET_UNROLL
        for (int a = 0; a < kBand; ++a) w.next_right[a] = w.next_right[a] - w.below[a] * known;
      } else {
        w.diagonal.add_identity(fma(h, R(p.drag), R(1)));
        w.right = fma(h, select(lives(node), gravity, zero3<R>()), w.right + from.velocity_at(node));
        eliminate(w, factor + kFactorReals * node * stride, stride);
      }
      w.advance();
      RINGLET_UNROLL
      for (int a = 0; a < kBand; ++a) x[a] = x[a + 1], rest[a] = rest[a + 1];
      look(kBand, node + 1 + kBand);
    }
  }

  RINGLET_KERNEL SubstepResult<R> advance(const RootMotion<R>& root, R h, const Arrays& from,
                                          const Arrays& to, T* factor, Mask<R> active, bool last_try) const {
    const GhostMotion<R> frame(root, zero3<R>(), R(1) / h);
    const int stride = to.hair.stride;
    factorise(frame, h, from, factor, stride);
    Vector3<R> later[kBand] = {zero3<R>(), zero3<R>(), zero3<R>()};
    for (int node = last() - 1; node >= 0; --node) {
      Vector3<R> v, x;
      if (node < clamped()) {
        const Vector3<R> rest = rest_at(node);
        v = frame.velocity(rest), x = root.ghost_after(rest);
      } else {
        v = substitute_back(later, factor + kFactorReals * node * stride, stride);
        x = fma(h, v, from.position_at(node) - root.displacement);
      }
      to.put(node, select(lives(node), x, zero3<R>()), select(lives(node), v, zero3<R>()));
      later[2] = later[1], later[1] = later[0], later[0] = v;
    }
    const int rows = s.particles * stride;
    T *moved = to.companions.velocity + 3 * rows, *tension = moved + 6 * rows;
    T* projection = step.parameters.lengths_in_step ? tension + 3 * rows : factor;
    const TensionedChain<2, Arrays, R> chain{stepped_strand(s, step.parameters, h, to.hair, projection),
                                             to,
                                             last(),
                                             clamped(),
                                             factor,
                                             tension,
                                             moved};
    return hold_step_lengths(s, step.parameters, h, chain, active, last_try);
  }

  RINGLET_KERNEL R write_back(const Arrays& from, const Arrays& to, Mask<R> done) const {
    const R companions = kernels::write_back(from.companions, to.companions, s.particles - 1, done);
    const R hair = kernels::write_back(from.hair, to.hair, s.particles, done);
    return fma(R(0), companions, max(hair, companions));  // NaN of either stays
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
