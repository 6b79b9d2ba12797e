// Small hair meshes that the tests share.
#pragma once
#include <random>

#include "groom/hair_mesh.h"
#include "unit/groom_support.h"

namespace ringlet::groom::test {

// A grid of quads in the plane z = 0 with layers straight above.
inline HairMesh slab(int across, int along, int layers, double side, double height) {
  HairMesh mesh;
  mesh.layers = layers;
  for (int k = 0; k < layers; ++k)
    for (int j = 0; j <= along; ++j)
      for (int i = 0; i <= across; ++i) mesh.positions.emplace_back(i * side, j * side, k * height);
  for (int j = 0; j < along; ++j) {
    for (int i = 0; i < across; ++i) {
      const int corner = j * (across + 1) + i;
      mesh.faces.push_back({corner, corner + 1, corner + across + 2, corner + across + 1});
    }
  }
  return mesh;
}

// Triangles about vertex 0 in the plane z = 0, a regular polygon, with layers straight above.
inline HairMesh fan(int sides, int layers, double radius, double height) {
  HairMesh mesh;
  mesh.layers = layers;
  for (int k = 0; k < layers; ++k) {
    mesh.positions.emplace_back(0, 0, k * height);
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * M_PI * i / sides;
      mesh.positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), k * height);
    }
  }
  for (int i = 0; i < sides; ++i) mesh.faces.push_back({0, 1 + i, 1 + (i + 1) % sides, -1});
  return mesh;
}

// Quads and a triangle with groups, bent, no two numbers alike.
inline HairMesh random_mesh(unsigned seed) {
  HairMesh mesh = slab(3, 2, 5, 0.02, 0.03);
  mesh.faces.back() = {6, 7, 11, -1};  // the last quad in two
  mesh.faces.push_back({6, 11, 10, -1});
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> noise(-0.002, 0.002);
  for (Vec3& x : mesh.positions) {
    const double bend = 3 * x.z();
    x = Vec3(x.x(), (x.y() + 0.3) * std::cos(bend) - 0.3, (x.y() + 0.3) * std::sin(bend));
    for (int k = 0; k < 3; ++k) x[k] += noise(engine);
  }
  mesh.groups = {0, 0, 1, 1, 1, 0, 2};
  mesh.group_names = {"left", "right", "rest"};
  return mesh;
}

}  // namespace ringlet::groom::test
