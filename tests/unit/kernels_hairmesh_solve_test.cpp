// The solves of a hair mesh's step against dense ones by Eigen.
#include <gtest/gtest.h>

#include <algorithm>

#include "kernels/hairmesh/hair_mesh_model.h"
#include "kernels/hairmesh/hair_mesh_step.h"
#include "kernels_hairmesh_support.h"

namespace ringlet::kernels_testing {
namespace {

using kernels::HairMeshModel;
using kernels::HairMeshView;
using kernels::MeshStepper;
using kernels::Padded;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

constexpr double kStep = 1.0 / 24;

struct Solve {
  RestMesh mesh;
  HairMeshModel<double> model;
  MeshStepper<double> solver;
  std::vector<double> position, velocity, roots;
  kernels::HairMeshStep<double> step{};

  explicit Solve(RestMesh rest, const HairMeshParameters& parameters)
      : mesh(std::move(rest)),
        model(mesh.topology, mesh.rest, parameters),
        solver(model.view()),
        position(mesh.rest),
        velocity(position.size(), 0) {
    for (int c = 0; c < mesh.topology.columns; ++c)
      for (int k = 0; k < 3; ++k)
        roots.push_back(mesh.rest[3 * c * mesh.topology.layers + k] + 0.01 * (k + 1));
    step.step = kStep, step.roots = roots.data(), step.gravity[1] = -9.81;
    for (int k = 0; k < 3; ++k) step.rotation[4 * k] = 1;
    std::mt19937 engine(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (std::size_t i = 0; i < position.size(); ++i)
      position[i] += 0.003 * uniform(engine), velocity[i] = 0.2 * uniform(engine);
  }
};

template <class T>
class HairMeshFineLayers : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(HairMeshFineLayers, Precisions);

// Rows of free vertices.
Matrix dense(MeshStepper<double>& solver, const HairMeshTopology& t, const std::vector<int>& rows) {
  const auto count = static_cast<Eigen::Index>(rows.size());
  Matrix a(3 * count, 3 * count);
  std::vector<Padded<double>> x(static_cast<std::size_t>(t.vertices()) + 2, Padded<double>{}), y = x;
  for (Eigen::Index j = 0; j < count; ++j)
    for (int c = 0; c < 3; ++c) {
      x[rows[j]][c] = 1;
      solver.multiply(x.data(), y.data());
      x[rows[j]][c] = 0;
      for (Eigen::Index i = 0; i < count; ++i)
        for (int k = 0; k < 3; ++k) a(3 * i + k, 3 * j + c) = y[rows[i]][k];
    }
  return a;
}

TEST(HairMeshSolve, AgreesWithADenseSolveAndKeepsWhatIsPrescribed) {
  for (const RestMesh& mesh : {hair_cap({5, 8}, 4, 0.05, 0.4, 0.01), hair_cap({5, 8}, 5, 0.05, 0.4, 0.01),
                               hair_cap({5, 8}, 10, 0.05, 0.4, 0.002), hanging_lock(3, 7, 0.1, 0.2)}) {
    const int layers = mesh.topology.layers;
    HairMeshParameters parameters;
    parameters.tolerance = 1e-11;
    Solve s(mesh, parameters);
    const HairMeshTopology& t = s.mesh.topology;
    s.solver.set_state(s.position.data(), s.velocity.data());
    const Eigen::Vector3d normal = Eigen::Vector3d(1, 2, -2) / 3, surface(0.3, 0.1, -0.2);
    const std::vector<int> held{t.vertex(3, 2), t.vertex(3, layers - 1), t.vertex(7, 1),
                                t.vertex(9, layers - 1)};
    std::vector<kernels::MeshContact<double>> contacts;
    for (const int v : held) {
      kernels::MeshContact<double> contact{};
      contact.vertex = v;
      for (int k = 0; k < 3; ++k) contact.normal[k] = normal[k], contact.velocity[k] = surface[k];
      contacts.push_back(contact);
    }
    s.solver.set_contacts(contacts.data(), static_cast<int>(contacts.size()));
    s.solver.assemble(s.step);
    std::vector<int> rows;
    for (int v = 0; v < t.vertices(); ++v)
      if (t.layer_of(v) > 0) rows.push_back(v);
    const Matrix a = dense(s.solver, t, rows);
    Vector b(a.rows());
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (int k = 0; k < 3; ++k) b[3 * static_cast<int>(i) + k] = s.solver.impulse()[rows[i]][k];
    // A dv = b but for what holds the normals of the held, and n . dv = 0 there.
    const auto n = a.rows();
    const auto m = static_cast<Eigen::Index>(held.size());
    Matrix kkt = Matrix::Zero(n + m, n + m);
    Vector right = Vector::Zero(n + m);
    kkt.topLeftCorner(n, n) = a, right.head(n) = b;
    for (Eigen::Index k = 0; k < m; ++k) {
      const auto row = std::find(rows.begin(), rows.end(), held[k]) - rows.begin();
      kkt.block<1, 3>(n + k, 3 * row) = normal.transpose(), kkt.block<3, 1>(3 * row, n + k) = normal;
    }
    const Vector expected = kkt.fullPivLu().solve(right);
    const kernels::SolveFigures figures = s.solver.solve();
    EXPECT_LE(figures.residual, 1e-11);
    EXPECT_GT(figures.iterations, 3);
    double worst = 0;
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (int k = 0; k < 3; ++k)
        worst =
            std::max(worst, std::abs(s.solver.change()[rows[i]][k] - expected[3 * static_cast<int>(i) + k]));
    EXPECT_LE(worst, 1e-8 * expected.head(n).cwiseAbs().maxCoeff()) << layers;
    std::vector<double> x(s.position.size()), v(x.size());
    s.solver.get_state(x.data(), v.data());
    for (const int i : held) {
      const Eigen::Vector3d after = Eigen::Map<const Eigen::Vector3d>(v.data() + 3 * i);
      EXPECT_NEAR(normal.dot(after - surface), 0, 1e-14);
    }
    for (int c = 0; c < t.columns; ++c)
      for (int k = 0; k < 3; ++k) {
        const auto i = static_cast<std::size_t>(3 * t.vertex(c, 0) + k),
                   root = static_cast<std::size_t>(3 * c + k);
        EXPECT_EQ(x[i], s.roots[root]);
        EXPECT_NEAR(v[i], (s.roots[root] - s.position[i]) / kStep, 1e-12);
      }
  }
}

// In float too the residual that is reported is one of the system.
TEST(HairMeshSolve, ReachesItsToleranceInFloat) {
  for (const int vertices : {215, 361, 2305}) {
    MeshRun<float> run(paper_mesh(vertices));
    for (int frame = 1; frame <= 24; ++frame) {
      run.head(Eigen::AngleAxisd(0.5 * std::sin(0.2 * frame), Eigen::Vector3d::UnitY()).toRotationMatrix(),
               Eigen::Vector3d(0.05 * std::sin(0.3 * frame), 0, 0));
      run.frame();
      EXPECT_LE(run.solved.residual, 1e-4) << vertices << " frame " << frame;
      EXPECT_LE(run.solved.iterations, 100) << vertices;
    }
  }
}

// Blocks that are much stiffer along one direction than across, as those of short segments are.
TEST(HairMeshSolve, InvertsStiffBlocksAsWellAsTheyAreKnown) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (const double ratio : {1.0, 1e2, 1e4, 1e6})
    for (int k = 0; k < 100; ++k) {
      const Eigen::Vector3f n =
          Eigen::Vector3d(uniform(engine), uniform(engine), uniform(engine)).normalized().cast<float>();
      const Eigen::Matrix3f a = Eigen::Matrix3f::Identity() + static_cast<float>(ratio) * n * n.transpose();
      Padded<float> block[3], inverse[3];
      for (int c = 0; c < 3; ++c) block[c] = Padded<float>{a(0, c), a(1, c), a(2, c), 0};
      kernels::invert(block, inverse);
      const Eigen::Matrix3d expected = a.cast<double>().inverse();
      double error = 0;
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) {
          error = std::max(error, std::abs(inverse[c][r] - expected(r, c)));
          EXPECT_EQ(inverse[c][r], inverse[r][c]);
        }
      EXPECT_LE(error, 4e-7 * (1 + ratio) * expected.cwiseAbs().maxCoeff()) << ratio;
    }
}

// Layers far finer than columns are apart: segments so stiff that rounding the solution to single precision
// leaves more than is asked for.
TYPED_TEST(HairMeshFineLayers, ReachTheirResidual) {
  for (const int layers : {30, 60}) {
    MeshRun<TypeParam> run(hair_cap({6, 12}, layers, 0.02, 0.1));
    run.set();
    for (int frame = 1; frame <= 12; ++frame) {
      run.head(Eigen::AngleAxisd(0.3 * std::sin(0.4 * frame), Eigen::Vector3d::UnitY()).toRotationMatrix(),
               Eigen::Vector3d(0.03 * std::sin(0.5 * frame), 0, 0));
      run.frame();
      const double bound = std::is_same_v<TypeParam, float> ? 1e-2 : 1e-4;
      EXPECT_LE(run.solved.residual, bound) << layers << " layers, frame " << frame;
      EXPECT_LE(run.solved.iterations, 100) << layers << " layers, frame " << frame;
    }
  }
}

// Spring lengths of edges as they were, in the least squares, with corrected vertices and roots kept.
class HairMeshMinimisation : public testing::TestWithParam<int> {};
TEST_P(HairMeshMinimisation, AgreesWithConstrainedLeastSquares) {
  HairMeshParameters parameters;
  parameters.tolerance = 1e-12;
  Solve s(hair_cap({5, 8, 8}, GetParam(), 0.05, 0.3), parameters);
  const HairMeshTopology& t = s.mesh.topology;
  s.solver.set_state(s.position.data(), s.velocity.data());
  s.solver.assemble(s.step), s.solver.solve();
  std::vector<double> before(s.position.size()), v_before(before.size()), after(before.size()),
      v_after(before.size());
  s.solver.get_state(before.data(), v_before.data());
  // All that is external and on one side is moved by what depends on its place.
  const auto find = [](const double*, const double* point, double, kernels::MeshSurfacePoint<double>& found) {
    if (!(point[0] > 0.06)) return false;
    found = {{0.06 - 0.2 * (point[0] - 0.06), point[1], point[2]}, {-1, 0, 0}, {0, 0, 0}, 0};
    return true;
  };
  const kernels::MeshContactFigures contacts = s.solver.collide(kernels::mesh_surface<double>(find));
  ASSERT_GT(contacts.corrected, 3);
  std::vector<double> corrected(before.size()), unused(before.size());
  s.solver.get_state(corrected.data(), unused.data());
  const kernels::SolveFigures figures = s.solver.minimise();
  EXPECT_LE(figures.residual, 1e-12);
  s.solver.get_state(after.data(), v_after.data());

  const auto edges = t.mesh_edges();
  Matrix incidence = Matrix::Zero(static_cast<Eigen::Index>(edges.size()), t.vertices());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    incidence(static_cast<Eigen::Index>(e), edges[e][0]) = 1,
                                            incidence(static_cast<Eigen::Index>(e), edges[e][1]) = -1;
  }
  std::vector<int> kept;
  for (int v = 0; v < t.vertices(); ++v)
    if (t.layer_of(v) == 0 || corrected[3 * v] != before[3 * v]) kept.push_back(v);
  const auto n = t.vertices(), m = static_cast<int>(kept.size());
  Matrix kkt = Matrix::Zero(n + m, n + m);
  kkt.topLeftCorner(n, n) = incidence.transpose() * incidence;
  for (int k = 0; k < m; ++k) kkt(n + k, kept[k]) = kkt(kept[k], n + k) = 1;
  const Eigen::FullPivLU<Matrix> solve(kkt);
  for (int axis = 0; axis < 3; ++axis) {
    Vector x(n), right(n + m);
    for (int v = 0; v < n; ++v) x[v] = before[3 * v + axis];
    right.head(n) = incidence.transpose() * (incidence * x);
    for (int k = 0; k < m; ++k) right[n + k] = corrected[3 * kept[k] + axis];
    const Vector expected = solve.solve(right);
    for (int v = 0; v < n; ++v) EXPECT_NEAR(after[3 * v + axis], expected[v], 1e-10) << v;
  }
  // Velocities follow what minimising moved; kept vertices stay to the last bit.
  for (int v = 0; v < n; ++v)
    for (int k = 0; k < 3; ++k) {
      const double moved = after[3 * v + k] - corrected[3 * v + k];
      EXPECT_NEAR(v_after[3 * v + k] - unused[3 * v + k], moved / kStep, 1e-11);
      if (std::find(kept.begin(), kept.end(), v) != kept.end()) {
        EXPECT_EQ(moved, 0);
      }
    }
}

