// Block LDL^T of a symmetric positive definite matrix of 3x3 blocks with half-bandwidth 3, eliminated
// particle by particle while it is being assembled: only the window of the next three particles is ever held.
//
//   A = L D L^T,  L unit lower triangular (scalar by scalar inside the 3x3 blocks), D diagonal
//
// Eliminating particle i, with A_ii = l d l^T (l unit lower 3x3) and B_a = A_{i+a,i}:
//   W_a = B_a l^-T,  L_a = W_a d^-1,  A_{i+a,i+b} -= L_a W_b^T,  z_i = l^-1 b_i,  b_{i+a} -= L_a z_i
// and back: x_i = l^-T (d^-1 z_i - sum_a L_a^T x_{i+a}).
// About 570 flops a particle; no 3x3 inverse is stored (in float they drift). Past the strand's last particle
// the blocks B_a are zero and so is all that follows from them: nothing here needs to know where a strand
// ends.
#pragma once
#include "kernels/backend/vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr int kBand = 3;
inline constexpr int kFactorReals = 9 * kBand + 3 + 3 + 3;  // L_a, l, d^-1 z and d^-1 of one particle

template <class R>
RINGLET_KERNEL Matrix3<R> zero_matrix() {
  return {{R(0), R(0), R(0), R(0), R(0), R(0), R(0), R(0), R(0)}};
}

template <class R>
struct BandWindow {
  Symmetric3<R> diagonal;                // A_ii of the particle at hand
  Vector3<R> right;                      // b_i
  Matrix3<R> below[kBand];               // A_{i+a,i}, a = 1..3
  Symmetric3<R> next_diagonal[kBand];    // A_{i+a,i+a}
  Vector3<R> next_right[kBand];          // b_{i+a}
  Matrix3<R> next_21, next_31, next_32;  // A_{i+2,i+1}, A_{i+3,i+1}, A_{i+3,i+2}

  RINGLET_KERNEL void clear() {
    diagonal = zero_symmetric<R>(), right = zero3<R>();
    RINGLET_UNROLL
    for (int a = 0; a < kBand; ++a)
      below[a] = zero_matrix<R>(), next_diagonal[a] = zero_symmetric<R>(), next_right[a] = zero3<R>();
    next_21 = next_31 = next_32 = zero_matrix<R>();
  }
  // The next particle becomes the one at hand.
  RINGLET_KERNEL void advance() {
    diagonal = next_diagonal[0], right = next_right[0];
    next_diagonal[0] = next_diagonal[1], next_diagonal[1] = next_diagonal[2];
    next_diagonal[2] = zero_symmetric<R>();
    next_right[0] = next_right[1], next_right[1] = next_right[2], next_right[2] = zero3<R>();
    below[0] = next_21, below[1] = next_31, below[2] = zero_matrix<R>();
    next_21 = next_32, next_31 = zero_matrix<R>(), next_32 = zero_matrix<R>();
  }
  // A spring's block H between the particle at hand and its a-th next: +H on both diagonals, -H below.
  RINGLET_KERNEL void couple(int a, const Symmetric3<R>& h) {
    R* block = below[a].m;
    block[0] = block[0] - h.xx, block[1] = block[1] - h.xy, block[2] = block[2] - h.xz;
    block[3] = block[3] - h.xy, block[4] = block[4] - h.yy, block[5] = block[5] - h.yz;
    block[6] = block[6] - h.xz, block[7] = block[7] - h.yz, block[8] = block[8] - h.zz;
    diagonal.add(h);
    next_diagonal[a].add(h);
  }
  // s (w w^T) x (n n^T) between the particle at hand and the next three.
  RINGLET_KERNEL void add_rank_one(R s, Vector3<R> n, const R (&weight)[kBand + 1]) {
    diagonal.add_outer(s * weight[0] * weight[0], n);
    RINGLET_UNROLL
    for (int a = 0; a < kBand; ++a) {
      next_diagonal[a].add_outer(s * weight[a + 1] * weight[a + 1], n);
      add_outer(below[a], s * weight[a + 1] * weight[0], n);
    }
    add_outer(next_21, s * weight[2] * weight[1], n);
    add_outer(next_31, s * weight[3] * weight[1], n);
    add_outer(next_32, s * weight[3] * weight[2], n);
  }

 private:
  RINGLET_KERNEL static void add_outer(Matrix3<R>& block, R s, Vector3<R> n) {
    const Vector3<R> b = s * n;
    R* m = block.m;
    m[0] = fma(b.x, n.x, m[0]), m[1] = fma(b.x, n.y, m[1]), m[2] = fma(b.x, n.z, m[2]);
    m[3] = fma(b.y, n.x, m[3]), m[4] = fma(b.y, n.y, m[4]), m[5] = fma(b.y, n.z, m[5]);
    m[6] = fma(b.z, n.x, m[6]), m[7] = fma(b.z, n.y, m[7]), m[8] = fma(b.z, n.z, m[8]);
  }
};

// -= l w^T, of which the lower triangle of a symmetric result
template <class R>
RINGLET_KERNEL R minus_row_product(R entry, const Matrix3<R>& l, int row, const Matrix3<R>& w, int column) {
  const R *a = l.m + 3 * row, *b = w.m + 3 * column;
  return fnma(a[2], b[2], fnma(a[1], b[1], fnma(a[0], b[0], entry)));
}
template <class R>
RINGLET_KERNEL void subtract_product(Symmetric3<R>& s, const Matrix3<R>& l, const Matrix3<R>& w) {
  s.xx = minus_row_product(s.xx, l, 0, w, 0), s.xy = minus_row_product(s.xy, l, 1, w, 0);
  s.xz = minus_row_product(s.xz, l, 2, w, 0), s.yy = minus_row_product(s.yy, l, 1, w, 1);
  s.yz = minus_row_product(s.yz, l, 2, w, 1), s.zz = minus_row_product(s.zz, l, 2, w, 2);
}
template <class R>
RINGLET_KERNEL void subtract_product(Matrix3<R>& s, const Matrix3<R>& l, const Matrix3<R>& w) {
  RINGLET_UNROLL
  for (int k = 0; k < 9; ++k) s.m[k] = minus_row_product(s.m[k], l, k / 3, w, k % 3);
}

