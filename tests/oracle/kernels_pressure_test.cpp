// The pressure of hair's grid: manufactured solutions, the unilateral problem against projected Gauss-Seidel,
// its residual taken anew, iterations against resolution, and what the multigrid cycle must be for conjugate
// gradients.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "grid_support.h"
#include "kernels/backend/host.h"
#include "kernels/grid/pressure.h"

namespace ringlet::kernels_testing {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using kernels::Host;
using kernels::kDirections;
using At = std::array<int, 3>;
constexpr double kPi = std::numbers::pi;

// A seven-point problem on some cells of a lattice of n x n x n, as the kernels are given it: its numbers are
// those of T, and the reference's are the same.
template <class T>
struct Lattice {
  int n;
  std::vector<At> cell;                    // by Morton key
  std::vector<std::array<int, 6>> beside;  // -1: outside
  std::vector<std::array<T, 6>> c;
  std::vector<T> open, b;

  // `coefficient`(cell, the place beyond): of the face between them, symmetric.
  Lattice(int edge, const std::function<bool(At)>& in, const std::function<double(At, At)>& coefficient)
      : n(edge), number_(static_cast<std::size_t>(edge) * edge * edge, -1) {
    for (int z = 0; z < n; ++z)
      for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x)
          if (in({x, y, z})) cell.push_back({x, y, z});
    std::sort(cell.begin(), cell.end(), [](At a, At b) { return key(a) < key(b); });
    for (int i = 0; i < size(); ++i) number_[place(cell[i])] = i;
    beside.resize(size()), c.resize(size()), open.assign(size(), T(0)), b.assign(size(), T(0));
    for (int i = 0; i < size(); ++i)
      for (int d = 0; d < kDirections; ++d) {
        const At to = beyond(cell[i], d);
        beside[i][d] = number(to);
        c[i][d] = static_cast<T>(coefficient(cell[i], to));
        open[i] += c[i][d];
      }
  }

  int size() const { return static_cast<int>(cell.size()); }
  static At beyond(At a, int direction) {
    a[direction / 2] += direction % 2 ? 1 : -1;
    return a;
  }
  int number(At a) const {
    for (const int x : a)
      if (x < 0 || x >= n) return -1;
    return number_[place(a)];
  }
  double apply(const VectorXd& p, int i) const {
    double sum = static_cast<double>(open[i]) * p[i];
    for (int d = 0; d < kDirections; ++d)
      if (beside[i][d] >= 0) sum -= static_cast<double>(c[i][d]) * p[beside[i][d]];
    return sum;
  }
  // What is left of A p >= b, p >= 0, and their complementarity, over what there was to do.
  double residual(const VectorXd& p) const {
    double left = 0, all = 0;
    for (int i = 0; i < size(); ++i) {
      const double r = b[i] - apply(p, i), wanted = std::max<double>(b[i], 0);
      all += wanted * wanted;
      if (p[i] > 0 || r > 0) left += r * r;
    }
    return all > 0 ? std::sqrt(left / all) : std::sqrt(left);
  }

 private:
  static std::uint64_t key(At a) {  // bit by bit, unlike the kernels
    std::uint64_t k = 0;
    for (int bit = 0; bit < 20; ++bit)
      for (int c = 0; c < 3; ++c) k |= static_cast<std::uint64_t>(a[c] >> bit & 1) << (3 * bit + c);
    return k;
  }
  std::size_t place(At a) const { return (static_cast<std::size_t>(a[2]) * n + a[1]) * n + a[0]; }
  std::vector<int> number_;

 public:
  std::uint64_t key_of_cell(int i) const { return key(cell[i]); }
};

template <class T>
struct Solver {
  Host host;
  kernels::Pressure<Host, T> pressure;

