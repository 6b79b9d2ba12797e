// Non-Hookean integrity (AMS paper 3.1.2 and Fig. 3; physics.md section 3). Elongation of a particle:
//
//   e = |x - y| / L,  y its ghost without the preload, L the strand's rest length
//
// Integrity acts with the secant stiffness s kappa_I, s = T(e*) / (kappa_I L e*): the secant, never the
// slope, keeps the matrix positive definite through softening and the break. e* is the present elongation,
// or with permanent memory the largest so far.
#pragma once
#include "kernels/backend/vector.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// s at the elongation e: exactly 1 up to the transition, 0 from the break on, NaN of NaN.
template <class R>
RINGLET_KERNEL R secant(const TensionCurve<Scalar<R>>& curve, R e) {
  R tension = e;
  for (int k = 0; k < curve.pieces; ++k) {
    const Scalar<R>* c = curve.coefficient[k];
    const R x = e - R(curve.start[k]);
    const R cubic = fma(fma(fma(R(c[3]), x, R(c[2])), x, R(c[1])), x, R(c[0]));
    tension = select(x > R(0), cubic, tension);
  }
  const Mask<R> hookean = e <= R(curve.transition);
  const R s = tension / select(hookean, R(1), e);
  return select(hookean, R(1), select(R(curve.breaking) <= e, R(0), s));
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
