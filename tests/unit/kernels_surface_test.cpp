// Closest points, and a solid's distance, normal and velocity near its surface, against the exact mesh.
#include <gtest/gtest.h>

#include <random>

#include "kernels/solid/surface.h"
#include "level_set_support.h"

namespace ringlet::kernels_testing {
namespace {

using Eigen::Vector3d;

template <class T>
kernels::Vector3<T> to_kernel(const Vector3d& a) {
  return {static_cast<T>(a.x()), static_cast<T>(a.y()), static_cast<T>(a.z())};
}
template <class T>
Vector3d from_kernel(const kernels::Vector3<T>& a) {
  return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)};
}

template <class Real>
class KernelSurface : public testing::Test {
 protected:
  static constexpr double kRounding = sizeof(Real) == 8 ? 1e-12 : 3e-7;

  Vector3d random(double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    return Vector3d(uniform(generator_), uniform(generator_), uniform(generator_))
        .template cast<Real>()
        .template cast<double>();
  }
  Vector3d near_sphere(double radius, double within) {
    const Vector3d p = (radius + random(within).x()) * random(1).normalized();
    return p.template cast<Real>().template cast<double>();
  }
  std::mt19937 generator_{9};
};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(KernelSurface, Reals);

TYPED_TEST(KernelSurface, FindsTheClosestPointOfATriangle) {
  using T = TypeParam;
  for (int trial = 0; trial < 20000; ++trial) {
    const Vector3d a = this->random(1), b = this->random(1), p = this->random(2);
    // Also needles and triangles without area.
    const Vector3d c = trial % 5 == 1 ? a : trial % 5 == 2 ? Vector3d((a + b) / 2) : this->random(1);
    const kernels::Vector3<T> w =
        kernels::closest_barycentrics(to_kernel<T>(p), to_kernel<T>(a), to_kernel<T>(b), to_kernel<T>(c));
    ASSERT_TRUE(w.x >= -this->kRounding * 10 && w.y >= 0 && w.z >= 0);
    ASSERT_NEAR(w.x + w.y + w.z, 1, 1e-6);
    const double distance = (w.x * a + w.y * b + w.z * c - p).norm();
    double sampled = 1e30;  // no point of the triangle is closer
    constexpr int kSamples = 24;
    for (int u = 0; u <= kSamples; ++u)
      for (int v = 0; u + v <= kSamples; ++v) {
        const Vector3d at = (u * a + v * b + (kSamples - u - v) * c) / kSamples;
        sampled = std::min(sampled, (at - p).norm());
      }
    if (trial % 5 == 1 || trial % 5 == 2) {  // without area: one of its points, if not the closest
      const double farthest = std::max({(a - p).norm(), (b - p).norm(), (c - p).norm()});
      ASSERT_TRUE(distance <= farthest + 1e-6);
      continue;
    }
    ASSERT_TRUE(distance <= sampled + 1e-6) << "a closer point at " << sampled << ", found " << distance;
    const double exact = oracle::MeshDistance({a, b, c}, {{0, 1, 2}}).closest(p).distance;
    ASSERT_NEAR(distance, exact, 20 * this->kRounding);
  }
}

// Outside, the exact distance. Inside a convex mesh a walk over the surface can end at a triangle that is not
// quite the closest: the distance is that of a point of the mesh all the same, and off by less than the level
// set would notice.
TYPED_TEST(KernelSurface, IsTheMeshNearTheSurface) {
  using T = TypeParam;
  constexpr double kVoxel = 0.006;
  const MeshSolid solid(icosphere(0.1, 3), kVoxel);
  const oracle::MeshDistance mesh(solid.surface.vertices, solid.surface.triangles);
  const kernels::SolidView view = solid.view();
  for (int trial = 0; trial < 4000; ++trial) {
    const Vector3d p = this->near_sphere(0.1, 0.0045);
    const kernels::SurfaceSample<T> at =
        kernels::sample_surface(view, to_kernel<T>(p), kernels::Patch{}, T(kVoxel));
    ASSERT_TRUE(at.exact);
    const double distance = mesh.signed_distance(p);
    ASSERT_NEAR(at.distance, distance, distance > 0 ? this->kRounding + 1e-8 : 0.1 * kVoxel);
    const Vector3d normal = from_kernel(at.normal);
    ASSERT_NEAR(normal.norm(), 1, 1e-6);
    ASSERT_NEAR(mesh.closest(p - at.distance * normal).distance, 0, this->kRounding + 1e-8);
    if (distance > 1e-4) {
      ASSERT_NEAR((normal - (p - mesh.closest(p).point) / distance).norm(), 0, 3e-3);
    }
    ASSERT_GT(normal.dot(p.normalized()), 0.97);
  }
}

