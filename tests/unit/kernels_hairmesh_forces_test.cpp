// Energies of a hair mesh against their forces, and the system of a step against one put together from
// conditions.
#include <gtest/gtest.h>

#include <tuple>

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

// Vertices of elements with values beyond the last, as products want them.
std::vector<Padded<double>> shaken(const RestMesh& mesh, double by, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-by, by);
  std::vector<Padded<double>> x(static_cast<std::size_t>(mesh.topology.vertices()) + 2, Padded<double>{});
  for (int v = 0; v < mesh.topology.vertices(); ++v)
    for (int k = 0; k < 3; ++k) x[v][k] = mesh.at(v)[k] + uniform(engine);
  return x;
}

HairMeshParameters free_parameters() {
  HairMeshParameters parameters;
  parameters.held_roots = false;
  return parameters;
}

// What an element adds to the right-hand side with these factors.
template <class E>
std::vector<Padded<double>> impulse_of(const E& element, const std::vector<Padded<double>>& x,
                                       const std::vector<Padded<double>>& v,
                                       const kernels::StepFactors<double>& factors,
                                       std::vector<Padded<double>>& matrix) {
  std::vector<Padded<double>> impulse(x.size(), Padded<double>{});
  kernels::StepSystem<double> system{factors,
                                     x.data(),
                                     v.data(),
                                     impulse.data(),
                                     {reinterpret_cast<double*>(matrix.data())},
                                     {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  kernels::add_to<double>(system, element);
  return impulse;
}

// The largest error of the force against central differences of the energy, relative to the largest force.
template <class E>
double gradient_error(const E& element, std::vector<Padded<double>> x, std::vector<Padded<double>>& matrix) {
  const std::vector<Padded<double>> still(x.size(), Padded<double>{});
  const auto force = impulse_of(element, x, still, {1, 0, 0}, matrix);
  double worst = 0, largest = 0;
  for (const int v : element.vertex)
    for (int k = 0; k < 3; ++k) {
      const double at = x[v][k], step = 1e-6;
      x[v][k] = at + step;
      const double above = kernels::energy<double>(element, x.data());
      x[v][k] = at - step;
      const double below = kernels::energy<double>(element, x.data());
      x[v][k] = at;
      worst = std::max(worst, std::abs(force[v][k] + (above - below) / (2 * step)));
      largest = std::max(largest, std::abs(force[v][k]));
    }
  return worst / largest;
}

struct Made {
  RestMesh mesh;
  HairMeshModel<double> model;
  HairMeshView<double> view;
  std::vector<Padded<double>> matrix;  // memory for blocks, aligned as they are

  explicit Made(const HairMeshParameters& parameters = free_parameters(),
                RestMesh rest = hair_cap({5, 9, 9}, 4, 0.05, 0.3, 0.02))
      : mesh(std::move(rest)), model(mesh.topology, mesh.rest, parameters), view(model.view()) {
    const auto blocks = static_cast<std::size_t>(view.pattern.blocks);
    matrix.assign(blocks * kernels::kPairReals / 4, Padded<double>{});
  }
  template <class F>
  void each_kind(const F& f) const {
    f("spring", view.springs), f("sheet", view.sheets), f("bend", view.bends), f("volume", view.volumes);
  }
};

TEST(HairMeshForces, AreTheGradientsOfTheirEnergies) {
  Made made;
  const auto x = shaken(made.mesh, 0.01, 1);
  made.each_kind([&](const char* kind, const auto& elements) {
    ASSERT_GT(elements.count, 0) << kind;
    double worst = 0;
    for (int k = 0; k < elements.count; k += 3) {
      const double error = gradient_error(elements.data[k], x, made.matrix);
      ASSERT_TRUE(error >= 0) << kind << ' ' << k;
      worst = std::max(worst, error);
    }
    EXPECT_LE(worst, 1e-6) << kind;
  });
}

TEST(HairMeshForces, VanishAtRestAndInRigidMotion) {
  Made made;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  auto x = shaken(made.mesh, 0, 1), v = x;
  for (int i = 0; i < made.mesh.topology.vertices(); ++i) {
    const Eigen::Vector3d at = turn * made.mesh.at(i), rate = Eigen::Vector3d(3, -1, 2).cross(at);
    for (int k = 0; k < 3; ++k) x[i][k] = at[k] + 0.3, v[i][k] = rate[k] + 1;
  }
  made.each_kind([&](const char* kind, const auto& elements) {
    for (int k = 0; k < elements.count; ++k) {
      const auto& e = elements.data[k];
      double stiffness = 0;
      if constexpr (requires { e.across; })
        stiffness = e.across + e.shear;
      else
        stiffness = e.stiffness;
      EXPECT_LE(kernels::energy<double>(e, x.data()), 1e-22 * stiffness + 1e-30) << kind;
      const auto impulse = impulse_of(e, x, v, {1, 1, 0}, made.matrix);
      for (const int i : e.vertex)
        for (int c = 0; c < 3; ++c) EXPECT_LE(std::abs(impulse[i][c]), 1e-8 * stiffness) << kind;
    }
  });
}

TEST(HairMeshForces, DampingTakesEnergyAndNoMomentum) {
  Made made;
  const auto x = shaken(made.mesh, 0.02, 2);
  auto v = shaken(made.mesh, 1, 3);
  made.each_kind([&](const char* kind, const auto& elements) {
    for (int k = 0; k < elements.count; ++k) {
      const auto damping = impulse_of(elements.data[k], x, v, {0, 1, 0}, made.matrix);
      double power = 0, size = 0;
      Padded<double> sum{};
      for (const int i : elements.data[k].vertex) {
        power += kernels::dot_product(damping[i], v[i]);
        size += std::sqrt(kernels::dot_product(damping[i], damping[i])), sum += damping[i];
      }
      EXPECT_LE(power, 0) << kind;
      EXPECT_LE(std::sqrt(kernels::dot_product(sum, sum)), 1e-12 * size + 1e-30) << kind;
    }
  });
}

// A mesh turned inside out here and there.
std::vector<double> inverted(const RestMesh& mesh) {
  const auto x = shaken(mesh, 0.05, 4);
  std::vector<double> positions;
  for (int v = 0; v < mesh.topology.vertices(); ++v)
    for (int k = 0; k < 3; ++k) positions.push_back(x[v][k]);
  return positions;
}

kernels::HairMeshStep<double> step_of(const std::vector<double>& roots, double h) {
  kernels::HairMeshStep<double> step{};
  step.step = h, step.roots = roots.data();
  for (int k = 0; k < 3; ++k) step.rotation[4 * k] = 1;
  step.gravity[1] = -9.81;
  return step;
}

// The matrix of a solver, column after column of what it makes of unit vectors, over what is free.
Matrix dense(MeshStepper<double>& solver, int columns, int layers, int first_layer) {
  const int rows = columns * (layers - first_layer);
  Matrix a(3 * rows, 3 * rows);
  const auto vertex = [&](int row) {
    return row / (layers - first_layer) * layers + row % (layers - first_layer) + first_layer;
  };
  std::vector<Padded<double>> x(static_cast<std::size_t>(columns * layers) + 2, Padded<double>{}), y = x;
  for (int j = 0; j < rows; ++j)
    for (int c = 0; c < 3; ++c) {
      x[vertex(j)][c] = 1;
      solver.multiply(x.data(), y.data());
      x[vertex(j)][c] = 0;
      for (int i = 0; i < rows; ++i)
        for (int k = 0; k < 3; ++k) a(3 * i + k, 3 * j + c) = y[vertex(i)][k];
    }
  return a;
}

// Conditions as the paper has them, of dense vectors; Jacobians by central differences.
struct DenseSystem {
  const HairMeshView<double>& view;
  Vector x;
  double h;
  Matrix a;

  Eigen::Vector3d at(const Vector& from, int v) const { return from.segment<3>(3 * v); }

  template <class F>
  void add(double stiffness, const F& condition, const std::int32_t* vertices, int count) {
    const Vector c = condition(x);
    Matrix jacobian = Matrix::Zero(c.size(), x.size());
    for (int n = 0; n < count; ++n)
      for (int k = 0; k < 3; ++k) {
        const double step = 1e-6;
        Vector above = x, below = x;
        above[3 * vertices[n] + k] += step, below[3 * vertices[n] + k] -= step;
        jacobian.col(3 * vertices[n] + k) = (condition(above) - condition(below)) / (2 * step);
      }
    a += (h * h + h * view.damping) * stiffness * jacobian.transpose() * jacobian;
  }
  // Of a condition |w| - 1, w the sum of weights times positions.
  void add_tension(double stiffness, const std::int32_t* vertices, const double* weights, int count) {
    Eigen::Vector3d w = Eigen::Vector3d::Zero();
    for (int n = 0; n < count; ++n) w += weights[n] * at(x, vertices[n]);
    if (w.norm() <= 1) return;
    const Eigen::Vector3d u = w.normalized();
    const Eigen::Matrix3d k =
        h * h * stiffness * (1 - 1 / w.norm()) * (Eigen::Matrix3d::Identity() - u * u.transpose());
    for (int n = 0; n < count; ++n)
      for (int m = 0; m < count; ++m)
        a.block<3, 3>(3 * vertices[n], 3 * vertices[m]) += weights[n] * weights[m] * k;
  }

  void fill() {
    const int vertices = view.columns * view.layers;
    a = Matrix::Zero(3 * vertices, 3 * vertices);
    for (int i = 0; i < 3 * vertices; ++i) a(i, i) = view.mass[i / 3] * (1 + h * view.drag);
    for (int n = 0; n < view.springs.count; ++n) {
      const auto& e = view.springs.data[n];
      const double weights[] = {-e.inverse_length, e.inverse_length};
      add(
          e.stiffness,
          [&](const Vector& y) {
            return Vector::Constant(1,
                                    e.inverse_length * (at(y, e.vertex[1]) - at(y, e.vertex[0])).norm() - 1);
          },
          e.vertex, 2);
      add_tension(e.stiffness, e.vertex, weights, 2);
    }
    const auto weighted = [&](const Vector& y, const std::int32_t* v, const double* weight, int count) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int i = 0; i < count; ++i) sum += weight[i] * at(y, v[i]);
      return sum;
    };
    for (int n = 0; n < view.sheets.count; ++n) {
      const auto& e = view.sheets.data[n];
      const auto w = [&](const Vector& y, const double* weight) { return weighted(y, e.vertex, weight, 3); };
      add(
          e.across, [&](const Vector& y) { return Vector::Constant(1, w(y, e.v).norm() - 1); }, e.vertex, 3);
      add(
          e.shear, [&](const Vector& y) { return Vector::Constant(1, w(y, e.u).dot(w(y, e.v))); }, e.vertex,
          3);
      add_tension(e.across, e.vertex, e.v, 3);
    }
    for (int n = 0; n < view.bends.count; ++n) {
      const auto& e = view.bends.data[n];
      const auto w = [&](const Vector& y, const double* weight) { return weighted(y, e.vertex, weight, 4); };
      add(
          e.stiffness,
          [&](const Vector& y) {
            return Vector(w(y, e.own) - e.turn * w(y, e.before).cross(w(y, e.beside)));
          },
          e.vertex, 4);
    }
    for (int n = 0; n < view.volumes.count; ++n) {
      const auto& e = view.volumes.data[n];
      add(
          e.stiffness,
          [&](const Vector& y) {
            Eigen::Matrix3d edges;
            for (int k = 0; k < 3; ++k) edges.col(k) = at(y, e.vertex[k + 1]) - at(y, e.vertex[0]);
            return Vector::Constant(1, e.scale * edges.determinant() - e.rest);
          },
          e.vertex, 4);
    }
  }
};