  explicit Solver(const Lattice<T>& lattice, kernels::HostThreads threads = {chunks_in_turn, nullptr})
      : host(threads) {
    const int n = lattice.size();
    auto& fine = pressure.multigrid.level[0];
    fine.resize(n), pressure.resize(n);
    for (int i = 0; i < n; ++i) {
      fine.key.data()[i] = lattice.key_of_cell(i);
      for (int d = 0; d < kDirections; ++d) {
        const std::size_t at = static_cast<std::size_t>(d) * n + i;
        const int other = lattice.beside[i][d];
        fine.neighbour.data()[at] = other < 0 ? i : other;
        pressure.face.data()[at] = other < 0 ? T(0) : lattice.c[i][d];
      }
      pressure.open.data()[i] = lattice.open[i], pressure.right.data()[i] = lattice.b[i];
    }
    pressure.prepare(host);
  }

  kernels::PressureFigures solve(double tolerance, int most_iterations = 200) {
    return pressure.solve(host, tolerance, most_iterations);
  }
  VectorXd answer() const { return Eigen::Map<const VectorXd>(pressure.pressure.data(), pressure.cells()); }

  // The cycle on all cells but those that `out` says.
  void choose(const Lattice<T>& lattice, const std::vector<bool>& out) {
    const int n = lattice.size();
    auto& fine = pressure.multigrid.level[0];
    for (int i = 0; i < n; ++i) {
      fine.diagonal.data()[i] = out[i] ? T(0) : lattice.open[i];
      for (int d = 0; d < kDirections; ++d) {
        const int other = lattice.beside[i][d];
        const bool linked = other >= 0 && !out[i] && !out[other];
        fine.link.data()[static_cast<std::size_t>(d) * n + i] = linked ? lattice.c[i][d] : T(0);
      }
    }
    pressure.multigrid.galerkin(host);
  }
  VectorXd cycle(const VectorXd& right) {
    auto& fine = pressure.multigrid.level[0];
    for (int i = 0; i < right.size(); ++i) fine.right.data()[i] = static_cast<T>(right[i]);
    pressure.multigrid.cycle(host);
    VectorXd x(right.size());
    for (int i = 0; i < right.size(); ++i) x[i] = fine.x.data()[i];
    return x;
  }
};

template <class T>
class KernelPressure : public testing::Test {
 protected:
  static constexpr bool kDouble = std::is_same_v<T, double>;
  static constexpr double either(double in_double, double in_float) { return kDouble ? in_double : in_float; }

  // A number of a cell or a face that is the same however it is come by, in [0, 1).
  static double noise(At a, At b, std::uint64_t seed) {
    std::uint64_t h = seed;
    for (int c = 0; c < 3; ++c)
      h = (h ^ static_cast<std::uint64_t>(a[c] + b[c] + 1000)) * 0x9e3779b97f4a7c15ull, h ^= h >> 29;
    return static_cast<double>(h >> 11) / 9007199254740992.0;
  }
  // Coefficients over two decades, evenly on a logarithmic scale.
  static double two_decades(At a, At b) { return std::pow(10, 2 * noise(a, b, 7) - 1); }

  std::mt19937 generator_{5};
};
struct PrecisionNames {
  template <class T>
  static std::string GetName(int) {
    return std::is_same_v<T, double> ? "double" : "float";
  }
};
using Precisions = testing::Types<double, float>;
TYPED_TEST_SUITE(KernelPressure, Precisions, PrecisionNames);

// ---- Manufactured solutions of -div(k grad p) = f

// A smooth problem: p, f and k at a place; cells of edge h, the first one's middle at `first`.
struct Smooth {
  std::function<double(const Vector3d&)> p, k, f;
  double h;
  Vector3d first;

  Vector3d middle(At a) const { return first + h * Vector3d(a[0], a[1], a[2]); }
  double coefficient(At a, At b) const { return k((middle(a) + middle(b)) / 2); }
};

