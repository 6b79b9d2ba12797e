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

bool folds(const Shape& shape) {
  return has_folds(close_surface("shape", shape.vertices, shape.triangles), floats(shape), 0.004f);
}

Shape two(double apart) {
  Shape shape = sphere(0.1);
  shape.append(sphere(0.05, {apart, 0, 0}));
  return shape;
}

TEST(Folds, AreFoundWhereASurfacePassesThroughItself) {
  EXPECT_FALSE(folds(sphere(0.1)));
  EXPECT_FALSE(folds(two(0.2))) << "two apart";
  EXPECT_TRUE(folds(two(0.12))) << "two that overlap";
  EXPECT_TRUE(folds(two(0.02))) << "one hidden in the other";
}

// Every vertex of both lies outside the other.
TEST(Folds, AreFoundWhereOnlyEdgesPierce) {
  const auto needle_through = [](double y) {
    Shape shape;  // a flat wedge, and a needle along y
    shape.vertices = {{-1, 0, -1}, {1, 0, -1}, {0, 0, 1}, {0, -0.05, 0}};
    shape.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    Shape needle;
    needle.vertices = {{-0.01, y - 0.5, -0.01}, {0.01, y - 0.5, -0.01}, {0, y - 0.5, 0.01}, {0, y + 0.5, 0}};
    needle.triangles = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    shape.append(needle);
    return shape;
  };
  EXPECT_TRUE(folds(needle_through(0.1)));
  EXPECT_FALSE(folds(needle_through(2)));
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