TEST(HairMeshMatrix, IsWhatItsConditionsMakeOfItAndSymmetric) {
  for (const RestMesh& mesh : {hair_cap({4, 6}, 3, 0.05, 0.3, 0.02), hair_cap({4, 6}, 4, 0.05, 0.3, 0.02),
                               hair_cap({4, 6}, 10, 0.05, 0.3, 0.002), hanging_lock(3, 6, 0.1, 0.2)}) {
    const int layers = mesh.topology.layers;
    Made made(free_parameters(), mesh);
    MeshStepper<double> solver(made.view);
    const std::vector<double> x = inverted(made.mesh), still(x.size(), 0);
    solver.set_state(x.data(), still.data());
    solver.assemble(step_of(still, 1.0 / 24));
    DenseSystem expected{
        made.view, Eigen::Map<const Vector>(x.data(), static_cast<Eigen::Index>(x.size())), 1.0 / 24, {}};
    expected.fill();
    const Matrix a = dense(solver, made.view.columns, layers, 0);
    const double size = expected.a.cwiseAbs().maxCoeff();
    EXPECT_LE((a - a.transpose()).cwiseAbs().maxCoeff(), 1e-14 * size);
    EXPECT_LE((a - expected.a).cwiseAbs().maxCoeff(), 1e-7 * size) << layers;
  }
}

