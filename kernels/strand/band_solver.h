// Block LDL^T of a symmetric positive definite matrix of 3x3 blocks with half-bandwidth 3, eliminated
// particle by particle while it is being assembled: only the window of the next three particles is ever held.
//
//   A = L D L^T,  L unit lower triangular (scalar by scalar inside the 3x3 blocks), D diagonal
//
// Eliminating particle i, with A_ii = l d l^T (l unit lower 3x3) and B_a = A_{i+a,i}:
//   W_a = B_a l^-T,  L_a = W_a d^-1,  A_{i+a,i+b} -= L_a W_b^T,  z_i = l^-1 b_i,  b_{i+a} -= L_a z_i
// and back: x_i = l^-T (d^-1 z_i - sum_a L_a^T x_{i+a}).
// About 570 flops a particle; no 3x3 inverse is stored (in float they drift).
#pragma once
#include "kernels/backend/vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr int kBand = 3;
inline constexpr int kFactorReals = 9 * kBand + 3 + 3;  // L_a, l, and d^-1 z of one particle

template <class R>
struct BandWindow {
  Symmetric3<R> diagonal;                // A_ii of the particle at hand
  Vector3<R> right;                      // b_i
  Matrix3<R> below[kBand];               // A_{i+a,i}, a = 1..3
  Symmetric3<R> next_diagonal[kBand];    // A_{i+a,i+a}
  Vector3<R> next_right[kBand];          // b_{i+a}
  Matrix3<R> next_21, next_31, next_32;  // A_{i+2,i+1}, A_{i+3,i+1}, A_{i+3,i+2}: only fill-in

  RINGLET_KERNEL static Matrix3<R> zero_block() {
    return {{R(0), R(0), R(0), R(0), R(0), R(0), R(0), R(0), R(0)}};
  }
  RINGLET_KERNEL void clear() {
    diagonal = zero_symmetric<R>(), right = zero3<R>();
    for (int a = 0; a < kBand; ++a) {
      below[a] = zero_block(), next_diagonal[a] = zero_symmetric<R>(), next_right[a] = zero3<R>();
    }
    next_21 = next_31 = next_32 = zero_block();
  }
  // The next particle becomes the one at hand.
  RINGLET_KERNEL void advance() {
    diagonal = next_diagonal[0], right = next_right[0];
    next_diagonal[0] = next_diagonal[1], next_diagonal[1] = next_diagonal[2],
    next_diagonal[2] = zero_symmetric<R>();
    next_right[0] = next_right[1], next_right[1] = next_right[2], next_right[2] = zero3<R>();
    below[0] = next_21, below[1] = next_31, below[2] = zero_block();
    next_21 = next_32, next_31 = zero_block(), next_32 = zero_block();
  }
  // A spring's block H between the particle at hand and its a-th next: -H below, +H on the next one's
  // diagonal.
  RINGLET_KERNEL void couple(int a, const Symmetric3<R>& h) {
    Matrix3<R>& block = below[a];
    block.m[0] = block.m[0] - h.xx, block.m[1] = block.m[1] - h.xy, block.m[2] = block.m[2] - h.xz;
    block.m[3] = block.m[3] - h.xy, block.m[4] = block.m[4] - h.yy, block.m[5] = block.m[5] - h.yz;
    block.m[6] = block.m[6] - h.xz, block.m[7] = block.m[7] - h.yz, block.m[8] = block.m[8] - h.zz;
    next_diagonal[a].add(h);
  }
};

// -= l w^T, of which the lower triangle of a symmetric result
template <class R>
RINGLET_KERNEL void subtract_product(Symmetric3<R>& s, const Matrix3<R>& l, const Matrix3<R>& w) {
  const auto entry = [&](R s_rc, int r, int c) {
    return fma(R(0) - l.m[3 * r + 2], w.m[3 * c + 2],
               fma(R(0) - l.m[3 * r + 1], w.m[3 * c + 1], fma(R(0) - l.m[3 * r], w.m[3 * c], s_rc)));
  };
  s.xx = entry(s.xx, 0, 0), s.xy = entry(s.xy, 1, 0), s.xz = entry(s.xz, 2, 0);
  s.yy = entry(s.yy, 1, 1), s.yz = entry(s.yz, 2, 1), s.zz = entry(s.zz, 2, 2);
}
template <class R>
RINGLET_KERNEL void subtract_product(Matrix3<R>& s, const Matrix3<R>& l, const Matrix3<R>& w) {
  RINGLET_UNROLL
  for (int r = 0; r < 3; ++r) RINGLET_UNROLL
  for (int c = 0; c < 3; ++c)
    s.m[3 * r + c] =
        fma(R(0) - l.m[3 * r + 2], w.m[3 * c + 2],
            fma(R(0) - l.m[3 * r + 1], w.m[3 * c + 1], fma(R(0) - l.m[3 * r], w.m[3 * c], s.m[3 * r + c])));
}