// The largest error over the largest p. Outside, at the middles of the cells beyond faces that let through,
// p is what the smooth solution is there (0 for air on its own surface).
template <class T>
double error_of(const Smooth& smooth, Lattice<T>& lattice) {
  VectorXd exact(lattice.size());
  for (int i = 0; i < lattice.size(); ++i) {
    const At at = lattice.cell[i];
    exact[i] = smooth.p(smooth.middle(at));
    double b = smooth.h * smooth.h * smooth.f(smooth.middle(at));
    for (int d = 0; d < kDirections; ++d)
      if (lattice.beside[i][d] < 0 && lattice.c[i][d] > 0)
        b += lattice.c[i][d] * smooth.p(smooth.middle(lattice.beyond(at, d)));
    lattice.b[i] = static_cast<T>(b);
  }
  Solver<T> solver(lattice);
  const kernels::PressureFigures told = solver.solve(1e-9);
  EXPECT_LE(told.residual, 1e-9);
  EXPECT_GT(exact.minCoeff(), 0);
  return (solver.answer() - exact).cwiseAbs().maxCoeff() / exact.maxCoeff();
}

void expect_second_order(const std::vector<double>& error, const std::vector<double>& h) {
  for (std::size_t k = 1; k < error.size(); ++k) {
    const double order = std::log(error[k - 1] / error[k]) / std::log(h[k - 1] / h[k]);
    EXPECT_GE(order, 1.8) << "h " << h[k - 1] << " to " << h[k] << ", errors " << error[k - 1] << ", "
                          << error[k];
  }
  EXPECT_LT(error.back(), 0.01);
}

// In air all round: p = 0 at the middles of the cells outside. f takes both signs.
TYPED_TEST(KernelPressure, IsOfSecondOrderInABoxInAir) {
  const auto bump = [](double x) { return std::sin(kPi * x) * (1.5 + std::cos(3 * kPi * x)); };
  const auto bent = [](double x) {  // its second derivative
    const double s = std::sin(kPi * x), c = std::cos(kPi * x);
    const double s3 = std::sin(3 * kPi * x), c3 = std::cos(3 * kPi * x);
    return kPi * kPi * (-s * (1.5 + c3) - 6 * c * s3 - 9 * s * c3);
  };
  std::vector<double> error, h;
  double least = 0;
  for (const int n : {15, 31, 63}) {
    Smooth smooth;
    smooth.h = 1.0 / (n + 1), smooth.first = Vector3d::Constant(smooth.h);
    smooth.p = [&](const Vector3d& x) { return bump(x[0]) * bump(x[1]) * bump(x[2]); };
    smooth.k = [](const Vector3d&) { return 1.0; };
    smooth.f = [&](const Vector3d& x) {
      const double f = -(bent(x[0]) * bump(x[1]) * bump(x[2]) + bump(x[0]) * bent(x[1]) * bump(x[2]) +
                         bump(x[0]) * bump(x[1]) * bent(x[2]));
      least = std::min(least, f);
      return f;
    };
    Lattice<TypeParam> lattice(
        n, [](At) { return true; }, [](At, At) { return 1.0; });
    error.push_back(error_of(smooth, lattice)), h.push_back(smooth.h);
  }
  EXPECT_LT(least, -10) << "cells that separate among others that press";
  expect_second_order(error, h);
}

