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
#include "kernels/hairmesh/pair_lanes.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
class FilteredConjugateGradients {
 public:
  explicit FilteredConjugateGradients(const PairLanes<T>& lanes) : lanes_(lanes) {
    zero_values(lanes.reals(), residual_, scaled_, direction_, back_, later_, earlier_, product_, left_,
                right_, solution_);
  }

  std::size_t bytes() const { return 10 * residual_.bytes(); }

  // x, from `b` and a matrix that is factored with the filter. Residuals r count as r . D^-1 r, as Baraff and
  // Witkin weight them with the inverse of the matrix' diagonal: what float's rounding of stiff hair's x
  // makes of them stays small. The one that counts is the true one, b - A x: where rounding has led the
  // iteration's astray, it goes on from there.
  template <class Matrix>
  SolveFigures solve(const Matrix& a, const VertexFilter<T>& filter, T tolerance, std::int32_t iterations,
                     const Padded<T>* b, Padded<T>* x) {
    read(b, right_);
    for_octets([&](std::int32_t i) {
      octets(solution_)[i] = octets(product_)[i] = Octets<T>{};
      octets(left_)[i] = octets(right_)[i];
    });
    for (std::int32_t k = 0; k < lanes_.pairs(); ++k) lanes_.keep(filter, k, left_.data());
    first_ = weighted_square(a, left_);
    return reduce(a, filter, tolerance, iterations, x, first_);
  }
  // The same from an x that is near, and has values where they are prescribed; to a residual relative to that
  // at the start of the last `solve`, or here where it is larger.
  template <class Matrix>
  SolveFigures solve_on(const Matrix& a, const VertexFilter<T>& filter, T tolerance, std::int32_t iterations,
                        const Padded<T>* b, Padded<T>* x) {
    read(b, right_), read(x, solution_);
    const T left = true_residual(a, filter);
    first_ = max(first_, left);  // what nothing moved at the start, the new values may
    return reduce(a, filter, tolerance, iterations, x, left);
  }

  // A x of the last solve, also where it is prescribed.
  Padded<T> product(std::int32_t vertex) const {
    return lanes_.get(product_.data() + lanes_.offset_of(vertex));
  }

  // y = A x
  template <class Matrix>
  void multiply(const Matrix& a, const Padded<T>* x, Padded<T>* y) {
    read(x, solution_), multiply(a, solution_, product_), write(product_, y);
  }

 private:
  static Octets<T>* octets(const HostBuffer<T>& buffer) {
    return reinterpret_cast<Octets<T>*>(buffer.data());
  }
  static RINGLET_KERNEL T sum(Octets<T> lanes) {
    const Padded<T> halves = half_of<0, T>(lanes) + half_of<1, T>(lanes);
    return (halves[0] + halves[1]) + (halves[2] + halves[3]);
  }
  template <class F>
  RINGLET_KERNEL void for_octets(const F& f) const {
    for (std::int32_t i = 0; i < lanes_.first_octet(lanes_.pairs()); ++i) f(i);
  }
  template <class F>
  RINGLET_KERNEL void for_octets(std::int32_t pair, const F& f) const {
    for (std::int32_t i = lanes_.first_octet(pair); i < lanes_.first_octet(pair + 1); ++i) f(i);
  }
  void read(const Padded<T>* from, const HostBuffer<T>& to) const {
    lanes_.for_vertices([&](std::int32_t v, std::int32_t at) { lanes_.put(to.data() + at, from[v]); });
  }
  void write(const HostBuffer<T>& from, Padded<T>* to) const {
    lanes_.for_vertices([&](std::int32_t v, std::int32_t at) { to[v] = lanes_.get(from.data() + at); });
  }
  template <class Matrix>
  void multiply(const Matrix& a, const HostBuffer<T>& x, const HostBuffer<T>& y) const {
    for (std::int32_t k = 0; k < lanes_.pairs(); ++k) {
      const std::int32_t at = lanes_.first_octet(k);
      a.later(k, x.data(), octets(y) + at), a.add_own(k, octets(x) + at, octets(y) + at);
    }
    for (std::int32_t k = 0; k < lanes_.pairs(); ++k)
      a.add_to_later(k, octets(x) + lanes_.first_octet(k), y.data());
  }

  // Until the weighted square of the residual, `left` at the start, is small enough.
  template <class Matrix>
  SolveFigures reduce(const Matrix& a, const VertexFilter<T>& filter, T tolerance, std::int32_t iterations,
                      Padded<T>* x, T left) {
    SolveFigures figures;
    const T goal = tolerance * tolerance * first_;
    T last = T(8) * left;
    // Rounding ends what goes on for too long.
    while (left > goal && left < T(0.25) * last && figures.iterations < iterations) {
      last = left;
      iterate(a, filter, goal, left, iterations, figures);
      left = true_residual(a, filter);
    }
    figures.residual = static_cast<double>(first_ > 0 ? sqrt(left / first_) : first_);
    write(solution_, x);
    return figures;
  }
  // S (b - A x) in left_; its weighted square.
  template <class Matrix>
  T true_residual(const Matrix& a, const VertexFilter<T>& filter) {
    multiply(a, solution_, product_);
    for_octets([&](std::int32_t i) { octets(left_)[i] = octets(right_)[i] - octets(product_)[i]; });
    for (std::int32_t k = 0; k < lanes_.pairs(); ++k) lanes_.keep(filter, k, left_.data());
    return weighted_square(a, left_);
  }

