// The distance oracle against spheres, cubes, brute force and exact solid angles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>

#include "oracle/mesh_distance.h"

namespace ringlet::oracle {
namespace {

using Vec3 = MeshDistance::Vec3;
using Triangle = MeshDistance::Triangle;

struct Mesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
};

// Unit sphere of `rings` by 2 `rings` quads, outward; the poles are degenerate quads. `open` leaves the last
// ring out.
Mesh sphere_mesh(int rings, bool open = false) {
  Mesh mesh;
  const int around = 2 * rings;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j < around; ++j) {
      const double polar = std::numbers::pi * i / rings, azimuth = 2 * std::numbers::pi * j / around;
      mesh.vertices.push_back(
          {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)});
    }
  }
  for (int i = 0; i < (open ? rings - 1 : rings); ++i) {
    for (int j = 0; j < around; ++j) {
      const int a = i * around + j, b = i * around + (j + 1) % around, c = a + around, d = b + around;
      mesh.triangles.push_back({a, c, d});
      mesh.triangles.push_back({a, d, b});
    }
  }
  return mesh;
}

Mesh cube_mesh() {
  Mesh mesh;
  for (int k = 0; k < 8; ++k) mesh.vertices.push_back({double(k & 1), double(k >> 1 & 1), double(k >> 2)});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

double cube_distance(const Vec3& p) {
  const Vec3 q = (p - Vec3::Constant(0.5)).cwiseAbs() - Vec3::Constant(0.5);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

std::vector<Vec3> random_points(int count, double size, const Vec3& centre) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-size, size);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) p = centre + Vec3(uniform(generator), uniform(generator), uniform(generator));
  return points;
}

TEST(OracleMeshDistance, IsACubesInsideAndOut) {
  const Mesh cube = cube_mesh();
  const MeshDistance mesh(cube.vertices, cube.triangles);
  for (const Vec3& p : random_points(5000, 1.5, Vec3::Constant(0.5))) {
    ASSERT_NEAR(mesh.signed_distance(p), cube_distance(p), 1e-14) << p.transpose();
  }
}

TEST(OracleMeshDistance, DoesNotMindWhichWayTheTrianglesWind) {
  Mesh cube = cube_mesh();
  for (Triangle& t : cube.triangles) std::swap(t[0], t[1]);
  const MeshDistance mesh(cube.vertices, cube.triangles);
  EXPECT_NEAR(mesh.signed_distance(Vec3::Constant(0.4)), -0.4, 1e-15);
  EXPECT_NEAR(mesh.signed_distance({0.5, 0.5, 1.25}), 0.25, 1e-15);
}

TEST(OracleMeshDistance, TreeAgreesWithEveryTriangle) {
  const Mesh sphere = sphere_mesh(24);
  const MeshDistance mesh(sphere.vertices, sphere.triangles);
  for (const Vec3& p : random_points(300, 1.5, Vec3::Zero())) {
    double least = std::numeric_limits<double>::infinity();
    for (const Triangle& t : sphere.triangles) {
      const std::vector<Vec3> corners{sphere.vertices[t[0]], sphere.vertices[t[1]], sphere.vertices[t[2]]};
      least = std::min(least, MeshDistance(corners, {{0, 1, 2}}).closest(p).distance);
    }
    const MeshDistance::Closest closest = mesh.closest(p);
    ASSERT_NEAR(closest.distance, least, 1e-15);
    ASSERT_NEAR((closest.point - p).norm(), closest.distance, 1e-15);
    ASSERT_NEAR(mesh.winding_number(p), mesh.exact_winding_number(p), 0.05);
  }
}

TEST(OracleMeshDistance, IsASpheresToTheSizeOfItsFacets) {
  const int rings = 80;
  const Mesh sphere = sphere_mesh(rings);
  const MeshDistance mesh(sphere.vertices, sphere.triangles);
  const double sagitta = std::pow(std::numbers::pi / rings, 2) / 4;  // facets lie this far inside at most
  for (const Vec3& p : random_points(4000, 1.2, Vec3::Zero())) {
    const double distance = mesh.signed_distance(p), expected = p.norm() - 1;
    ASSERT_GE(distance, expected - 1e-12);
    ASSERT_LE(distance, expected + sagitta);
  }
}

TEST(OracleMeshDistance, KnowsInsideOfAnOpenMesh) {
  const Mesh sphere = sphere_mesh(40, true);
  const MeshDistance mesh(sphere.vertices, sphere.triangles);
  for (const Vec3& p : random_points(2000, 1.5, Vec3::Zero())) {
    if ((p - Vec3(0, 0, -1)).norm() < 0.3 || std::abs(p.norm() - 1) < 0.01)
      continue;  // near the hole, or the facets
    ASSERT_EQ(mesh.inside(p), p.norm() < 1) << p.transpose();
  }
}

TEST(OracleMeshDistance, AcceptsDegenerateTrianglesAndRefusesNonsense) {
  const MeshDistance point({Vec3(1, 0, 0)}, {{0, 0, 0}});
  EXPECT_EQ(point.closest(Vec3::Zero()).distance, 1);
  const MeshDistance segment({Vec3(1, -1, 0), Vec3(1, 1, 0), Vec3(1, 2, 0)}, {{0, 1, 2}});
  EXPECT_EQ(segment.closest(Vec3::Zero()).distance, 1);
  EXPECT_THROW(MeshDistance({}, {}), std::invalid_argument);
  EXPECT_THROW(MeshDistance({Vec3::Zero()}, {{0, 0, 1}}), std::invalid_argument);
}

}  // namespace
}  // namespace ringlet::oracle
