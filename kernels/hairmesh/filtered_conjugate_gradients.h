// Conjugate gradients with prescribed unknowns (Baraff and Witkin 1998, section 5.3): solves S A S x = S b,
// where the filter S takes what is prescribed out of every residual and search direction, so that x has
// nothing of it.
//
// The preconditioner goes over the mesh's columns forward and back, solving each exactly for what the others
// are: with A = L + D + L^T by columns (block_matrix.h), it is (D + L) D^-1 (D + L^T). Long columns, stiff
// along the hair and coupled two layers apart, then cost no more iterations than short ones. Written for y =
// (D + L^T) x (Eisenstat 1981), a step multiplies by each block outside the columns twice and by none inside:
// with p the direction,
//   t = (D + L^T)^-1 p,   q = t + (D + L)^-1 (p - D t)
// where p - D t = L^T t falls out of the first sweep, and D q = p - L s of the second.
//
// Sums are taken in an order of their own, lane by lane: no result depends on the instruction set.
#pragma once
#include "kernels/hairmesh/hair_mesh_elements.h"
#include "kernels/hairmesh/vertex_filter.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Vertices that products read beyond the last, times 0.
inline constexpr std::int32_t kBeyond = 2;

template <class T>
class FilteredConjugateGradients {
 public:
  explicit FilteredConjugateGradients(std::int32_t vertices) {
    zero_values(4 * static_cast<std::size_t>(vertices + kBeyond), residual_, scaled_, direction_, back_,
                later_, earlier_, product_, left_);
  }

  std::size_t bytes() const { return 8 * residual_.bytes(); }

  // x, from `b` and a matrix that is factored with the filter. Residuals r count as r . D^-1 r, as Baraff and
  // Witkin weight them with the inverse of the matrix' diagonal: what float's rounding of stiff hair's x
  // makes of them stays small. The one that counts is the true one, b - A x: where rounding has led the
  // iteration's astray, it goes on from there.
  template <class Matrix>
  SolveFigures solve(const Matrix& a, const VertexFilter<T>& filter, T tolerance, std::int32_t iterations,
                     const Padded<T>* b, Padded<T>* x) {
    for_rows(a, [&](std::int32_t i) {
      x[i] = Padded<T>{}, vectors(product_)[i] = Padded<T>{};
      vectors(left_)[i] = filter.keep(i, b[i]);
    });
    first_ = weighted_square(a, vectors(left_));
    return reduce(a, filter, tolerance, iterations, b, x, first_);
  }
  // The same from an x that is near, and has values where they are prescribed; to a residual relative to that
  // at the start of the last `solve`, or here where it is larger.
  template <class Matrix>
  SolveFigures solve_on(const Matrix& a, const VertexFilter<T>& filter, T tolerance, std::int32_t iterations,
                        const Padded<T>* b, Padded<T>* x) {
    const T left = true_residual(a, filter, b, x);
    first_ = max(first_, left);  // what nothing moved at the start, the new values may
    return reduce(a, filter, tolerance, iterations, b, x, left);
  }

  // A x of the last solve, also where it is prescribed.
  const Padded<T>* product() const { return vectors(product_); }

  // y = A x
  template <class Matrix>
  static void multiply(const Matrix& a, const Padded<T>* x, Padded<T>* y) {
    for (std::int32_t c = 0; c < a.columns(); ++c) a.later_columns(c, x, y), a.own_column(c, x, y);
    for (std::int32_t c = 0; c < a.columns(); ++c) a.add_to_later_columns(c, x, y);
  }

