// Hair meshes made by rule, and a run of one, without the rest of the program.
#pragma once
#include <Eigen/Dense>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "kernels/launch/hair_mesh_solver.h"

namespace ringlet::kernels_testing {

using kernels::HairMeshParameters;
using kernels::HairMeshSolver;
using kernels::HairMeshTopology;
using kernels::InstructionSet;
using kernels::ScalpFace;

struct RestMesh {
  HairMeshTopology topology;
  std::vector<double> rest;  // [vertices][3] [m]

  Eigen::Vector3d at(int vertex) const { return Eigen::Map<const Eigen::Vector3d>(rest.data() + 3 * vertex); }
};

// A cap of hair on a ball of 0.1 m about the origin: a pole, and rings of so many vertices down to the
// equator. Rings of equal counts are joined by quads, others by triangles. Hair grows outward by `thickness`
// and comes down by `fall` times its angle from the pole, straight down beneath the equator; `curl` [m] turns
// layers about the vertical one way and back.
inline RestMesh hair_cap(const std::vector<int>& rings, int layers, double thickness, double fall,
                         double curl = 0) {
  std::vector<ScalpFace> faces;
  std::vector<double> angle{0}, azimuth{0};  // of columns
  int first = 0, count = 1;                  // columns of the ring before
  for (std::size_t ring = 0; ring < rings.size(); ++ring) {
    const int next = static_cast<int>(angle.size()), around = rings[ring];
    const auto inner = [&](int k) { return first + k % count; };
    const auto outer = [&](int k) { return next + k % around; };
    for (int k = 0; k < around; ++k) {
      angle.push_back(0.5 * std::numbers::pi * (static_cast<double>(ring) + 1) /
                      static_cast<double>(rings.size()));
      azimuth.push_back(-2 * std::numbers::pi * k / around);
    }
    for (int k = 0, i = 0; k < around || (count > 1 && i < count);) {
      if (count == around) {
        faces.push_back({{inner(k), outer(k), outer(k + 1), inner(k + 1)}}), ++k, ++i;
      } else if (count == 1 || (k + 1) * count <= (i + 1) * around) {
        faces.push_back({{inner(i), outer(k), outer(k + 1), -1}}), ++k;
      } else {
        faces.push_back({{inner(i), outer(k), inner(i + 1), -1}}), ++i;
      }
    }
    first = next, count = around;
  }
  RestMesh mesh{kernels::make_hair_mesh_topology(faces, static_cast<int>(angle.size()), layers), {}};
  mesh.rest.resize(3 * static_cast<std::size_t>(mesh.topology.vertices()));
  for (std::size_t c = 0; c < angle.size(); ++c)
    for (int l = 0; l < layers; ++l) {
      const double t = l / double(layers - 1), radius = 0.1 + thickness * t, down = angle[c] * (1 + fall * t);
      const double below = std::max(down - 0.5 * std::numbers::pi, 0.0);
      const double across = radius * std::sin(down - below), up = radius * (std::cos(down - below) - below);
      const double turn = azimuth[c] + curl / radius * std::sin(9 * t);
      Eigen::Map<Eigen::Vector3d>(mesh.rest.data() + 3 * mesh.topology.vertex(static_cast<int>(c), l)) =
          Eigen::Vector3d(across * std::cos(turn), up, across * std::sin(turn));
    }
  return mesh;
}

// The sizes of the hair mesh paper: 215, 361 and 2,305 vertices, hair of about the same shape in each.
inline RestMesh paper_mesh(int vertices) {
  if (vertices == 215) return hair_cap({6, 12, 12, 12}, 5, 0.05, 0.8);
  if (vertices == 361) return hair_cap({6, 12}, 19, 0.06, 0.5);
  return hair_cap({6, 13, 19, 24, 30, 35, 39, 43, 49, 49, 51, 51, 51}, 5, 0.05, 0.8);
}

// One prism over a square or triangle of this side, along y; `down` hangs it from its roots.
inline RestMesh prism_column(int corners, int layers, double side, double height, bool down = false) {
  ScalpFace face{{0, 1, 2, corners == 4 ? 3 : -1}};
  if (!down) face = corners == 4 ? ScalpFace{{0, 3, 2, 1}} : ScalpFace{{0, 2, 1, -1}};
  RestMesh mesh{kernels::make_hair_mesh_topology({face}, corners, layers), {}};
  const double at[4][2] = {{0, 0},
                           {side, 0},
                           {corners == 4 ? side : side / 2, corners == 4 ? side : side * std::sqrt(0.75)},
                           {0, side}};
  for (int c = 0; c < corners; ++c)
    for (int l = 0; l < layers; ++l) {
      const double y = height * l / (layers - 1);
      for (const double x : {at[c][0], down ? -y : y, at[c][1]}) mesh.rest.push_back(x);
    }
  return mesh;
}

// A lock of `wide` by `wide` quads that hangs from its roots at the origin.
inline RestMesh hanging_lock(int wide, int layers, double side, double height) {
  std::vector<ScalpFace> faces;
  const int across = wide + 1;
  for (int i = 0; i < wide; ++i)
    for (int j = 0; j < wide; ++j)
      faces.push_back({{i * across + j, (i + 1) * across + j, (i + 1) * across + j + 1, i * across + j + 1}});
  RestMesh mesh{kernels::make_hair_mesh_topology(faces, across * across, layers), {}};
  for (int i = 0; i < across; ++i)
    for (int j = 0; j < across; ++j)
      for (int l = 0; l < layers; ++l)
        for (const double x :
             {side * (i / double(wide) - 0.5), -height * l / (layers - 1), side * (j / double(wide) - 0.5)})
          mesh.rest.push_back(x);
  return mesh;
}

// A mesh that follows a head moving rigidly.
template <class T>
struct MeshRun {
  RestMesh mesh;
  std::unique_ptr<HairMeshSolver<T>> solver;
  std::vector<T> position, velocity, roots;
  kernels::HairMeshStep<T> step{};
  kernels::SolveFigures solved, minimised;