// Eliminates the particle at hand; `reach` later particles (at most kBand) exist. Writes kFactorReals values
// `stride` apart to `factor`.
template <class R>
RINGLET_KERNEL void eliminate(BandWindow<R>& w, int reach, Scalar<R>* factor, int stride) {
  const Symmetric3<R>& s = w.diagonal;
  const R inv0 = R(1) / s.xx;
  const R l10 = s.xy * inv0, l20 = s.xz * inv0;
  const R inv1 = R(1) / fma(R(0) - l10, s.xy, s.yy);
  const R t21 = fma(R(0) - l20, s.xy, s.yz);
  const R l21 = t21 * inv1;
  const R inv2 = R(1) / fma(R(0) - l21, t21, fma(R(0) - l20, s.xz, s.zz));
  const Vector3<R> b = w.right;
  const R z1 = fma(R(0) - l10, b.x, b.y);
  const Vector3<R> z = {b.x, z1, fma(R(0) - l21, z1, fma(R(0) - l20, b.x, b.z))};

  store(factor + 27 * stride, l10), store(factor + 28 * stride, l20), store(factor + 29 * stride, l21);
  store3<R>(factor + 30 * stride, stride, {z.x * inv0, z.y * inv1, z.z * inv2});

  Matrix3<R> upper[kBand], lower[kBand];  // W_a and L_a
  RINGLET_UNROLL
  for (int a = 0; a < kBand; ++a) {
    if (a >= reach) continue;
    RINGLET_UNROLL
    for (int r = 0; r < 3; ++r) {
      const R w0 = w.below[a].m[3 * r];
      const R w1 = fma(R(0) - l10, w0, w.below[a].m[3 * r + 1]);
      const R w2 = fma(R(0) - l21, w1, fma(R(0) - l20, w0, w.below[a].m[3 * r + 2]));
      upper[a].m[3 * r] = w0, upper[a].m[3 * r + 1] = w1, upper[a].m[3 * r + 2] = w2;
      lower[a].m[3 * r] = w0 * inv0, lower[a].m[3 * r + 1] = w1 * inv1, lower[a].m[3 * r + 2] = w2 * inv2;
    }
    RINGLET_UNROLL
    for (int k = 0; k < 9; ++k) store(factor + (9 * a + k) * stride, lower[a].m[k]);
    w.next_right[a] = w.next_right[a] - lower[a] * z;
    subtract_product(w.next_diagonal[a], lower[a], upper[a]);
  }
  if (reach > 1) subtract_product(w.next_21, lower[1], upper[0]);
  if (reach > 2)
    subtract_product(w.next_31, lower[2], upper[0]), subtract_product(w.next_32, lower[2], upper[1]);
}

// x_i from the factor and the solutions after it, `later[a]` = x_{i+1+a}.
template <class R>
RINGLET_KERNEL Vector3<R> substitute_back(const Vector3<R>* later, int reach, const Scalar<R>* factor,
                                          int stride) {
  Vector3<R> y = load3<R>(factor + 30 * stride, stride);
  RINGLET_UNROLL
  for (int a = 0; a < kBand; ++a) {
    if (a >= reach) continue;
    Matrix3<R> lower;
    RINGLET_UNROLL
    for (int k = 0; k < 9; ++k) lower.m[k] = load<R>(factor + (9 * a + k) * stride);
    y = y - lower.transposed_times(later[a]);
  }
  const R l10 = load<R>(factor + 27 * stride), l20 = load<R>(factor + 28 * stride),
          l21 = load<R>(factor + 29 * stride);
  const R x1 = fma(R(0) - l21, y.z, y.y);
  return {fma(R(0) - l20, y.z, fma(R(0) - l10, x1, y.x)), x1, y.z};
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