  // Adds to x until the weighted square of the residual, `left` for left_ at the start, is down to `goal`.
  // What the preconditioner makes of the residual is at hand, this costs half an iteration: it is looked at
  // when the other has come down as far.
  template <class Matrix>
  void iterate(const Matrix& a, const VertexFilter<T>& filter, T goal, T left, std::int32_t iterations,
               SolveFigures& figures) {
    Octets<T>*x = octets(solution_), *r = octets(residual_), *z = octets(scaled_), *q = octets(earlier_);
    T rho = start(a, filter), beta = 0;
    T look = rho * (goal / left);
    while (rho > 0 && figures.iterations < iterations) {
      sweep_back(a, filter, beta);
      const T bend = sweep_forward(a, filter);
      if (!(bend > 0)) break;  // rounding has left no direction to go, or something is not finite
      const T alpha = rho / bend;
      Octets<T> along{};
      for_octets([&](std::int32_t i) {
        x[i] += alpha * octets(back_)[i];
        r[i] -= alpha * q[i];
        z[i] -= alpha * octets(later_)[i];
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
    Octets<T>*r = octets(residual_), *z = octets(scaled_), *sums = octets(later_);
    for_octets([&](std::int32_t i) { sums[i] = Octets<T>{}; });
    for (std::int32_t k = 0; k < lanes_.pairs(); ++k) {
      a.add_to_later(k, r + lanes_.first_octet(k), later_.data());
      lanes_.keep(filter, k, later_.data());
      for_octets(k, [&](std::int32_t i) { sums[i] += z[i]; });
    }
    return weighted_square(a, later_);
  }
  // b . D^-1 b
  template <class Matrix>
  T weighted_square(const Matrix& a, const HostBuffer<T>& b) {
    Octets<T>* solved = octets(earlier_);
    Octets<T> squares{};
    for (std::int32_t k = 0; k < lanes_.pairs(); ++k) {
      a.solve(k, octets(b) + lanes_.first_octet(k), solved + lanes_.first_octet(k));
      for_octets(k, [&](std::int32_t i) { squares += octets(b)[i] * solved[i]; });
    }
    return sum(squares);
  }

  // r = (D + L)^-1 b and z = D r, from b in left_; returns r . z.
  template <class Matrix>
  T start(const Matrix& a, const VertexFilter<T>& filter) {
    Octets<T>*r = octets(residual_), *z = octets(scaled_), *sums = octets(later_);
    Octets<T> along{};
    for_octets([&](std::int32_t i) { sums[i] = octets(direction_)[i] = Octets<T>{}; });
    for (std::int32_t k = 0; k < lanes_.pairs(); ++k) {
      const std::int32_t at = lanes_.first_octet(k);
      lanes_.keep(filter, k, later_.data());
      for_octets(k, [&](std::int32_t i) { z[i] = octets(left_)[i] - sums[i]; });
      a.solve(k, z + at, r + at);
      a.add_to_later(k, r + at, later_.data());
      for_octets(k, [&](std::int32_t i) { along += r[i] * z[i]; });
    }
    return sum(along);
  }

  // p = z + beta p; t = (D + L^T)^-1 p in back_, L^T t in earlier_.
  template <class Matrix>
  void sweep_back(const Matrix& a, const VertexFilter<T>& filter, T beta) {
    Octets<T>*z = octets(scaled_), *p = octets(direction_), *t = octets(back_), *u = octets(earlier_),
    *g = octets(later_);
    for (std::int32_t k = lanes_.pairs() - 1; k >= 0; --k) {
      const std::int32_t at = lanes_.first_octet(k);
      a.later(k, back_.data(), u + at);
      lanes_.keep(filter, k, earlier_.data());
      for_octets(k, [&](std::int32_t i) {
        p[i] = z[i] + beta * p[i];
        g[i] = p[i] - u[i];
      });
      a.solve(k, g + at, t + at);
      for_octets(k, [&](std::int32_t i) { g[i] = Octets<T>{}; });
    }
  }

  // s = (D + L)^-1 L^T t; q = t + s in earlier_, D q = p - L s in later_; returns p . q.
  template <class Matrix>
  T sweep_forward(const Matrix& a, const VertexFilter<T>& filter) {
    Octets<T>*p = octets(direction_), *t = octets(back_), *q = octets(earlier_), *sums = octets(later_);
    Octets<T> along{};
    for (std::int32_t k = 0; k < lanes_.pairs(); ++k) {
      const std::int32_t at = lanes_.first_octet(k);
      lanes_.keep(filter, k, later_.data());
      for_octets(k, [&](std::int32_t i) {
        q[i] -= sums[i];
        sums[i] = p[i] - sums[i];
      });
      a.solve(k, q + at, q + at);
      a.add_to_later(k, q + at, later_.data());
      for_octets(k, [&](std::int32_t i) {
        q[i] += t[i];
        along += p[i] * q[i];
      });
    }
    return sum(along);
  }

  const PairLanes<T>& lanes_;
  HostBuffer<T> residual_, scaled_, direction_;  // r, z, p
  HostBuffer<T> back_, later_, earlier_;
  HostBuffer<T> product_, left_, right_, solution_;
  T first_ = 0;  // weighted square of the residual at the start of the last solve
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