// The cells of a ball, coefficients that vary; its staircase of outside cells has the values of p there.
TYPED_TEST(KernelPressure, IsOfSecondOrderInABallOfVaryingMass) {
  std::vector<double> error, h;
  for (const int n : {12, 24, 48}) {
    Smooth smooth;
    smooth.h = 2.0 / n, smooth.first = Vector3d::Constant(-1 + smooth.h / 2);
    smooth.p = [](const Vector3d& x) {
      return std::exp(x[0]) * (2 + std::sin(2 * x[1])) * (3 + x[2] * x[2]);
    };
    smooth.k = [](const Vector3d& x) { return 1 + 0.5 * std::sin(2 * x[0] + x[1]); };
    smooth.f = [](const Vector3d& x) {
      const double e = std::exp(x[0]), s = 2 + std::sin(2 * x[1]), q = 3 + x[2] * x[2];
      const double k = 1 + 0.5 * std::sin(2 * x[0] + x[1]), slope = 0.5 * std::cos(2 * x[0] + x[1]);
      const double laplace = e * s * q - 4 * e * std::sin(2 * x[1]) * q + 2 * e * s;
      return -(k * laplace + slope * (2 * e * s * q + 2 * e * std::cos(2 * x[1]) * q));
    };
    const auto in = [&](At a) { return smooth.middle(a).norm() < 1 - smooth.h / 2; };
    Lattice<TypeParam> lattice(n, in, [&](At a, At b) { return smooth.coefficient(a, b); });
    error.push_back(error_of(smooth, lattice)), h.push_back(smooth.h);
  }
  expect_second_order(error, h);
}

// Walls on five sides, where nothing passes, and air above.
TYPED_TEST(KernelPressure, IsOfSecondOrderBetweenWalls) {
  std::vector<double> error, h;
  for (const int n : {12, 24, 48}) {
    Smooth smooth;
    smooth.h = 1 / (n + 0.5), smooth.first = Vector3d::Constant(smooth.h / 2);
    const double width = n * smooth.h;
    smooth.p = [=](const Vector3d& x) {
      return (2 + std::cos(kPi * x[0] / width) * std::cos(2 * kPi * x[1] / width)) * std::cos(kPi * x[2] / 2);
    };
    smooth.k = [](const Vector3d&) { return 1.0; };
    smooth.f = [=](const Vector3d& x) {
      const double wave = std::cos(kPi * x[0] / width) * std::cos(2 * kPi * x[1] / width);
      const double steep = 5 * kPi * kPi / (width * width), up = kPi * kPi / 4;
      return (steep * wave + up * (2 + wave)) * std::cos(kPi * x[2] / 2);
    };
    const auto passes = [n](At a, At b) {
      for (const At& at : {a, b})
        if (at[0] < 0 || at[1] < 0 || at[2] < 0 || at[0] == n || at[1] == n) return 0.0;
      return 1.0;
    };
    Lattice<TypeParam> lattice(
        n, [](At) { return true; }, passes);
    error.push_back(error_of(smooth, lattice)), h.push_back(smooth.h);
  }
  expect_second_order(error, h);
}

// ---- The unilateral problem

// The answer by projected Gauss-Seidel, to where a sweep changes it no more.
template <class T>
VectorXd projected_gauss_seidel(const Lattice<T>& lattice) {
  VectorXd p = VectorXd::Zero(lattice.size());
  for (int sweep = 0; sweep < 200000; ++sweep) {
    double change = 0;
    for (int i = 0; i < lattice.size(); ++i) {
      if (!(lattice.open[i] > 0)) continue;
      const double before = p[i];
      p[i] = std::max(0.0, before + (lattice.b[i] - lattice.apply(p, i)) / lattice.open[i]);
      change = std::max(change, std::abs(p[i] - before));
    }
    if (change <= 1e-14 * p.maxCoeff()) return p;
  }
  ADD_FAILURE() << "the reference did not settle";
  return p;
}