// Eliminates the particle at hand. Writes kFactorReals values `stride` apart to `factor`.
template <class R>
RINGLET_KERNEL void eliminate(BandWindow<R>& w, Scalar<R>* factor, int stride) {
  const Symmetric3<R>& s = w.diagonal;
  const R inv0 = R(1) / s.xx;
  const R l10 = s.xy * inv0, l20 = s.xz * inv0;
  const R inv1 = R(1) / fnma(l10, s.xy, s.yy);
  const R t21 = fnma(l20, s.xy, s.yz);
  const R l21 = t21 * inv1;
  const R inv2 = R(1) / fnma(l21, t21, fnma(l20, s.xz, s.zz));
  const Vector3<R> b = w.right;
  const R z1 = fnma(l10, b.x, b.y);
  const R z2 = fnma(l21, z1, fnma(l20, b.x, b.z));

  store3<R>(factor + 27 * stride, stride, {l10, l20, l21});
  store3<R>(factor + 30 * stride, stride, {b.x * inv0, z1 * inv1, z2 * inv2});
  store3<R>(factor + 33 * stride, stride, {inv0, inv1, inv2});

  Matrix3<R> upper[kBand], lower[kBand];  // W_a and L_a
  RINGLET_UNROLL
  for (int a = 0; a < kBand; ++a) {
    RINGLET_UNROLL
    for (int r = 0; r < 9; r += 3) {
      const R w0 = w.below[a].m[r];
      const R w1 = fnma(l10, w0, w.below[a].m[r + 1]);
      const R w2 = fnma(l21, w1, fnma(l20, w0, w.below[a].m[r + 2]));
      upper[a].m[r] = w0, upper[a].m[r + 1] = w1, upper[a].m[r + 2] = w2;
      lower[a].m[r] = w0 * inv0, lower[a].m[r + 1] = w1 * inv1, lower[a].m[r + 2] = w2 * inv2;
    }
    RINGLET_UNROLL
    for (int k = 0; k < 9; ++k) store(factor + (9 * a + k) * stride, lower[a].m[k]);
    const R* l = lower[a].m;
    Vector3<R>& right = w.next_right[a];
    right.x = fnma(l[2], z2, fnma(l[1], z1, fnma(l[0], b.x, right.x)));
    right.y = fnma(l[5], z2, fnma(l[4], z1, fnma(l[3], b.x, right.y)));
    right.z = fnma(l[8], z2, fnma(l[7], z1, fnma(l[6], b.x, right.z)));
    subtract_product(w.next_diagonal[a], lower[a], upper[a]);
  }
  subtract_product(w.next_21, lower[1], upper[0]);
  subtract_product(w.next_31, lower[2], upper[0]);
  subtract_product(w.next_32, lower[2], upper[1]);
}

// The stored factor with another right-hand side: b_i becomes d^-1 z_i, `after` the b of the next particles.
template <class R>
RINGLET_KERNEL void eliminate_again(Vector3<R> b, Vector3<R> (&after)[kBand], Scalar<R>* factor, int stride) {
  const Vector3<R> l = load3<R>(factor + 27 * stride, stride), d = load3<R>(factor + 33 * stride, stride);
  const R z1 = fnma(l.x, b.x, b.y);
  const R z2 = fnma(l.z, z1, fnma(l.y, b.x, b.z));
  store3<R>(factor + 30 * stride, stride, {b.x * d.x, z1 * d.y, z2 * d.z});
  RINGLET_UNROLL
  for (int a = 0; a < kBand; ++a) {
    const auto entry = [&](int k) { return load<R>(factor + (9 * a + k) * stride); };
    Vector3<R>& right = after[a];
    right.x = fnma(entry(2), z2, fnma(entry(1), z1, fnma(entry(0), b.x, right.x)));
    right.y = fnma(entry(5), z2, fnma(entry(4), z1, fnma(entry(3), b.x, right.y)));
    right.z = fnma(entry(8), z2, fnma(entry(7), z1, fnma(entry(6), b.x, right.z)));
  }
}

// x_i from the factor and the solutions after it, `later[a]` = x_{i+1+a}.
template <class R>
RINGLET_KERNEL Vector3<R> substitute_back(const Vector3<R>* later, const Scalar<R>* factor, int stride) {
  // The latest solution last, its last component first: the next particle waits for nothing else.
  Vector3<R> y = load3<R>(factor + 30 * stride, stride);
  RINGLET_UNROLL
  for (int a = kBand - 1; a >= 0; --a) {
    const auto entry = [&](int k) { return load<R>(factor + (9 * a + k) * stride); };
    const Vector3<R> x = later[a];
    y.x = fnma(entry(0), x.x, fnma(entry(3), x.y, fnma(entry(6), x.z, y.x)));
    y.y = fnma(entry(1), x.x, fnma(entry(4), x.y, fnma(entry(7), x.z, y.y)));
    y.z = fnma(entry(2), x.x, fnma(entry(5), x.y, fnma(entry(8), x.z, y.z)));
  }
  const Vector3<R> l = load3<R>(factor + 27 * stride, stride);
  const R x1 = fnma(l.z, y.z, y.y);
  return {fnma(l.y, y.z, fnma(l.x, x1, y.x)), x1, y.z};
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
