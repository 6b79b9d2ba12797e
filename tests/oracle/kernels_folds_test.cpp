// Surfaces that pass through themselves: winding numbers against the reference's solid angles, what samples
// call inside, and hair whose roots another part of the solid covers.
#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "kernels/solid/surface.h"
#include "kernels_support.h"
#include "level_set_support.h"

namespace ringlet::kernels_testing {
namespace {

using Eigen::Vector3d;
using oracle::Points;

// Two balls that overlap by a third, as one surface.
constexpr double kRadius = 0.06, kApart = 0.08;
Surface two_balls() {
  Surface balls = icosphere(kRadius, 3);
  const Surface second = balls;
  const auto count = static_cast<std::int32_t>(balls.vertices.size());
  for (const auto& v : second.vertices) balls.vertices.push_back(v + Vector3d(kApart, 0.007, -0.003));
  for (const auto& t : second.triangles)
    balls.triangles.push_back({t[0] + count, t[1] + count, t[2] + count});
  return balls;
}

// A solid with all its triangles in one bin of crossings.
struct FoldedSolid {
  MeshSolid mesh;
  std::vector<std::int32_t> start, triangle;
  std::vector<unsigned char> everywhere;

  explicit FoldedSolid(Surface surface, double voxel)
      : mesh(std::move(surface), voxel), triangle(mesh.surface.triangles.size()) {
    std::iota(triangle.begin(), triangle.end(), 0);
    start = {0, static_cast<std::int32_t>(triangle.size())};
    everywhere.assign(mesh.band.tile.size(), 1);
  }
  kernels::SolidView view() const {
    kernels::SolidView v = mesh.view();
    v.crossings = {{-1, -1}, 0.5f, {1, 1}, start.data(), triangle.data()};
    v.folded_tiles = everywhere.data();
    return v;
  }
};

const FoldedSolid& balls() {
  static const FoldedSolid solid(two_balls(), 0.006);
  return solid;
}

template <class T>
class KernelFolds : public testing::Test {
 protected:
  // Near the balls, sides and depths of all kinds.
  Vector3d next() {
    return {0.04 + 0.12 * uniform_(generator_), 0.07 * uniform_(generator_), 0.07 * uniform_(generator_)};
  }
  static kernels::Vector3<T> at(const Vector3d& p) {
    return {static_cast<T>(p.x()), static_cast<T>(p.y()), static_cast<T>(p.z())};
  }

