// Folds: whether a surface passes through itself, and rays through bins against rays through all triangles.
#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "kernels/solid/crossings.h"
#include "solids/folds.h"
#include "unit/solids_fixtures.h"

namespace ringlet::solids::test {
namespace {

std::vector<Eigen::Vector3f> floats(const Shape& shape) {
  std::vector<Eigen::Vector3f> result;
  for (const Vec3& v : shape.vertices) result.push_back(v.cast<float>());
  return result;
}

std::vector<std::int32_t> folds(const Shape& shape) {
  return folded_triangles(close_surface("shape", shape.vertices, shape.triangles), floats(shape), 0.004f);
}

Shape two(double apart) {
  Shape shape = sphere(0.1);
  shape.append(sphere(0.05, {apart, 0, 0}));
  return shape;
}

TEST(Folds, AreFoundWhereASurfacePassesThroughItself) {
  EXPECT_TRUE(folds(sphere(0.1)).empty());
  EXPECT_TRUE(folds(two(0.2)).empty()) << "two apart";
  EXPECT_EQ(folds(two(0.02)).size(), sphere(0.05).triangles.size()) << "one hidden in the other";
  // Of two that overlap those with a vertex inside the other, and a ring of those that cross.
  const Shape overlap = two(0.12);
  const std::vector<std::int32_t> folded = folds(overlap);
  const std::size_t first = sphere(0.1).triangles.size();
  for (std::size_t t = 0; t < overlap.triangles.size(); ++t) {
    double deepest = 1e9;
    for (const std::int32_t v : overlap.triangles[t]) {
      const Vec3& x = overlap.vertices[static_cast<std::size_t>(v)];
      const double outside = t < first ? (x - Vec3(0.12, 0, 0)).norm() - 0.05 : x.norm() - 0.1;
      deepest = std::min(deepest, outside);
    }
    const bool found = std::ranges::binary_search(folded, static_cast<std::int32_t>(t));
    if (std::abs(deepest) < 2e-3) continue;  // where the facets cross
    EXPECT_EQ(found, deepest < 0) << t;
  }
}

TEST(Folds, AreFoundWhereTheSolidIsThinBesideTheVoxels) {
  const auto plate = [](double thickness) {
    Shape shape = sphere(0.1);
    for (Vec3& v : shape.vertices) v.y() *= thickness / 0.2;
    return shape;
  };
  EXPECT_TRUE(folds(plate(0.05)).size() < sphere(0.1).triangles.size() / 3) << "but for its rim";
  EXPECT_EQ(folds(plate(0.004)).size(), sphere(0.1).triangles.size());
}

// Every vertex of both lies outside the other: a needle through a regular tetrahedron, and beside it.
TEST(Folds, AreFoundWhereOnlyEdgesPierce) {
  const auto folded_faces = [](double x) {
    Shape shape;
    shape.vertices = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    shape.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    Shape needle;
    needle.vertices = {{x - 0.1, -3, 0}, {x + 0.1, -3, 0.02}, {x, -3, 0.2}, {x + 0.02, 3, 0.1}};
    needle.triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    shape.append(needle);
    int faces = 0;
    for (const std::int32_t t : folds(shape)) faces += t < 4;
    return faces;
  };
  EXPECT_EQ(folded_faces(0.4), 2) << "where it enters and where it leaves";
  EXPECT_EQ(folded_faces(2), 0);
}

TEST(Folds, BinsHoldEveryTriangleThatARayMeets) {
  const Shape shape = two(0.12);
  const std::vector<Eigen::Vector3f> vertices = floats(shape);
  Crossings crossings;
  crossings.build(vertices, shape.triangles);
  kernels::SolidView binned{};
  binned.triangles = shape.triangles.front().data(), binned.vertices = vertices.front().data();
  kernels::SolidView whole = binned;
  binned.crossings = crossings.view();
  std::vector<std::int32_t> all(shape.triangles.size());
  std::iota(all.begin(), all.end(), 0);
  const std::int32_t start[] = {0, static_cast<std::int32_t>(all.size())};
  whole.crossings = {{-10, -10}, 0.01f, {1, 1}, start, all.data()};
  EXPECT_GT(binned.crossings.count[0] * binned.crossings.count[1], 1000);
  std::mt19937 generator(3);
  std::uniform_real_distribution<float> uniform(-0.2f, 0.2f);
  int inside = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const kernels::Vector3<float> p{uniform(generator), uniform(generator), uniform(generator)};
    const int expected = kernels::winding_number(whole, p);
    ASSERT_EQ(kernels::winding_number(binned, p), expected) << p.x << " " << p.y << " " << p.z;
    inside += expected != 0;
  }
  EXPECT_GT(inside, 500);
}

}  // namespace
}  // namespace ringlet::solids::test
