// Distances to meshes against closed forms and a reference that knows every triangle's solid angle.
#include "solids/mesh_distance.h"

#include <random>

#include "oracle/mesh_distance.h"
#include "unit/solids_fixtures.h"

namespace ringlet::solids {
namespace {

MeshDistance distance_to(const Shape& shape) { return {"shape", shape.vertices, shape.triangles}; }

Shape box(const Vec3& low, const Vec3& high) {
  Shape s;
  for (int k = 0; k < 8; ++k)
    s.vertices.emplace_back(k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(),
                            k & 4 ? high.z() : low.z());
  const int quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                           {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    s.triangles.push_back({q[0], q[1], q[2]});
    s.triangles.push_back({q[0], q[2], q[3]});
  }
  return s;
}

double distance_to_box(const Vec3& p, const Vec3& low, const Vec3& high) {
  const Vec3 beyond = (low - p).cwiseMax(p - high);
  return beyond.maxCoeff() < 0 ? beyond.maxCoeff() : beyond.cwiseMax(0).norm();
}

class Sampler {
 public:
  Vec3 operator()(const Vec3& centre, double reach) {
    std::uniform_real_distribution<double> uniform(-reach, reach);
    return centre + Vec3(uniform(random_), uniform(random_), uniform(random_));
  }

 private:
  std::mt19937 random_{5};
};

TEST(MeshDistance, OfABoxIsTheClosedForm) {
  const Vec3 low(9.9, -0.2, 0.3), high(10.1, 0.4, 0.5);
  const MeshDistance distance = distance_to(box(low, high));
  Sampler sample;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = sample((low + high) / 2, 0.5);
    ASSERT_NEAR(distance(p), distance_to_box(p, low, high), 1e-7);
  }
  // On lines through its edges and corners, where rays meet the triangles' borders.
  for (double x = 9.8; x < 10.2; x += 0.01)
    for (const Vec3& p : {Vec3(x, 0.4, 0.3), Vec3(x, 0.1, 0.4), Vec3(x, -0.2, 0.5), Vec3(10, x - 10, 0.4)})
      ASSERT_NEAR(distance(p), distance_to_box(p, low, high), 1e-7) << x;
}

TEST(MeshDistance, OfABallIsTheSphereToItsFacets) {
  const double radius = 0.1;
  const int rings = 60;
  const MeshDistance distance = distance_to(sphere(radius, {1, 2, 3}, rings, 2 * rings));
  const double sagitta = radius * (1 - std::pow(std::cos(std::numbers::pi / rings / 2), 2));
  Sampler sample;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = sample({1, 2, 3}, 0.15);
    const double exact = (p - Vec3(1, 2, 3)).norm() - radius;
    ASSERT_GE(distance(p), exact - 1e-7);
    ASSERT_LE(distance(p), exact + sagitta + 1e-7);
  }
}

TEST(MeshDistance, OpenAndOverlappingPartsAreOneSolid) {
  Shape shape = open_cylinder(0.05, 0.2, 40);  // its ends get caps
  shape.append(sphere(0.06, {0, 0, 0.2}, 24, 48).turned_inside_out());
  const MeshDistance distance = distance_to(shape);
  EXPECT_NEAR(distance(Vec3(0, 0, -0.01)), 0.01, 1e-7);
  EXPECT_LT(distance(Vec3(0, 0, 0.01)), 0);
  EXPECT_LT(distance(Vec3(0, 0, 0.19)), 0);  // in both
  EXPECT_LT(distance(Vec3(0, 0, 0.25)), 0);  // in the ball alone
  EXPECT_GT(distance(Vec3(0.058, 0, 0.1)), 0);
}

TEST(MeshDistance, AHollowIsOutside) {
  Shape shell = sphere(0.1);
  shell.append(sphere(0.08).turned_inside_out());
  const MeshDistance distance = distance_to(shell);
  EXPECT_GT(distance(Vec3(0, 0.01, 0)), 0.06);
  EXPECT_NEAR(distance(Vec3(0.09, 0, 0)), -0.01, 2e-4);
}

TEST(MeshDistance, ASheetEnclosesNothing) {
  Shape sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  testing::internal::CaptureStderr();
  const MeshDistance distance = distance_to(sheet);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("encloses no volume"), std::string::npos);
  EXPECT_NEAR(distance(Vec3(0.5, 0.5, -0.2)), 0.2, 1e-7);
  EXPECT_NEAR(distance(Vec3(0.5, 0.5, 0.2)), 0.2, 1e-7);
}

TEST(MeshDistance, AgreesWithTheReferenceOnARoughBall) {
  Shape rough = sphere(0.1, {0, 1, 0}, 20, 40);
  Sampler sample;
  for (Vec3& v : rough.vertices) v = sample(v, 0.004);
  const MeshDistance distance = distance_to(rough);
  const oracle::MeshDistance reference(rough.vertices, rough.triangles);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = sample({0, 1, 0}, 0.12);
    const double expected = reference.closest(p).distance;
    ASSERT_NEAR(std::abs(distance(p)), expected, 1e-7);
    if (expected < 1e-6) continue;
    ASSERT_EQ(distance(p) < 0, std::abs(reference.exact_winding_number(p)) > 0.5);
    inside += distance(p) < 0;
  }
  EXPECT_GT(inside, 3000);
}

}  // namespace
}  // namespace ringlet::solids