TEST(HairMeshMatrix, IsPositiveDefiniteWithInvertedPrisms) {
  for (const bool held : {true, false}) {
    HairMeshParameters parameters;
    parameters.held_roots = held;
    Made made(parameters, hair_cap({5, 7}, 4, 0.05, 0.3, 0.02));
    MeshStepper<double> solver(made.view);
    const std::vector<double> x = inverted(made.mesh), still(x.size(), 0);
    int turned_over = 0;
    const auto positions = shaken(made.mesh, 0.05, 4);
    for (int n = 0; n < made.view.volumes.count; ++n) {
      const auto& e = made.view.volumes.data[n];
      turned_over += kernels::volume_condition(e, positions.data()) + e.rest < 0;
    }
    ASSERT_GT(turned_over, made.view.volumes.count / 5);
    solver.set_state(x.data(), still.data());
    std::vector<double> roots;
    for (int c = 0; c < made.view.columns; ++c)
      for (int k = 0; k < 3; ++k) roots.push_back(x[3 * c * made.view.layers + k]);
    solver.assemble(step_of(roots, 1.0 / 24));
    const Matrix a = dense(solver, made.view.columns, made.view.layers, held ? 1 : 0);
    const Vector eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(a, Eigen::EigenvaluesOnly).eigenvalues();
    const double lightest =
        *std::min_element(made.view.mass, made.view.mass + made.view.columns * made.view.layers);
    // The rest of the matrix only adds to the masses.
    EXPECT_GE(eigenvalues[0], lightest * (1 - 1e-9));
  }
}

