// Inextensibility in the metric of an implicit step: lengths that a step with the matrix A left off are
// brought back by the tensions that it should have had,
//
//   (J A^-1 J^T) lambda = C,   x -= A^-1 J^T lambda
//
// with J, C as in length_projection.h. Weighed by masses alone (A = 1) the same correction strains bends and
// twists whose springs are stiffer than a step resolves, and material damping lets go of that only over beta,
// however short the step: such steps converge, but to another motion. What is left here is for the projection
// by masses: as much of that as there is of the tensions.
//
// Conjugate gradients on the tensions, each iteration one substitution in the factor that the step has left.
// They are preconditioned by the sum of two stiffnesses: of the masses alone (tridiagonal, eliminated
// already) and of the segments' own springs, (h^2 + h beta) kappa. Springs that span more than a segment are
// not in it: where these are much stiffer than the segments' own, most is left to the masses.
#pragma once
#include "kernels/strand/band_solver.h"
#include "kernels/strand/length_projection.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Of one correction.
inline constexpr int kTensionIterations = 2;

// Before what is still off is left to the masses. With springs that are all alike either of them leaves a
// tenth to a fifth of the tensions' error.
inline constexpr int kStepCorrections = 2;

// Scratch of a segment: the projection's; residual, search direction and the image of either.
inline constexpr int kStepLengthReals = kProjectionReals + 3;

// One step's chain of nodes. Segment k joins nodes kSpan k and kSpan (k + 1). `Arrays` holds the nodes.
template <int kSpan, class Arrays, class R>
struct TensionedChain {
  using T = Scalar<R>;
  ProjectedStrand<R> lengths;  // eliminated: directions, links and pivots are in its scratch
  Arrays nodes;                // [count] positions and velocities
  int count, clamped;          // nodes; prescribed ones at the root
  T* factor;                   // [count][kFactorReals] of A
  T* tension;                  // [segments][3]
  T* displacement;             // [count][3]

  RINGLET_KERNEL int stride() const { return lengths.stride; }
  RINGLET_KERNEL int segments() const { return lengths.particles - 1; }
  RINGLET_KERNEL const T* row(int segment) const {
    return lengths.scratch + kProjectionReals * segment * stride();
  }
  RINGLET_KERNEL Vector3<R> direction(int segment) const { return load3<R>(row(segment), stride()); }
  RINGLET_KERNEL T* residual(int segment) const { return tension + 3 * segment * stride(); }
  RINGLET_KERNEL T* search(int segment) const { return residual(segment) + stride(); }
  RINGLET_KERNEL T* image(int segment) const { return residual(segment) + 2 * stride(); }
  RINGLET_KERNEL T* moved(int node) const { return displacement + 3 * node * stride(); }
};

// What lengths are off by, 0 where nothing holds or can move a segment.
template <int kSpan, class Arrays, class R>
RINGLET_OUTLINED void begin_tensions(const TensionedChain<kSpan, Arrays, R>& c) {
  const ProjectedStrand<R>& s = c.lengths;
  Vector3<R> here = load3<R>(s.position, s.stride);
  for (int k = 0; k < c.segments(); ++k) {
    const Vector3<R> next = load3<R>(s.position + 3 * (k + 1) * s.stride, s.stride), d = c.direction(k);
    const R rest = load<R>(s.rest_length + 3 * k * s.rest_stride);
    store(c.residual(k), select(dot(d, d) > R(0), length(next - here) - rest, R(0)));
    here = next;
  }
}

// The preconditioned residual, into the images, and its product with the residual.
template <int kSpan, class Arrays, class R, class Stiffness>
RINGLET_KERNEL R precondition_tensions(const TensionedChain<kSpan, Arrays, R>& c,
                                       const Stiffness& stiffness) {
  R reduced = R(0), multiplier = R(0), carry = R(0), product = R(0);
  for (int k = 0; k < c.segments(); ++k) {
    reduced = fnma(load<R>(c.row(k) + 3 * c.stride()), reduced, load<R>(c.residual(k)));
    store(c.image(k), reduced);
  }
  for (int k = c.segments() - 1; k >= 0; --k) {
    const R residual = load<R>(c.residual(k)), inverse = load<R>(c.row(k) + 5 * c.stride());
    multiplier = fnma(carry, multiplier, load<R>(c.image(k)) * inverse);
    carry = load<R>(c.row(k) + 3 * c.stride());
    const R image = fma(stiffness(k), residual, multiplier);
    product = fma(image, residual, product);
    store(c.image(k), image);
  }
  return product;
}