TYPED_TEST(KernelPressure, IsThatOfProjectedGaussSeidel) {
  std::normal_distribution<double> normal;
  int pressed = 0, free = 0;
  for (int problem = 0; problem < 60; ++problem) {
    const int n = 3 + problem % 6;
    const double share = 0.3 + 0.7 * (problem % 4) / 3.0;
    const std::uint64_t seed = 100 + problem;
    const auto in = [&](At a) { return this->noise(a, a, seed) < share; };
    const auto c = [&](At a, At b) { return std::pow(10, 2 * this->noise(a, b, seed + 1000) - 1); };
    Lattice<TypeParam> lattice(n, in, c);
    const double lean = (problem % 3 - 1) * 0.5;  // mostly separating, mixed, mostly compressed
    for (TypeParam& b : lattice.b) b = static_cast<TypeParam>(normal(this->generator_) + lean);
    Solver<TypeParam> solver(lattice);
    const kernels::PressureFigures told = solver.solve(1e-11);
    const VectorXd p = solver.answer(), expected = projected_gauss_seidel(lattice);
    EXPECT_LE(told.residual, 1e-11) << "problem " << problem << ", " << lattice.size() << " cells";
    EXPECT_LT((p - expected).cwiseAbs().maxCoeff(), 1e-8 * expected.maxCoeff())
        << "problem " << problem << ", " << lattice.size() << " cells";
    for (int i = 0; i < lattice.size(); ++i)
      if (expected[i] > 1e-6 * expected.maxCoeff()) {
        ++pressed;
        EXPECT_NEAR(lattice.apply(p, i), lattice.b[i], 1e-7) << "problem " << problem;
      } else if (lattice.apply(expected, i) > lattice.b[i] + 1e-6) {
        ++free;
        EXPECT_EQ(p[i], 0) << "problem " << problem << ": nothing is pulled where hair separates";
      }
  }
  EXPECT_GT(pressed, 1000);
  EXPECT_GT(free, 1000);
}

TYPED_TEST(KernelPressure, LeavesTheResidualThatItTells) {
  std::normal_distribution<double> normal;
  const auto in = [](At a) { return Vector3d(a[0] - 11.5, a[1] - 11.5, a[2] - 11.5).norm() < 12; };
  for (const double tolerance : {0.3, 1e-2, 1e-4, 1e-7}) {
    Lattice<TypeParam> lattice(24, in, this->two_decades);
    for (TypeParam& b : lattice.b) b = static_cast<TypeParam>(normal(this->generator_));
    Solver<TypeParam> solver(lattice);
    const kernels::PressureFigures told = solver.solve(tolerance);
    const double residual = lattice.residual(solver.answer());
    EXPECT_LE(residual, tolerance * (1 + 1e-6));
    EXPECT_NEAR(residual, told.residual, 1e-5 * tolerance);
    EXPECT_GE(solver.answer().minCoeff(), 0);
    EXPECT_GT(told.iterations, 0);
    EXPECT_GE(told.iterations, told.sets);
  }
}

TYPED_TEST(KernelPressure, SaysHowFarItGotInTheIterationsThatItMayTake) {
  const auto in = [](At) { return true; };
  Lattice<TypeParam> lattice(16, in, this->two_decades);
  lattice.b.assign(lattice.size(), TypeParam(1));
  for (int most = 0; most < 6; ++most) {
    Solver<TypeParam> solver(lattice);
    const kernels::PressureFigures told = solver.solve(1e-10, most);
    EXPECT_EQ(told.iterations, most);
    EXPECT_GT(told.residual, 1e-10);
    EXPECT_NEAR(lattice.residual(solver.answer()), told.residual, 1e-5 * told.residual);
  }
}

TYPED_TEST(KernelPressure, IsNoneWhereNothingIsCompressed) {
  Lattice<TypeParam> lattice(
      12, [](At) { return true; }, this->two_decades);
  for (int i = 0; i < lattice.size(); ++i) lattice.b[i] = static_cast<TypeParam>(i % 3 ? -0.1 * i : 0.0);
  Solver<TypeParam> solver(lattice);
  const kernels::PressureFigures told = solver.solve(1e-4);
  EXPECT_EQ(told.iterations, 0);
  EXPECT_EQ(told.sets, 0);
  EXPECT_EQ(told.residual, 0);
  EXPECT_EQ(solver.answer().cwiseAbs().maxCoeff(), 0);
}