// Sweeps go over a pair's columns side by side, and in order over those that are coupled.
TEST(HairMeshMatrix, PairsColumnsThatNothingCouples) {
  for (const RestMesh& mesh : {paper_mesh(215), paper_mesh(361), paper_mesh(2305),
                               hanging_lock(6, 3, 0.1, 0.2), prism_column(3, 3, 0.02, 0.1)}) {
    const HairMeshModel<double> model(mesh.topology, mesh.rest, {});
    const kernels::BlockPattern pattern = model.view().pattern;
    std::vector<int> place(static_cast<std::size_t>(pattern.columns), -1);
    int alone = 0;
    for (int k = 0; k < pattern.pairs.count; ++k)
      for (int half = 0; half < 2; ++half) {
        const int column = pattern.pairs.data[k].column[half];
        if (column == pattern.columns) {
          EXPECT_EQ(half, 1);
          ++alone;
        } else {
          EXPECT_EQ(std::exchange(place[column], 2 * k + half), -1) << column;
        }
      }
    EXPECT_EQ(std::count(place.begin(), place.end(), -1), 0);
    EXPECT_LE(alone, 3) << pattern.columns;
    for (int k = 0; k < pattern.pairs.count; ++k)
      for (int group = pattern.first[2 * k]; group < pattern.first[2 * k + 2]; ++group)
        for (const int other : pattern.other[group].column) {
          if (other < pattern.columns) {
            EXPECT_GT(place[other], 2 * k + 1);
          }
        }
  }
}

