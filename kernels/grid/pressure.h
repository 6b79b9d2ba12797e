// Unilateral pressure: the p that satisfies, cell by cell,
//
//   p >= 0,   A p - b >= 0,   p (A p - b) = 0
//
// with A the operator of multigrid.h and b by how much a cell would be compressed beyond what it may (McAdams
// et al. 2009; Narain et al. 2009). Where hair separates p is zero: nothing is glued. An iteration is one of
// conjugate gradients, preconditioned by a multigrid cycle, on the cells that have pressure or are compressed
// still; pressure that would pull is cut off, and where that changed the cells the search begins anew. A is
// an M-matrix: from p = 0 the set of cells grows, and is found within a few iterations.
//
// The relative residual is |r| over |max(b, 0)|, Euclidean, r = b - A p where there is pressure and its
// positive part elsewhere: what is left undone over what there was to do. It is computed anew each time, in
// double: across a hundred cells of hair the pressure is a thousand times the differences it makes.
#pragma once
#include "kernels/grid/multigrid.h"
#include "kernels/grid/pressure_problem.h"

namespace ringlet::kernels {

inline namespace RINGLET_ISA {

template <class Backend, class T>
struct Pressure {
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;

  // To be filled by the caller after `resize`, before `prepare`: multigrid.level[0]'s keys and neighbours;
  // `face` [kDirections] [cells] c_f to a neighbour in the set of all cells, 0 where there is none; `open`
  // [cells] the sum of c_f over all faces, those to the outside as well; `right` [cells] b.
  Multigrid<Backend, T> multigrid;
  Buffer<T> face, open, right;
  Buffer<double> pressure;  // [cells] the answer

  std::int32_t cells() const { return multigrid.level[0].cells; }

  void resize(std::size_t n) {
    face.resize(kDirections * n), open.resize(n), right.resize(n), pressure.resize(n);
    direction.resize(n), image.resize(n), violation.resize(n);
  }
  void prepare(Backend& backend) { multigrid.build(backend); }

  // All of that from a problem of the host's.
  void set(Backend& backend, const PressureProblem<T>& problem) {
    auto& fine = multigrid.level[0];
    fine.resize(problem.cells), resize(problem.cells);
    std::uint64_t* key = fine.key.data();
    std::int32_t* neighbour = fine.neighbour.data();
    T *c = face.data(), *all = open.data(), *b = right.data();
    backend.parallel_for("pressure: set", problem.cells, [=] RINGLET_LAMBDA(int i) {
      key[i] = problem.key[i], all[i] = problem.open[i], b[i] = problem.right[i];
      for (int d = 0; d < kDirections; ++d) {
        const std::int64_t at = static_cast<std::int64_t>(d) * problem.cells + i;
        neighbour[at] = problem.neighbour[at], c[at] = problem.face[at];
      }
    });
    prepare(backend);
  }

  // What could not be reached in `most_iterations` is told by the figures.
  PressureFigures solve(Backend& backend, double tolerance, int most_iterations) {
    PressureFigures figures;
    const int n = cells();
    double* p = pressure.data();
    T* diagonal = multigrid.level[0].diagonal.data();
    backend.parallel_for("pressure: clear", n, [=] RINGLET_LAMBDA(int i) { p[i] = 0, diagonal[i] = T(0); });

    const double compressed = find_violation(backend);
    double left = compressed, along = 0;
    figures.compressed = compressed > 0;
    if (figures.compressed) left = guess(backend);
    while (left > tolerance * tolerance * compressed && figures.iterations < most_iterations) {
      if (choose_set(backend)) ++figures.sets, along = 0;
      multigrid.cycle(backend);
      along = step(backend, along);
      ++figures.iterations;
      left = find_violation(backend);
    }
    if (compressed > 0) figures.residual = __builtin_sqrt(left / compressed);
    return figures;
  }

  std::size_t bytes() const {
    return multigrid.bytes() + face.bytes() + open.bytes() + right.bytes() + pressure.bytes() +
           direction.bytes() + image.bytes() + violation.bytes();
  }

  // Starts from a guess by all levels: pressure spreads a cell an iteration where it has to find its bounds
  // by
  // itself. Returns the square of the residual.
  double guess(Backend& backend) {
    auto& fine = multigrid.level[0];
    const LatticeOperator<T> a = fine.view();
    const T *all = open.data(), *c = face.data(), *b = right.data();
    T* r = fine.right.data();
    backend.parallel_for("pressure: guess", a.cells, [=] RINGLET_LAMBDA(int i) {
      a.diagonal[i] = all[i], r[i] = b[i];
      RINGLET_UNROLL
      for (int d = 0; d < kDirections; ++d) {
        const std::int64_t at = static_cast<std::int64_t>(d) * a.cells + i;
        a.link[at] = c[at];
      }
    });
    multigrid.galerkin(backend);
    multigrid.guess_positive(backend);
    const T* x = fine.x.data();
    double* p = pressure.data();
    backend.parallel_for("pressure: guess", a.cells,
                         [=] RINGLET_LAMBDA(int i) { p[i] = static_cast<double>(x[i]); });
    return find_violation(backend);
  }

  // ---- The parts of an iteration

  // v = b - A p over all cells; returns the square of what of it is against the conditions.
  double find_violation(Backend& backend) {
    const int n = cells();
    const LatticeOperator<T> a{n, multigrid.level[0].neighbour.data(), face.data(), open.data()};
    const double* p = pressure.data();
    const T* b = right.data();
    T* v = violation.data();
    backend.parallel_for("pressure: violation", n,
                         [=] RINGLET_LAMBDA(int i) { v[i] = static_cast<T>(b[i] - a.apply(p, i)); });
    return backend.sum("pressure: norm", n, [=] RINGLET_LAMBDA(int i) {
      const double left = p[i] > 0 || v[i] > T(0) ? v[i] : T(0);
      return left * left;
    });
  }

  // Cells with pressure and those that are compressed still: whether they are others than before. Level 0's
  // operator and right side become theirs.
  bool choose_set(Backend& backend) {
    auto& fine = multigrid.level[0];
    const LatticeOperator<T> a = fine.view();
    const double* p = pressure.data();
    const T *v = violation.data(), *all = open.data(), *c = face.data();
    T* r = fine.right.data();
    const double changed = backend.sum("pressure: set", a.cells, [=] RINGLET_LAMBDA(int i) {
      const bool in = p[i] > 0 || v[i] > T(0), was = a.diagonal[i] > T(0);
      a.diagonal[i] = select(in, all[i], T(0));
      r[i] = select(in, v[i], T(0));
      return in == was ? 0.0 : 1.0;
    });
    if (changed == 0) return false;
    backend.parallel_for("pressure: links", a.cells, [=] RINGLET_LAMBDA(int i) {
      const bool in = a.diagonal[i] > T(0);
      RINGLET_UNROLL
      for (int d = 0; d < kDirections; ++d) {
        const std::int64_t at = static_cast<std::int64_t>(d) * a.cells + i;
        a.link[at] = select(in & (a.diagonal[a.neighbour[at]] > T(0)), c[at], T(0));
      }
    });
    multigrid.galerkin(backend);
    return true;
  }

  // A step of conjugate gradients from the cycle's answer, cut off where pressure would pull. `before`: r.z
  // of the step before, 0 for a first one. Returns r.z, 0 where it was cut.
  double step(Backend& backend, double before) {
    const LatticeOperator<T> a = multigrid.level[0].view();
    const T *r = multigrid.level[0].right.data(), *z = multigrid.level[0].x.data();
    double* p = pressure.data();
    T *s = direction.data(), *q = image.data();
    const double along =
        backend.sum("pressure: dot", a.cells, [=] RINGLET_LAMBDA(int i) { return double{r[i]} * z[i]; });
    const T beta = before > 0 ? static_cast<T>(along / before) : T(0);
    backend.parallel_for("pressure: direction", a.cells,
                         [=] RINGLET_LAMBDA(int i) { s[i] = beta == T(0) ? z[i] : fma(beta, s[i], z[i]); });
    backend.parallel_for("pressure: image", a.cells, [=] RINGLET_LAMBDA(int i) { q[i] = a.apply(s, i); });
    const double curvature =
        backend.sum("pressure: dot", a.cells, [=] RINGLET_LAMBDA(int i) { return double{s[i]} * q[i]; });
    const double slope =
        backend.sum("pressure: dot", a.cells, [=] RINGLET_LAMBDA(int i) { return double{s[i]} * r[i]; });
    const double length = curvature > 0 ? slope / curvature : 0;
    const double cut = backend.sum("pressure: step", a.cells, [=] RINGLET_LAMBDA(int i) {
      const double moved = fma(length, static_cast<double>(s[i]), p[i]);
      p[i] = max(moved, 0.0);
      return moved < 0 ? 1.0 : 0.0;
    });
    return cut > 0 ? 0 : along;
  }

  Buffer<T> direction, image, violation;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