INSTANTIATE_TEST_SUITE_P(Layers, HairMeshMinimisation, testing::Values(4, 7));

// A solve that goes on, with more prescribed and a new right-hand side, ends where a dense one does.
TEST(HairMeshSolve, GoesOnFromWhatItHas) {
  const RestMesh mesh = hair_cap({5, 8}, 7, 0.05, 0.3);
  const HairMeshTopology& t = mesh.topology;
  const HairMeshModel<double> model(t, mesh.rest, {});
  const HairMeshView<double> view = model.view();
  const kernels::PairLanes<double> lanes(t.columns, t.layers, 1, view.pattern.pairs);
  kernels::MeshLaplacian<double> laplacian(lanes, view.degree, view.first_neighbour, view.neighbour);
  kernels::VertexFilter<double> filter(t.columns, t.layers);
  kernels::FilteredConjugateGradients<double> gradients(lanes);
  Matrix a = Matrix::Zero(t.vertices(), t.vertices());
  for (const auto& [i, j] : t.mesh_edges()) a(i, i) += 1, a(j, j) += 1, a(i, j) -= 1, a(j, i) -= 1;
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<Padded<double>> x(static_cast<std::size_t>(t.vertices()), Padded<double>{}), b = x;
  const auto solve = [&](const std::vector<int>& held, auto go) {
    for (Padded<double>& value : b)
      value += Padded<double>{uniform(engine), uniform(engine), uniform(engine), 0};
    for (const int v : held) filter.prescribe_wholly(v);
    laplacian.factor(filter);
    const kernels::SolveFigures figures = (gradients.*go)(laplacian, filter, 1e-12, 100, b.data(), x.data());
    EXPECT_LE(figures.residual, 1e-12);
    EXPECT_GT(figures.iterations, 3);
  };
  using Gradients = kernels::FilteredConjugateGradients<double>;
  std::vector<int> held{t.vertex(2, 3)};
  solve(held, &Gradients::solve<kernels::MeshLaplacian<double>>);
  EXPECT_EQ(x[held[0]][0], 0);
  for (const int v : {t.vertex(2, 5), t.vertex(8, 6), t.vertex(9, 1)})
    held.push_back(v), x[v] = Padded<double>{1, -2, 0.5, 0};
  solve(held, &Gradients::solve_on<kernels::MeshLaplacian<double>>);
  EXPECT_EQ(x[held[1]][1], -2);
  std::vector<int> free;
  for (int v = 0; v < t.vertices(); ++v)
    if (t.layer_of(v) > 0 && std::count(held.begin(), held.end(), v) == 0) free.push_back(v);
  const Matrix inner = a(free, free), outer = a(free, held);
  for (int axis = 0; axis < 3; ++axis) {
    Vector right(static_cast<Eigen::Index>(free.size())), given(static_cast<Eigen::Index>(held.size()));
    for (std::size_t i = 0; i < free.size(); ++i) right[static_cast<Eigen::Index>(i)] = b[free[i]][axis];
    for (std::size_t i = 0; i < held.size(); ++i) given[static_cast<Eigen::Index>(i)] = x[held[i]][axis];
    const Vector expected = inner.ldlt().solve(right - outer * given);
    for (std::size_t i = 0; i < free.size(); ++i)
      EXPECT_NEAR(x[free[i]][axis], expected[static_cast<Eigen::Index>(i)], 1e-9) << free[i];
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
