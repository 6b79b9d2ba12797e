// Multigrid for a seven-point operator on any set of a lattice's cells,
//
//   (A p)_i = sum over faces of c_f (p_i - p_j),   p_j = 0 beyond the set,
//
// symmetric and positive definite where every body of cells has a face to the outside. A level's cells are
// sorted by Morton key, so that those of one cell of the next level, up to 2 x 2 x 2 of them, lie together.
// The coarser operators are Galerkin's with piecewise constant interpolation, halved:
//
//   A_H = P^T A P / 2.
//
// P^T A P of a lattice is twice the same lattice's operator at double spacing; the half makes up for what
// such interpolation overrates (Braess 1995). They keep seven points and follow the coefficients however
// these jump. A cycle is symmetric and positive definite, smoothed by Chebyshev's polynomial alike before and
// after, so that it preconditions conjugate gradients; with two visits of each of the first coarser levels
// the iterations do not grow with the resolution.
#pragma once
#include "kernels/backend/vector.h"
#include "kernels/grid/lattice.h"

namespace ringlet::kernels {

inline constexpr int kMostLevels = 20;

inline namespace RINGLET_ISA {

// One level as a kernel sees it.
template <class T>
struct LatticeOperator {
  std::int32_t cells;
  const std::int32_t* neighbour;  // [kDirections][cells], the cell itself where there is none
  T* link;                        // [kDirections][cells] c_f to that neighbour, 0 where there is none
  T* diagonal;                    // [cells] sum of c_f; 0: the cell is out of the problem, its value 0

  // (A p)_i, in the precision of p
  template <class P>
  RINGLET_KERNEL P apply(const P* p, int i) const {
    P sum = static_cast<P>(diagonal[i]) * p[i];
    RINGLET_UNROLL
    for (int d = 0; d < kDirections; ++d) {
      const std::int64_t at = static_cast<std::int64_t>(d) * cells + i;
      sum = fnma(static_cast<P>(link[at]), p[neighbour[at]], sum);
    }
    return sum;
  }
  RINGLET_KERNEL T scaled(T residual, int i) const {  // by the diagonal
    const bool in = diagonal[i] > T(0);
    return select(in, residual, T(0)) / select(in, diagonal[i], T(1));
  }
};

template <class Backend, class T>
struct Level {
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;

  std::int32_t cells = 0;
  Buffer<std::uint64_t> key;        // [cells] ascending
  Buffer<std::int32_t> neighbour;   // [kDirections][cells] as LatticeOperator
  Buffer<T> link, diagonal;         // as LatticeOperator
  Buffer<std::int32_t> parent;      // [cells] on the next level
  Buffer<std::int32_t> child;       // [cells + 1] first cell on the level before
  Buffer<T> right, x, y, residual;  // [cells]

  void resize(std::int32_t n) {
    cells = n;
    key.resize(n), neighbour.resize(std::size_t{kDirections} * n), parent.resize(n + 1);
    link.resize(std::size_t{kDirections} * n), diagonal.resize(n);
    right.resize(n), x.resize(n), y.resize(n), residual.resize(n);
  }
  LatticeOperator<T> view() const { return {cells, neighbour.data(), link.data(), diagonal.data()}; }
  std::size_t bytes() const {
    return key.bytes() + neighbour.bytes() + link.bytes() + diagonal.bytes() + parent.bytes() +
           child.bytes() + right.bytes() + x.bytes() + y.bytes() + residual.bytes();
  }
};

// A coarse cell's neighbour, and the share of its operator that its cells have.
template <class T>
struct Coarsening {
  LatticeOperator<T> fine;
  const std::uint64_t* key;  // of the fine cells
  const std::int32_t *parent, *child;
  std::int32_t coarse_cells;
  std::int32_t* neighbour;
  T *link, *diagonal;

  RINGLET_FUNCTION void connect(int p) const {
    for (int d = 0; d < kDirections; ++d) {
      std::int32_t found = p;
      for (int i = child[p]; i < child[p + 1]; ++i) {
        const std::int32_t beyond = parent[fine.neighbour[static_cast<std::int64_t>(d) * fine.cells + i]];
        if (beyond != p) found = beyond;
      }
      neighbour[static_cast<std::int64_t>(d) * coarse_cells + p] = found;
    }
  }
  RINGLET_FUNCTION void sum(int p) const {
    T own = T(0), across[kDirections] = {};
    for (int i = child[p]; i < child[p + 1]; ++i) {
      own += fine.diagonal[i];
      RINGLET_UNROLL
      for (int axis = 0; axis < 3; ++axis) {
        const std::int64_t at = std::int64_t{2} * axis * fine.cells + i;
        const T low = fine.link[at], high = fine.link[at + fine.cells];
        const bool upper = key[i] >> axis & 1;  // of the two cells along the axis: its low link is within
        own -= select(upper, low, high);
        across[2 * axis] += select(upper, T(0), low), across[2 * axis + 1] += select(upper, high, T(0));
      }
    }
    // Cells within a wall all round are tied to nothing: what is left of their sum is rounding.
    T tied = T(0);
    for (int d = 0; d < kDirections; ++d) tied += across[d];
    diagonal[p] = T(0.5) * max(own, tied);
    for (int d = 0; d < kDirections; ++d)
      link[static_cast<std::int64_t>(d) * coarse_cells + p] = T(0.5) * across[d];
  }
};

// The coefficients of Chebyshev's polynomial of degree 2 over [2 / kRange, 2]: no eigenvalue of the operator
// over its diagonal is larger than 2.
template <class T>
struct Chebyshev {
  static constexpr double kRange = 6;
  static constexpr double kMiddle = 1 + 1 / kRange, kHalf = 1 - 1 / kRange;
  static constexpr double kSecond = 1 / (2 * kMiddle / kHalf - kHalf / kMiddle);
  static constexpr T kFirst = static_cast<T>(1 / kMiddle);
  static constexpr T kMomentum = static_cast<T>(kSecond * kHalf / kMiddle);
  static constexpr T kStep = static_cast<T>(2 * kSecond / kHalf);
};

template <class Backend, class T>
struct Multigrid {
  static constexpr std::int32_t kCoarsest = 8;                // cells that need no coarser level
  static constexpr int kTwiceVisited = 4;                     // levels, from the second on
  static constexpr int kFineGuesses = 2, kCoarseGuesses = 8;  // steps of Jacobi's
  static constexpr int kCoarsestSmoothings = 4;               // enough: such a level's condition is small

  Level<Backend, T> level[kMostLevels];
  int levels = 0;

  // The structure below level 0, whose keys and neighbours are there.
  void build(Backend& backend) {
    levels = 1;
    while (level[levels - 1].cells > kCoarsest && levels < kMostLevels) coarsen(backend, levels++);
  }

  // The coarser operators from level 0's.
  void galerkin(Backend& backend) {
    for (int k = 1; k < levels; ++k) {
      const Coarsening<T> at = coarsening(k);
      backend.parallel_for("multigrid: operator", level[k].cells, [at] RINGLET_LAMBDA(int p) { at.sum(p); });
    }
  }

  // level[0].x becomes a guess at the x >= 0 that solves the complementarity problem of level[0]'s operator
  // and
  // right side: from the coarsest level up, a few projected steps of Jacobi's on each find to a cell or two
  // where the solution ends. Takes the operator of all levels.
  void guess_positive(Backend& backend) {
    for (int k = 1; k < levels; ++k) sum_children(backend, k, level[k - 1].right.data());
    for (int k = levels - 1; k >= 0; --k) {
      T* x = level[k].x.data();
      const bool coarsest = k + 1 == levels;
      const T* coarse = coarsest ? nullptr : level[k + 1].x.data();
      const std::int32_t* parent = level[k].parent.data();
      const T* diagonal = level[k].diagonal.data();
      backend.parallel_for("multigrid: guess", level[k].cells, [=] RINGLET_LAMBDA(int i) {
        x[i] = coarse && diagonal[i] > T(0) ? coarse[parent[i]] : T(0);
      });
      for (int step = 0; step < (k == 0 ? kFineGuesses : kCoarseGuesses); ++step) project(backend, k);
    }
  }

  // level[0].x becomes the cycle's answer to level[0].right.
  void cycle(Backend& backend, int k = 0) {
    smooth_from_zero(backend, k);
    if (k + 1 == levels) {
      for (int n = 1; n < kCoarsestSmoothings; ++n) smooth(backend, k);
      return;
    }
    restrict_residual(backend, k);
    cycle(backend, k + 1);
    if (k < kTwiceVisited && k + 2 < levels) visit_again(backend, k + 1);
    prolong(backend, k);
    smooth(backend, k);
  }

  std::size_t bytes() const {
    std::size_t total = 0;
    for (const auto& l : level) total += l.bytes() + first_visit_bytes(l);
    return total;
  }

  // ---- The parts of a cycle

  void coarsen(Backend& backend, int k) {
    Level<Backend, T>&fine = level[k - 1], &coarse = level[k];
    const std::int32_t n = fine.cells;
    const std::uint64_t* key = fine.key.data();
    std::int32_t* parent = fine.parent.data();
    backend.parallel_for("multigrid: first cells", n, [=] RINGLET_LAMBDA(int i) {
      parent[i] = i == 0 || key[i] >> 3 != key[i - 1] >> 3 ? 1 : 0;
    });
    const std::int32_t cells = backend.scan("multigrid: parents", fine.parent, n);
    coarse.resize(cells);
    coarse.child.resize(cells + 1);
    std::int32_t* child = coarse.child.data();
    std::uint64_t* coarse_key = coarse.key.data();
    backend.parallel_for("multigrid: children", n, [=] RINGLET_LAMBDA(int i) {
      const bool first = i == 0 || key[i] >> 3 != key[i - 1] >> 3;
      // The scan has counted the first cells before this one: another's parent is one less.
      if (first) child[parent[i]] = i, coarse_key[parent[i]] = key[i] >> 3;
      if (i == n - 1) child[cells] = n;
    });
    backend.parallel_for("multigrid: parents", cells, [=] RINGLET_LAMBDA(int p) {
      for (int i = child[p]; i < child[p + 1]; ++i) parent[i] = p;
    });
    const Coarsening<T> at = coarsening(k);
    backend.parallel_for("multigrid: neighbours", cells, [at] RINGLET_LAMBDA(int p) { at.connect(p); });
  }

  Coarsening<T> coarsening(int k) const {
    const Level<Backend, T>&fine = level[k - 1], &coarse = level[k];
    return {fine.view(),  fine.key.data(),         fine.parent.data(), coarse.child.data(),
            coarse.cells, coarse.neighbour.data(), coarse.link.data(), coarse.diagonal.data()};
  }

  void smooth_from_zero(Backend& backend, int k) {
    using C = Chebyshev<T>;
    const LatticeOperator<T> a = level[k].view();
    const T* b = level[k].right.data();
    T *x = level[k].x.data(), *y = level[k].y.data();
    backend.parallel_for("multigrid: smooth", a.cells,
                         [=] RINGLET_LAMBDA(int i) { y[i] = C::kFirst * a.scaled(b[i], i); });
    backend.parallel_for("multigrid: smooth", a.cells, [=] RINGLET_LAMBDA(int i) {
      x[i] = fma(C::kStep, a.scaled(b[i] - a.apply(y, i), i), fma(C::kMomentum, y[i], y[i]));
    });
  }

  void smooth(Backend& backend, int k) {
    using C = Chebyshev<T>;
    const LatticeOperator<T> a = level[k].view();
    const T* b = level[k].right.data();
    T *x = level[k].x.data(), *y = level[k].y.data();
    backend.parallel_for("multigrid: smooth", a.cells, [=] RINGLET_LAMBDA(int i) {
      y[i] = fma(C::kFirst, a.scaled(b[i] - a.apply(x, i), i), x[i]);
    });
    backend.parallel_for("multigrid: smooth", a.cells, [=] RINGLET_LAMBDA(int i) {
      x[i] = fma(C::kStep, a.scaled(b[i] - a.apply(y, i), i), fma(C::kMomentum, y[i] - x[i], y[i]));
    });
  }

  void restrict_residual(Backend& backend, int k) {
    find_residual(backend, k);
    sum_children(backend, k + 1, level[k].residual.data());
  }

  // Level k's right side from values of the level before.
  void sum_children(Backend& backend, int k, const T* fine) {
    const std::int32_t* child = level[k].child.data();
    T* right = level[k].right.data();
    backend.parallel_for("multigrid: restrict", level[k].cells, [=] RINGLET_LAMBDA(int p) {
      T sum = T(0);
      for (int i = child[p]; i < child[p + 1]; ++i) sum += fine[i];
      right[p] = sum;
    });
  }

  // A projected step of Jacobi's.
  void project(Backend& backend, int k) {
    constexpr T kDamping = static_cast<T>(0.8);
    const LatticeOperator<T> a = level[k].view();
    const T* b = level[k].right.data();
    T *x = level[k].x.data(), *y = level[k].y.data();
    backend.parallel_for("multigrid: guess", a.cells, [=] RINGLET_LAMBDA(int i) {
      y[i] = max(fma(kDamping, a.scaled(b[i] - a.apply(x, i), i), x[i]), T(0));
    });
    level[k].x.swap(level[k].y);
  }

  void find_residual(Backend& backend, int k) {
    const LatticeOperator<T> a = level[k].view();
    const T *b = level[k].right.data(), *x = level[k].x.data();
    T* residual = level[k].residual.data();
    backend.parallel_for("multigrid: residual", a.cells,
                         [=] RINGLET_LAMBDA(int i) { residual[i] = b[i] - a.apply(x, i); });
  }

  // A second cycle on what the first has left.
  void visit_again(Backend& backend, int k) {
    find_residual(backend, k);
    level[k].right.swap(level[k].residual);
    first_visit[k].resize(level[k].cells);
    first_visit[k].swap(level[k].x);
    cycle(backend, k);
    const T* before = first_visit[k].data();
    T* x = level[k].x.data();
    backend.parallel_for("multigrid: add", level[k].cells, [=] RINGLET_LAMBDA(int i) { x[i] += before[i]; });
  }

  void prolong(Backend& backend, int k) {
    const std::int32_t* parent = level[k].parent.data();
    const T *coarse = level[k + 1].x.data(), *diagonal = level[k].diagonal.data();
    T* x = level[k].x.data();
    backend.parallel_for("multigrid: prolong", level[k].cells, [=] RINGLET_LAMBDA(int i) {
      x[i] += select(diagonal[i] > T(0), coarse[parent[i]], T(0));  // out of the problem stays zero
    });
  }

  std::size_t first_visit_bytes(const Level<Backend, T>& l) const { return first_visit[&l - level].bytes(); }

  typename Backend::template Buffer<T> first_visit[kMostLevels];
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