 private:
  static Padded<T>* vectors(const HostBuffer<T>& buffer) {
    return reinterpret_cast<Padded<T>*>(buffer.data());
  }
  static RINGLET_KERNEL T sum(Padded<T> lanes) { return lanes[0] + lanes[1] + lanes[2]; }
  template <class Matrix, class F>
  static RINGLET_KERNEL void for_rows(const Matrix& a, const F& f) {
    for (std::int32_t c = 0; c < a.columns(); ++c)
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) f(i);
  }

  // Until the weighted square of the residual, `left` at the start, is small enough.
  template <class Matrix>
  SolveFigures reduce(const Matrix& a, const VertexFilter<T>& filter, T tolerance, std::int32_t iterations,
                      const Padded<T>* b, Padded<T>* x, T left) {
    SolveFigures figures;
    const T goal = tolerance * tolerance * first_;
    T last = T(8) * left;
    // Rounding ends what goes on for too long.
    while (left > goal && left < T(0.25) * last && figures.iterations < iterations) {
      last = left;
      iterate(a, filter, goal, left, iterations, vectors(left_), x, figures);
      left = true_residual(a, filter, b, x);
    }
    figures.residual = static_cast<double>(first_ > 0 ? sqrt(left / first_) : first_);
    return figures;
  }
  // S (b - A x) in left_; its weighted square.
  template <class Matrix>
  T true_residual(const Matrix& a, const VertexFilter<T>& filter, const Padded<T>* b, const Padded<T>* x) {
    Padded<T>*r = vectors(left_), *product = vectors(product_);
    multiply(a, x, product);
    for_rows(a, [&](std::int32_t i) { r[i] = filter.keep(i, b[i] - product[i]); });
    return weighted_square(a, r);
  }

  // Adds to x until the weighted square of the residual, `left` for `b` at the start, is down to `goal`. What
  // the preconditioner makes of the residual is at hand, this costs half an iteration: it is looked at when
  // the other has come down as far.
  template <class Matrix>
  void iterate(const Matrix& a, const VertexFilter<T>& filter, T goal, T left, std::int32_t iterations,
               const Padded<T>* b, Padded<T>* x, SolveFigures& figures) {
    Padded<T>*r = vectors(residual_), *z = vectors(scaled_), *q = vectors(earlier_);
    T rho = start(a, filter, b), beta = 0;
    T look = rho * (goal / left);
    while (rho > 0 && figures.iterations < iterations) {
      sweep_back(a, filter, beta);
      const T bend = sweep_forward(a, filter);
      if (!(bend > 0)) break;  // rounding has left no direction to go, or something is not finite
      const T alpha = rho / bend;
      Padded<T> along{};
      for_rows(a, [&](std::int32_t i) {
        x[i] += alpha * vectors(back_)[i];
        r[i] -= alpha * q[i];
        z[i] -= alpha * vectors(later_)[i];
        along += r[i] * z[i];
      });
      const T next = sum(along);
      beta = next / rho, rho = next;
      ++figures.iterations;
      if (rho > look) continue;
      const T square = weighted_residual(a, filter);
      if (!(square > goal)) break;
      look = rho * max(goal / square, T(0.01));
    }
  }

  // Of the residual b - A x = z + L r.
  template <class Matrix>
  T weighted_residual(const Matrix& a, const VertexFilter<T>& filter) {
    Padded<T>*r = vectors(residual_), *z = vectors(scaled_), *sums = vectors(later_);
    for_rows(a, [&](std::int32_t i) { sums[i] = Padded<T>{}; });
    for (std::int32_t c = 0; c < a.columns(); ++c) {
      a.add_to_later_columns(c, r, sums);
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) sums[i] = z[i] + filter.keep(i, sums[i]);
    }
    return weighted_square(a, sums);
  }
  // b . D^-1 b
  template <class Matrix>
  T weighted_square(const Matrix& a, const Padded<T>* b) {
    Padded<T>* solved = vectors(earlier_);
    Padded<T> squares{};
    for (std::int32_t c = 0; c < a.columns(); ++c) {
      a.solve_column(c, b, solved);
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) squares += b[i] * solved[i];
    }
    return sum(squares);
  }

  // r = (D + L)^-1 b and z = D r; returns r . z.
  template <class Matrix>
  T start(const Matrix& a, const VertexFilter<T>& filter, const Padded<T>* b) {
    Padded<T>*r = vectors(residual_), *z = vectors(scaled_), *sums = vectors(later_);
    Padded<T> along{};
    for_rows(a, [&](std::int32_t i) { sums[i] = vectors(direction_)[i] = Padded<T>{}; });
    for (std::int32_t c = 0; c < a.columns(); ++c) {
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) z[i] = b[i] - filter.keep(i, sums[i]);
      a.solve_column(c, z, r);
      a.add_to_later_columns(c, r, sums);
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) along += r[i] * z[i];
    }
    return sum(along);
  }

  // p = z + beta p; t = (D + L^T)^-1 p in back_, L^T t in earlier_.
  template <class Matrix>
  void sweep_back(const Matrix& a, const VertexFilter<T>& filter, T beta) {
    Padded<T>*z = vectors(scaled_), *p = vectors(direction_), *t = vectors(back_), *u = vectors(earlier_),
    *g = vectors(later_);
    for (std::int32_t c = a.columns() - 1; c >= 0; --c) {
      a.later_columns(c, t, u);
      if (filter.touches(c))
        for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) u[i] = filter.keep(i, u[i]);
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) {
        p[i] = z[i] + beta * p[i];
        g[i] = p[i] - u[i];
      }
      a.solve_column(c, g, t);
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) g[i] = Padded<T>{};
    }
  }

  // s = (D + L)^-1 L^T t; q = t + s in earlier_, D q = p - L s in later_; returns p . q.
  template <class Matrix>
  T sweep_forward(const Matrix& a, const VertexFilter<T>& filter) {
    Padded<T>*p = vectors(direction_), *t = vectors(back_), *q = vectors(earlier_), *sums = vectors(later_);
    Padded<T> along{};
    for (std::int32_t c = 0; c < a.columns(); ++c) {
      const bool filtered = filter.touches(c);
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) {
        if (filtered) sums[i] = filter.keep(i, sums[i]);
        q[i] -= sums[i];
        sums[i] = p[i] - sums[i];
      }
      a.solve_column(c, q, q);
      a.add_to_later_columns(c, q, sums);
      for (std::int32_t i = a.first_row(c); i < a.end_row(c); ++i) {
        q[i] += t[i];
        along += p[i] * q[i];
      }
    }
    return sum(along);
  }

  HostBuffer<T> residual_, scaled_, direction_;  // r, z, p
  HostBuffer<T> back_, later_, earlier_;
  HostBuffer<T> product_, left_;
  T first_ = 0;  // weighted square of the residual at the start of the last solve
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