TEST(HairMeshTopology, CountsWhatItIsMadeOf) {
  const RestMesh mesh = hair_cap({6, 12, 12, 12}, 5, 0.03, 0.5);
  const HairMeshTopology& t = mesh.topology;
  ASSERT_EQ(t.columns, 43);
  EXPECT_EQ(t.vertices(), 215);
  const auto faces = static_cast<int>(t.faces.size()), edges = static_cast<int>(t.edges.size());
  EXPECT_EQ(t.columns - edges + faces, 1) << "Euler's characteristic of a disc";
  const auto rim = std::count_if(t.edges.begin(), t.edges.end(), [](const auto& e) { return e.face[1] < 0; });
  EXPECT_EQ(rim, 12);
  EXPECT_EQ(static_cast<int>(t.mesh_edges().size()), t.columns * 4 + edges * 5);
  int corners = 0;
  for (const ScalpFace& face : t.faces) corners += face.corners();
  EXPECT_EQ(static_cast<int>(t.corner_tetrahedra().size()), corners * 2 * 4);
  EXPECT_EQ(static_cast<int>(t.surface_faces().size()), 2 * faces + 12 * 4);
  EXPECT_EQ(static_cast<int>(t.external_vertices().size()), t.columns + 12 * 3);
  for (const auto& e : t.corner_tetrahedra()) {
    Eigen::Matrix3d d;
    for (int k = 0; k < 3; ++k) d.col(k) = mesh.at(e.vertex[k + 1]) - mesh.at(e.vertex[0]);
    EXPECT_GT(d.determinant(), 0);
  }
}

TEST(HairMeshModel, MassesAndVolumeAreThoseOfAPrism) {
  for (const int corners : {3, 4}) {
    const RestMesh mesh = prism_column(corners, 3, 0.02, 0.1);
    HairMeshParameters parameters;
    parameters.density = 80;
    MeshRun<double> run(mesh, parameters);
    const double volume = 0.1 * 0.02 * 0.02 * (corners == 4 ? 1 : std::sqrt(0.75) / 2);
    EXPECT_NEAR(run.solver->volume(), volume, 1e-15);
    const HairMeshModel<double> model(mesh.topology, mesh.rest, parameters);
    const HairMeshView<double> view = model.view();
    double mass = 0;
    for (int v = 0; v < mesh.topology.vertices(); ++v) mass += view.mass[v];
    EXPECT_NEAR(mass, 80 * volume, 1e-14);
    parameters.total_mass = 0.25;
    const HairMeshModel<double> heavy(mesh.topology, mesh.rest, parameters);
    mass = 0;
    for (int v = 0; v < mesh.topology.vertices(); ++v) mass += heavy.view().mass[v];
    EXPECT_NEAR(mass, 0.25, 1e-14);
  }
}

// A straight column of two prisms of unlike lengths, bent by an angle at the layer between them: the energy
// is B V kappa^2 / 2 with the curvature kappa = 2 sin(angle / 2) / l, l the mean of the lengths, and V of
// both halves about the bend; where one length is under a quarter of the other, as much less as their ratio's
// square is under a sixteenth.
TEST(HairMeshModel, BendsWithTheCurvatureOfUnlikeEdges) {
  const double side = 0.02, angle = 0.3;
  for (const auto& [below, above, share] : {std::tuple(0.05, 0.05, 1.0), std::tuple(0.03, 0.09, 1.0),
                                            std::tuple(0.09, 0.03, 1.0), std::tuple(0.1, 0.0125, 0.25)}) {
    RestMesh mesh = prism_column(4, 3, side, 0.1);
    for (int c = 0; c < 4; ++c)
      mesh.rest[3 * (3 * c + 1) + 1] = below, mesh.rest[3 * (3 * c + 2) + 1] = below + above;
    HairMeshParameters parameters;
    parameters.held_roots = false;
    parameters.bend = 0.07, parameters.bend_across = 0;
    MeshRun<double> run(mesh, parameters);
    for (int c = 0; c < 4; ++c)
      run.put(3 * c + 2, mesh.at(3 * c + 1) + above * Eigen::Vector3d(std::sin(angle), std::cos(angle), 0));
    run.set();
    const double length = (below + above) / 2, volume = side * side * length,
                 curvature = 2 * std::sin(angle / 2) / length;
    EXPECT_NEAR(run.solver->energies().bend / (0.5 * 0.07 * volume * curvature * curvature), share, 1e-9);
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