TYPED_TEST(KernelSurface, KnowsTheSideFarFromTheSurface) {
  using T = TypeParam;
  const MeshSolid solid(icosphere(0.1, 2), 0.006);
  const oracle::MeshDistance mesh(solid.surface.vertices, solid.surface.triangles);
  const kernels::SolidView view = solid.view();
  const auto at = [&](double r) {
    return kernels::sample_surface(view, to_kernel<T>({0.6 * r, 0.8 * r, 0}));
  };
  for (const double outside : {0.13, 0.3, 5.0, 1e12}) {
    EXPECT_FALSE(at(outside).exact) << outside;
    EXPECT_GE(at(outside).distance, 0.0089);
  }
  for (const double inside : {0.01, 0.05, 0.08}) {
    const kernels::SurfaceSample<T> sample = at(inside);
    EXPECT_TRUE(sample.exact);
    EXPECT_NEAR(sample.distance, inside - 0.1, 0.003);
    const Vector3d p(0.6 * inside, 0.8 * inside, 0), normal = from_kernel(sample.normal);
    EXPECT_NEAR(mesh.closest(p - sample.distance * normal).distance, 0, 1e-7);
    if (inside > 0.02) {  // about the middle every way out is as short
      EXPECT_GT(normal.dot(p.normalized()), 0.9) << inside;
    }
  }
}

TYPED_TEST(KernelSurface, LiesTheOffsetOutside) {
  using T = TypeParam;
  const MeshSolid solid(icosphere(0.1, 2), 0.006);
  kernels::SolidView view = solid.view();
  const kernels::Vector3<T> p = to_kernel<T>({0, 0.102, 0});
  const T distance = kernels::sample_surface(view, p).distance;
  view.offset = 0.003f;
  EXPECT_NEAR(kernels::sample_surface(view, p).distance, distance - T(0.003f), 1e-8);
}

TYPED_TEST(KernelSurface, MovesWithARigidBody) {
  using T = TypeParam;
  const MeshSolid solid(icosphere(0.1, 3), 0.006);
  const oracle::MeshDistance mesh(solid.surface.vertices, solid.surface.triangles);
  kernels::SolidView view = solid.view();
  const Eigen::Matrix3d before = Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Matrix3d after = Eigen::AngleAxisd(0.02, Vector3d::UnitY()) * before;
  const Vector3d from(0.1, 0.2, 0.3), to(0.11, 0.2, 0.28);
  for (int k = 0; k < 9; ++k)
    view.rotation_before[k] = before(k / 3, k % 3), view.rotation[k] = after(k / 3, k % 3);
  for (int c = 0; c < 3; ++c) view.translation_before[c] = from[c], view.translation[c] = to[c];
  for (int trial = 0; trial < 500; ++trial) {
    const Vector3d p = 0.101 * this->random(1).normalized();
    const kernels::SurfaceSample<T> at = kernels::sample_surface(view, to_kernel<T>(p));
    const Vector3d q = mesh.closest(p).point;
    const Vector3d expected = after * q + to - (before * q + from);
    ASSERT_NEAR((from_kernel(kernels::surface_displacement(view, at)) - expected).norm(), 0, 1e-7);
  }
}

// Between two frames of a growing sphere: the level sets' mean finds the surface, the substep's mesh decides.
TYPED_TEST(KernelSurface, BlendsTwoLevelSets) {
  using T = TypeParam;
  const Surface unit = icosphere(1, 3);
  const auto scaled = [&](double radius) {
    Surface s = unit;
    for (auto& v : s.vertices) v *= radius;
    return s;
  };
  const MeshSolid small(scaled(0.1), 0.006), large(scaled(0.106), 0.006), now(scaled(0.103), 0.006);
  const oracle::MeshDistance mesh(now.surface.vertices, now.surface.triangles);
  kernels::SolidView view = now.view();
  view.level_set[0] = small.band.view(), view.level_set[1] = large.band.view(), view.blend = 0.5f;
  view.vertices_before = small.vertices.data();
  for (int trial = 0; trial < 2000; ++trial) {
    const Vector3d p = this->near_sphere(0.103, 0.0045);
    const kernels::SurfaceSample<T> at =
        kernels::sample_surface(view, to_kernel<T>(p), kernels::Patch{}, T(0.006));
    ASSERT_TRUE(at.exact);
    const double distance = mesh.signed_distance(p);
    ASSERT_NEAR(at.distance, distance, distance > 0 ? this->kRounding + 1e-8 : 6e-4);
    const Vector3d q = p - at.distance * from_kernel(at.normal);  // the surface point
    ASSERT_NEAR((from_kernel(kernels::surface_displacement(view, at)) - (0.003 / 0.103) * q).norm(), 0, 1e-7);
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