// A solve leaves nothing behind that the next one minds.
TYPED_TEST(KernelPressure, DependsOnNoEarlierProblemAndNoOrderOfChunks) {
  Lattice<TypeParam> lattice(
      20, [&](At a) { return this->noise(a, a, 3) < 0.8; }, this->two_decades);
  std::normal_distribution<double> normal;
  for (TypeParam& b : lattice.b) b = static_cast<TypeParam>(normal(this->generator_));
  Solver<TypeParam> once(lattice), shuffling(lattice, {chunks_shuffled, &this->generator_}), twice(lattice);
  once.solve(1e-6), shuffling.solve(1e-6);
  for (TypeParam& b : lattice.b) b = -b;
  std::copy(lattice.b.begin(), lattice.b.end(), twice.pressure.right.data());
  twice.solve(1e-6);
  for (TypeParam& b : lattice.b) b = -b;
  std::copy(lattice.b.begin(), lattice.b.end(), twice.pressure.right.data());
  twice.solve(1e-6);
  EXPECT_EQ(once.answer(), shuffling.answer());
  EXPECT_EQ(once.answer(), twice.answer());
}

// Cells that walls enclose have no pressure of their own to find: the rest is solved all the same.
TYPED_TEST(KernelPressure, GetsAlongWithCellsThatWallsEnclose) {
  const auto in = [](At) { return true; };
  const auto c = [](At a, At b) {  // nothing passes the planes x = 3 and x = 4
    return (a[0] == 3) == (b[0] == 3) ? (a[0] == 3 ? 0.0 : 1.0) : 0.0;
  };
  Lattice<TypeParam> lattice(8, in, c);
  for (int i = 0; i < lattice.size(); ++i) lattice.b[i] = TypeParam(lattice.open[i] > 0 ? 1 : 0);
  Solver<TypeParam> solver(lattice);
  EXPECT_LE(solver.solve(1e-8).residual, 1e-8);
  const VectorXd p = solver.answer(), expected = projected_gauss_seidel(lattice);
  EXPECT_LT((p - expected).cwiseAbs().maxCoeff(), 1e-6 * expected.maxCoeff());
}

// ---- Resolution

// A ball of hair, a share of it a hundred times as heavy in boxes that are as many at each resolution, or in
// cells by chance; squeezed from all sides but for `separating` of its width, which is drawn apart as much.
struct HairBall {
  bool by_cell;
  double separating, tolerance;
};

template <class T, class Noise>
int iterations_in(const HairBall& ball, int n, const Noise& noise) {
  const auto in = [n](At a) {
    const double m = (n - 1) / 2.0;
    return Vector3d(a[0] - m, a[1] - m, a[2] - m).norm() < n / 2.0;
  };
  const auto heavy = [&](At a) {
    if (ball.by_cell) return noise(a, At{}, 11) < 0.2;
    return (a[0] * 4 / n + a[1] * 4 / n + a[2] * 4 / n) % 2 == 0;
  };
  Lattice<T> lattice(n, in, [&](At a, At b) { return heavy(a) || heavy(b) ? 0.01 : 1.0; });
  for (int i = 0; i < lattice.size(); ++i)
    lattice.b[i] = T(lattice.cell[i][0] < ball.separating * n ? -1 : 1);
  Solver<T> solver(lattice);
  const kernels::PressureFigures told = solver.solve(ball.tolerance);
  EXPECT_LE(lattice.residual(solver.answer()), ball.tolerance * (1 + 1e-6));
  return told.iterations;
}

template <class T, class Noise>
void expect_no_more_where_finer(double separating, const Noise& noise) {
  for (const bool by_cell : {false, true})
    for (const double tolerance : {1e-4, 1e-6}) {
      const HairBall ball{by_cell, separating, tolerance};
      // Twice as fine takes one or two more where the pressure has to find its bounds or coefficients jump
      // from cell to cell; what is 16 cells across is hardly more than its surface.
      const int coarse = iterations_in<T>(ball, 32, noise), fine = iterations_in<T>(ball, 64, noise);
      EXPECT_LE(fine, coarse + 2) << "heavy " << (by_cell ? "cells" : "boxes") << ", to " << tolerance;
    }
}

