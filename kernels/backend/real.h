// The operations that kernels use on a real number R: float, double, or a pack of either (backend/pack.h).
// Fused multiply-adds are always spelled out: contraction is off, so every machine rounds alike.
#pragma once
#include "kernels/backend/qualifiers.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class R>
struct Traits;  // Scalar: what is stored in memory; Mask: result of a comparison; kWidth: lanes
template <>
struct Traits<float> {
  using Scalar = float;
  using Mask = bool;
  static constexpr int kWidth = 1;
};
template <>
struct Traits<double> {
  using Scalar = double;
  using Mask = bool;
  static constexpr int kWidth = 1;
};
template <class R>
using Scalar = typename Traits<R>::Scalar;
template <class R>
using Mask = typename Traits<R>::Mask;

RINGLET_KERNEL float fma(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
RINGLET_KERNEL double fma(double a, double b, double c) { return __builtin_fma(a, b, c); }
// c - a b, rounded once
RINGLET_KERNEL float fnma(float a, float b, float c) { return __builtin_fmaf(-a, b, c); }
RINGLET_KERNEL double fnma(double a, double b, double c) { return __builtin_fma(-a, b, c); }
RINGLET_KERNEL float sqrt(float a) { return __builtin_sqrtf(a); }
RINGLET_KERNEL double sqrt(double a) { return __builtin_sqrt(a); }
RINGLET_KERNEL float select(bool mask, float a, float b) { return mask ? a : b; }
RINGLET_KERNEL double select(bool mask, double a, double b) { return mask ? a : b; }
RINGLET_KERNEL bool any(bool mask) { return mask; }

// Comparisons with NaN are false, so `max(a, NaN)` and `min(a, NaN)` are a: health checks look at squares,
// not here.
template <class R>
RINGLET_KERNEL R max(R a, R b) {
  return select(a < b, b, a);
}
template <class R>
RINGLET_KERNEL R min(R a, R b) {
  return select(b < a, b, a);
}
template <class R>
RINGLET_KERNEL R abs(R a) {
  return max(a, -a);
}

template <class R>
RINGLET_KERNEL R load(const Scalar<R>* p) {
  if constexpr (Traits<R>::kWidth == 1)
    return *p;
  else
    return R::load(p);
}
template <class R>
RINGLET_KERNEL void store(Scalar<R>* p, R a) {
  if constexpr (Traits<R>::kWidth == 1)
    *p = a;
  else
    a.store(p);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