  explicit MeshRun(RestMesh made, const HairMeshParameters& parameters = {},
                   InstructionSet set = kernels::best_instruction_set())
      : mesh(std::move(made)),
        solver(kernels::make_hair_mesh_solver<T>(set, mesh.topology, mesh.rest, parameters)),
        position(mesh.rest.begin(), mesh.rest.end()),
        velocity(position.size(), T(0)),
        roots(3 * static_cast<std::size_t>(mesh.topology.columns)) {
    step.step = T(1.0 / 24), step.gravity[1] = T(-9.81);
    head(Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero());
  }
  MeshRun(const MeshRun&) = delete;

  int vertices() const { return mesh.topology.vertices(); }
  Eigen::Vector3d at(int vertex) const {
    return Eigen::Map<const Eigen::Matrix<T, 3, 1>>(position.data() + 3 * vertex).template cast<double>();
  }
  void put(int vertex, const Eigen::Vector3d& x) {
    for (int k = 0; k < 3; ++k) position[3 * vertex + k] = static_cast<T>(x[k]);
  }
  void set() { solver->set_state(position.data(), velocity.data()); }
  void get() { solver->get_state(position.data(), velocity.data()); }

  void head(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
    for (int c = 0; c < mesh.topology.columns; ++c) {
      const Eigen::Vector3d root = rotation * mesh.at(mesh.topology.vertex(c, 0)) + translation;
      for (int k = 0; k < 3; ++k) roots[3 * c + k] = static_cast<T>(root[k]);
    }
    for (int k = 0; k < 9; ++k) step.rotation[k] = static_cast<T>(rotation(k / 3, k % 3));
    step.roots = roots.data();
  }
  // One frame without collisions.
  void frame() {
    step.roots = roots.data();
    solver->assemble(step);
    solved = solver->solve();
  }
  void frames(int count) {
    for (int k = 0; k < count; ++k) frame();
    get();
  }
};

}  // namespace ringlet::kernels_testing