TYPED_TEST(KernelPressure, TakesNoMoreIterationsWhereTheGridIsFiner) {
  expect_no_more_where_finer<TypeParam>(0, this->noise);
}
TYPED_TEST(KernelPressure, TakesNoMoreIterationsWherePartOfTheHairSeparates) {
  expect_no_more_where_finer<TypeParam>(0.25, this->noise);
}

// ---- The cycle

TYPED_TEST(KernelPressure, CycleIsSymmetricAndPositiveDefinite) {
  const double rounding = this->either(1e-12, 1e-4);
  std::normal_distribution<double> normal;
  for (int problem = 0; problem < 12; ++problem) {
    const double share = problem % 2 ? 1 : 0.6;
    const auto in = [&](At a) { return this->noise(a, a, problem) < share; };
    Lattice<TypeParam> lattice(4 + 2 * problem, in, this->two_decades);
    const int n = lattice.size();
    std::vector<bool> out(n);
    for (int i = 0; i < n; ++i) out[i] = problem % 3 && this->noise(lattice.cell[i], {}, 9) < 0.3;
    Solver<TypeParam> solver(lattice);
    solver.choose(lattice, out);
    VectorXd x(n), y(n);
    for (int i = 0; i < n; ++i) {
      x[i] = out[i] ? 0 : static_cast<TypeParam>(normal(this->generator_));
      y[i] = out[i] ? 0 : static_cast<TypeParam>(normal(this->generator_));
    }
    const VectorXd mx = solver.cycle(x), my = solver.cycle(y);
    EXPECT_GT(x.dot(mx), 0);
    EXPECT_GT(y.dot(my), 0);
    EXPECT_NEAR(x.dot(my), y.dot(mx), rounding * std::sqrt(x.dot(mx) * y.dot(my))) << n << " cells";
    for (int i = 0; i < n; ++i) EXPECT_TRUE(!out[i] || mx[i] == 0) << "out of the problem";
  }
}

// All of M's eigenvalues, on small problems: M as a matrix, column by column.
TYPED_TEST(KernelPressure, CycleHasNoNegativeEigenvalueAndStaysNearTheInverse) {
  for (int problem = 0; problem < 6; ++problem) {
    const auto in = [&](At a) { return problem % 2 || this->noise(a, a, problem + 40) < 0.7; };
    Lattice<TypeParam> lattice(6 + problem % 3, in, this->two_decades);
    const int n = lattice.size();
    std::vector<bool> out(n);
    for (int i = 0; i < n; ++i) out[i] = problem >= 3 && this->noise(lattice.cell[i], {}, 9) < 0.3;
    std::vector<int> inside;
    for (int i = 0; i < n; ++i)
      if (!out[i]) inside.push_back(i);
    Solver<TypeParam> solver(lattice);
    solver.choose(lattice, out);
    const int m = static_cast<int>(inside.size());
    Eigen::MatrixXd cycle(m, m), matrix(m, m);
    for (int j = 0; j < m; ++j) {
      const VectorXd unit = VectorXd::Unit(n, inside[j]);
      const VectorXd column = solver.cycle(unit);
      for (int i = 0; i < m; ++i)
        cycle(i, j) = column[inside[i]], matrix(i, j) = lattice.apply(unit, inside[i]);
    }
    const Eigen::MatrixXd even = (cycle + cycle.transpose()) / 2;
    EXPECT_LT((cycle - even).norm(), this->either(1e-13, 1e-5) * cycle.norm());
    // Of M A: those of L^T M L with A = L L^T.
    const Eigen::MatrixXd l = matrix.llt().matrixL();
    const VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(l.transpose() * even * l).eigenvalues();
    EXPECT_GT(values.minCoeff(), 0.05) << m << " cells";
    EXPECT_LT(values.maxCoeff(), 2) << m << " cells";
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