// The next search direction p, image + carried p; what its tensions displace, A^-1 J^T p, and how they
// shorten segments by that, S p, into the images. Returns p S p.
template <int kSpan, class Arrays, class R>
RINGLET_OUTLINED R respond_to_tensions(const TensionedChain<kSpan, Arrays, R>& c, R carried, bool first) {
  const int stride = c.stride();
  Vector3<R> after[kBand] = {zero3<R>(), zero3<R>(), zero3<R>()}, pull_before = zero3<R>();
  for (int node = 0; node < c.count; ++node) {
    Vector3<R> right = after[0];
    after[0] = after[1], after[1] = after[2], after[2] = zero3<R>();
    if (node % kSpan == 0) {
      const int k = node / kSpan;
      Vector3<R> pull = zero3<R>();
      if (k < c.segments()) {
        const R image = load<R>(c.image(k)),
                search = first ? image : fma(carried, load<R>(c.search(k)), image);
        store(c.search(k), search);
        pull = search * c.direction(k);
      }
      right = right + (pull - pull_before);
      pull_before = pull;
    }
    if (node >= c.clamped) eliminate_again(right, after, c.factor + kFactorReals * node * stride, stride);
  }
  R work = R(0);
  Vector3<R> later[kBand] = {zero3<R>(), zero3<R>(), zero3<R>()};
  for (int node = c.count - 1; node >= 0; --node) {
    const Vector3<R> y = node < c.clamped
                             ? zero3<R>()
                             : substitute_back(later, c.factor + kFactorReals * node * stride, stride);
    store3<R>(c.moved(node), stride, y);
    if (const int k = node / kSpan; node % kSpan == 0 && k < c.segments()) {
      const R image = dot(c.direction(k), y - later[kSpan - 1]);
      work = fma(load<R>(c.search(k)), image, work);
      store(c.image(k), image);
    }
    later[2] = later[1], later[1] = later[0], later[0] = y;
  }
  return work;
}

// Moves the nodes of the `active` lanes `along` the displacement.
template <int kSpan, class Arrays, class R>
RINGLET_OUTLINED void follow_tensions(const TensionedChain<kSpan, Arrays, R>& c, R along, Mask<R> active) {
  for (int node = c.clamped; node < c.count; ++node) {
    const Vector3<R> moved = select(active, along * load3<R>(c.moved(node), c.stride()), zero3<R>());
    c.nodes.put(node, c.nodes.position_at(node) + moved,
                fma(c.lengths.per_h, moved, c.nodes.velocity_at(node)));
  }
  for (int k = 0; k < c.segments(); ++k)
    store(c.residual(k), fnma(along, load<R>(c.image(k)), load<R>(c.residual(k))));
}

// Corrects the lengths of the `active` lanes. `stiffness(k)`: of segment k in A, (h^2 + h beta) kappa.
template <int kSpan, class Arrays, class R, class Stiffness>
RINGLET_KERNEL void correct_lengths(const TensionedChain<kSpan, Arrays, R>& chain, Mask<R> active,
                                    const Stiffness& stiffness) {
  const R nothing = R(Scalar<R>(1e-30));
  R before = R(0);
  begin_tensions(chain);
  for (int i = 0; i < kTensionIterations; ++i) {
    const R product = precondition_tensions(chain, stiffness);
    const R work = respond_to_tensions(chain, product * inverse_or_zero(before, nothing), i == 0);
    follow_tensions(chain, product * inverse_or_zero(work, nothing), active);
    before = product;
  }
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