 private:
  std::mt19937 generator_{21};
  std::uniform_real_distribution<double> uniform_{-1, 1};
};
using Precisions = testing::Types<double, float>;
TYPED_TEST_SUITE(KernelFolds, Precisions);

TYPED_TEST(KernelFolds, WindingNumbersAreTheSolidAngles) {
  const oracle::MeshDistance mesh(balls().mesh.surface.vertices, balls().mesh.surface.triangles);
  int counts[3] = {};
  for (int trial = 0; trial < 3000; ++trial) {
    const Vector3d p = this->next();
    if (mesh.closest(p).distance < 1e-6) continue;
    const double expected = mesh.exact_winding_number(p);
    ASSERT_EQ(kernels::winding_number(balls().view(), this->at(p)), std::lround(expected)) << p.transpose();
    ++counts[std::lround(expected)];
  }
  for (const int count : counts) EXPECT_GT(count, 50) << "points outside, in one ball, in both";
}

// Through each vertex of a ball, from within and from without.
TYPED_TEST(KernelFolds, RaysThroughVerticesCountOnce) {
  const FoldedSolid ball(icosphere(0.05, 2), 0.02);
  int inside = 0;
  for (const Vector3d& v : ball.mesh.surface.vertices) {
    const double reach = std::sqrt(std::max(0.0, 0.0025 - v.y() * v.y() - v.z() * v.z()));
    for (const double x : {-0.2, 0.2, 0.0}) {
      if (x == 0 && reach < 0.02) continue;
      ASSERT_EQ(kernels::winding_number(ball.view(), this->at({x, v.y(), v.z()})), x == 0 ? 1 : 0)
          << v.transpose();
      inside += x == 0;
    }
  }
  EXPECT_GT(inside, 50);
}

// Turned inside out, it winds the other way; along edges and through vertices rays count once.
TYPED_TEST(KernelFolds, RaysThroughEdgesAndVerticesCountOnce) {
  Surface cube = box({-0.05, -0.05, -0.05}, {0.05, 0.05, 0.05}, 4);
  const FoldedSolid solid(cube, 0.02);
  for (auto& t : cube.triangles) std::swap(t[1], t[2]);
  const FoldedSolid inverted(cube, 0.02);
  for (int i = -3; i <= 3; ++i)
    for (int j = -3; j <= 3; ++j) {
      const Vector3d in(0.01, 0.0125f * i, 0.0125f * j), out = in - Vector3d(0.1, 0, 0);
      EXPECT_EQ(kernels::winding_number(solid.view(), this->at(in)), 1) << in.transpose();
      EXPECT_EQ(kernels::winding_number(solid.view(), this->at(out)), 0) << out.transpose();
      EXPECT_EQ(kernels::winding_number(inverted.view(), this->at(in)), -1) << in.transpose();
    }
}

// Wherever the reference says inside, with respect to any of the sheets.
TYPED_TEST(KernelFolds, SamplesKnowTheInsideOfTheWhole) {
  const oracle::MeshDistance mesh(balls().mesh.surface.vertices, balls().mesh.surface.triangles);
  int hidden = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    const Vector3d p = this->next();
    const auto closest = mesh.closest(p);
    if (closest.distance < 1e-5) continue;
    const bool inside = std::lround(mesh.exact_winding_number(p)) != 0;
    const auto sample = kernels::sample_surface(balls().view(), this->at(p));
    EXPECT_EQ(sample.distance < 0, inside) << p.transpose() << ", " << closest.distance << " m from the mesh";
    hidden +=
        inside && mesh.exact_winding_number(closest.point + 1e-3 * (p - closest.point).normalized()) > 0.5;
  }
  EXPECT_GT(hidden, 300);
}

TYPED_TEST(KernelFolds, CoveredIsWhatAnotherPartHides) {
  const Surface& surface = balls().mesh.surface;
  const kernels::SolidView view = balls().view();
  int covered = 0;
  for (std::size_t t = 0; t < surface.triangles.size() / 2; ++t) {  // the first ball's
    Vector3d middle = Vector3d::Zero();
    for (const std::int32_t v : surface.triangles[t]) middle += surface.vertices[v] / 3;
    const double from_second = (middle - Vector3d(kApart, 0.007, -0.003)).norm();
    if (std::abs(from_second - kRadius) < 1e-3) continue;  // where the facets cross
    EXPECT_EQ(kernels::is_covered(view, static_cast<std::int32_t>(t), this->at(middle)),
              from_second < kRadius);
    covered += from_second < kRadius;
  }
  EXPECT_GT(covered, 50);
}

template <class Machine>
class KernelFold : public OnMachine<Machine> {};
TYPED_TEST_SUITE(KernelFold, Machines, MachineNames);

// Strands of 2 cm grow all over the first ball, straight out. Those that the second covers end on a surface,
// whichever, at their lengths.
TYPED_TEST(KernelFold, CoveredStrandsComeToLieOnASurfaceAtTheirLengths) {
  using T = typename TypeParam::T;
  const Surface& surface = balls().mesh.surface;
  const oracle::MeshDistance mesh(surface.vertices, surface.triangles);
  std::vector<oracle::Strand> strands;
  std::vector<RootPose> roots;
  std::vector<std::int32_t> skin;
  for (std::size_t t = 0; t < surface.triangles.size() / 2; t += 7) {
    Vector3d middle = Vector3d::Zero();
    for (const std::int32_t v : surface.triangles[t]) middle += surface.vertices[v] / 3;
    Points rest(3, 5);
    for (int i = 0; i < 5; ++i) rest.col(i) = 0.005 * i * middle.normalized();
    strands.push_back(oracle::make_strand(rest, {}));
    roots.push_back({oracle::Mat3::Identity(), middle});
    skin.push_back(static_cast<std::int32_t>(t));
  }
  StrandRun<TypeParam> run(strands, roots, false);
  run.parameters.length_iterations = 8, run.parameters.length_tolerance = T(1e-4);
  run.parameters.step = T(1.0 / 240);
  run.home = 0, run.skin = skin;
  run.collide({balls().view()});
  int covered = 0;
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const Points x = run.get(s).position;
    const double strain = oracle::worst_edge_strain(strands[s], x);
    EXPECT_TRUE(strain <= 1e-3) << "strand " << s << ": " << strain;
    for (int i = 1; i < 5; ++i) {
      const double depth = mesh.inside(x.col(i)) ? mesh.closest(x.col(i)).distance : 0;
      EXPECT_TRUE(depth <= 1e-4) << "strand " << s << ", particle " << i << ": " << depth << " m deep";
    }
    covered += mesh.exact_winding_number(roots[s].root + 1e-4 * roots[s].root.normalized()) > 0.5;
  }
  EXPECT_GT(covered, 10);
}

TYPED_TEST(KernelFold, StrandsThatIgnoreTheirHomeMeetOtherSolids) {
  static const MeshSolid ball(icosphere(0.03, 3), 0.006);
  Points rest(3, 2);
  rest << Vector3d::Zero(), Vector3d(0, -0.01, 0);
  const RootPose root{oracle::Mat3::Identity(), {0, 0.035, 0}};
  for (const std::int32_t home : {-1, 0, 1}) {
    StrandRun<TypeParam> run({oracle::make_strand(rest, {})}, {root}, false);
    run.parameters.step = 1.0f / 240;
    run.home = home, run.skin = {kernels::kIgnoresHome};
    kernels::SolidView away = ball.view();
    away.translation[0] = away.translation_before[0] = 5;
    run.collide({ball.view(), away});
    EXPECT_EQ(run.contact_figure(0, kernels::kTouched) > 0, home != 0) << "home " << home;
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
