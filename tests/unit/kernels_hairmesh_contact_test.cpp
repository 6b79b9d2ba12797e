// Contacts of a hair mesh: the nearest point of an ellipsoid, what a surface does to velocities, and the
// volume that minimising gives back.
#include <gtest/gtest.h>

#include <algorithm>

#include "kernels/hairmesh/hair_mesh_contact.h"
#include "kernels_hairmesh_support.h"

namespace ringlet::kernels_testing {
namespace {

using Vec3 = Eigen::Vector3d;
using kernels::MeshEllipsoid;
using kernels::MeshSurfacePoint;

MeshEllipsoid<double> ellipsoid(const Vec3& centre, const Vec3& radius, const Eigen::Matrix3d& axes) {
  MeshEllipsoid<double> e{};
  for (int k = 0; k < 3; ++k) {
    e.centre[k] = centre[k], e.radius[k] = radius[k];
    for (int i = 0; i < 3; ++i) e.axis[k][i] = axes(i, k);
  }
  return e;
}
Vec3 vec(const double (&a)[3]) { return {a[0], a[1], a[2]}; }

TEST(HairMeshEllipsoid, NearestPointIsOnItAlongItsNormalAndNearest) {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Eigen::Matrix3d axes = Eigen::AngleAxisd(0.7, Vec3(1, -1, 2).normalized()).toRotationMatrix();
  for (const Vec3& radius :
       {Vec3(0.1, 0.12, 0.09), Vec3(0.3, 0.05, 0.3), Vec3(0.1, 0.1, 0.1), Vec3(0.02, 0.2, 1)}) {
    const MeshEllipsoid<double> e = ellipsoid({0.3, -1, 2}, radius, axes);
    for (int n = 0; n < 200; ++n) {
      Vec3 inside;
      do inside = {uniform(engine), uniform(engine), uniform(engine)};
      while (inside.norm() >= 0.999);
      if (n % 10 < 3) inside[n % 10] = 0;  // on the planes of symmetry, and on axes
      if (n % 20 == 0) inside[1] = 0;
      if (n == 100) inside.setZero();
      const Vec3 local = radius.cwiseProduct(inside), point = vec(e.centre) + axes * local;
      MeshSurfacePoint<double> found{};
      ASSERT_TRUE(kernels::find_on_ellipsoid(e, point.data(), point.data(), 0.0, 1.0, found));
      const Vec3 on = axes.transpose() * (vec(found.point) - vec(e.centre)), unit = on.cwiseQuotient(radius);
      EXPECT_NEAR(unit.norm(), 1, 1e-12);
      const Vec3 normal = axes.transpose() * vec(found.normal);
      EXPECT_LE((normal - unit.cwiseQuotient(radius).normalized()).norm(), 1e-12);
      const double depth = (on - local).norm();
      EXPECT_LE((on - local).cross(normal).norm(), 1e-9 * radius.maxCoeff())
          << radius.transpose() << ' ' << n;
      // Nothing sampled on the surface is nearer.
      for (int k = 0; k < 200; ++k) {
        const Vec3 sample =
            radius.cwiseProduct(Vec3(uniform(engine), uniform(engine), uniform(engine)).normalized());
        EXPECT_GE((sample - local).norm(), depth - 1e-9);
      }
    }
    MeshSurfacePoint<double> found{};
    const Vec3 outside = vec(e.centre) + axes * Vec3(0, 0, radius[2] + 1e-3);
    EXPECT_FALSE(kernels::find_on_ellipsoid(e, outside.data(), outside.data(), 0.0, 1.0, found));
    EXPECT_TRUE(kernels::find_on_ellipsoid(e, outside.data(), outside.data(), 2e-3, 1.0, found));
    EXPECT_NEAR((vec(found.point) - outside).norm(), 1e-3, 1e-12);
  }
}

TEST(HairMeshEllipsoid, ItsSurfaceMovesAsARigidBodyDoes) {
  MeshEllipsoid<double> e = ellipsoid({0, 1, 0}, {0.1, 0.1, 0.1}, Eigen::Matrix3d::Identity());
  e.velocity[0] = 2, e.spin[1] = 3;
  MeshSurfacePoint<double> found{};
  const Vec3 point(0, 1, 0.05);
  ASSERT_TRUE(kernels::find_on_ellipsoid(e, point.data(), point.data(), 0.0, 1.0, found));
  EXPECT_LE((vec(found.velocity) - Vec3(2 + 3 * 0.1, 0, 0)).norm(), 1e-14);
}

// Where an ellipsoid tells a vertex to be that a step of `step` [s] has brought from `before` to `point`.
MeshSurfacePoint<double> swept(const MeshEllipsoid<double>& e, const Vec3& before, const Vec3& point,
                               double step) {
  MeshSurfacePoint<double> found{};
  EXPECT_TRUE(kernels::find_on_ellipsoid(e, before.data(), point.data(), 0.0, step, found));
  return found;
}

TEST(HairMeshEllipsoid, StopsOnTheNearSideWhatWouldGoThrough) {
  const double step = 1 / 24.0;
  MeshEllipsoid<double> e = ellipsoid({0, 0, 0}, {0.1, 0.2, 0.1}, Eigen::Matrix3d::Identity());
  const Vec3 before(-0.5, 0.005, 0.002), point(0.4, 0.005, 0.002);
  const MeshSurfacePoint<double> still = swept(e, before, point, step);
  const Vec3 on_unit_ball = vec(still.point).cwiseQuotient(Vec3(0.1, 0.2, 0.1));
  EXPECT_NEAR(on_unit_ball.norm(), 1, 1e-12);
  EXPECT_LT(still.point[0], -0.05);
  EXPECT_LT(still.normal[0], -0.9);
  // What counts is the way against the ellipsoid.
  e.velocity[0] = -0.9 / step, e.centre[0] = -0.9;
  const Vec3 aside(-0.9, 0, 0);
  const MeshSurfacePoint<double> moving = swept(e, before, before, step);
  EXPECT_LE((vec(moving.point) - vec(still.point) - aside).norm(), 1e-12);
  // One that is inside, past the middle, belongs to the side it came from; one that only touches does not
  // slide.
  e.velocity[0] = 0, e.centre[0] = 0;
  EXPECT_LT(swept(e, before, {0.05, 0.005, 0.002}, step).normal[0], -0.9);
  const Vec3 under(-0.09, 0.005, 0.002);
  EXPECT_LE((vec(swept(e, before, under, step).point) - vec(swept(e, under, under, step).point)).norm(),
            1e-12);
  const Vec3 past(0.4, 0.3, 0.01), over(-0.5, 0.3, 0.01);
  MeshSurfacePoint<double> none{};
  EXPECT_FALSE(kernels::find_on_ellipsoid(e, over.data(), past.data(), 0.0, step, none));
}

// A long blade turns by a right angle: it takes along what it sweeps over, on the side that leads.
TEST(HairMeshEllipsoid, SweepsWhatItTurnsThrough) {
  const double step = 1 / 24.0;
  Eigen::Matrix3d axes;  // its long axis points along y at the end, along x at the start
  axes.col(0) = Vec3(0, 1, 0), axes.col(1) = Vec3(-1, 0, 0), axes.col(2) = Vec3(0, 0, 1);
  MeshEllipsoid<double> blade = ellipsoid({0, 0, 0}, {0.4, 0.03, 0.03}, axes);
  blade.spin[2] = 0.5 * M_PI / step, blade.turn[2] = std::sin(0.25 * M_PI);
  const Vec3 still(0.15, 0.15, 0);
  const MeshSurfacePoint<double> found = swept(blade, still, still, step);
  EXPECT_LT(found.normal[0], -0.9);
  EXPECT_LT(found.point[0], 0);
  MeshSurfacePoint<double> none{};
  const Vec3 behind(0.15, -0.15, 0);
  EXPECT_FALSE(kernels::find_on_ellipsoid(blade, behind.data(), behind.data(), 0.0, step, none));
}

TEST(HairMeshEllipsoid, ReachesAsFarFromOblongBodies) {
  const MeshEllipsoid<double> e = ellipsoid({0, 0, 0}, {0.5, 0.02, 0.1}, Eigen::Matrix3d::Identity());
  for (const double angle : {0.0, 0.3, 0.8, 1.2, 1.5}) {
    const Vec3 on(0.5 * std::cos(angle), 0.02 * std::sin(angle), 0);
    const Vec3 normal = Vec3(on.x() / 0.25, on.y() / 0.0004, 0).normalized();
    MeshSurfacePoint<double> found{};
    for (const double above : {0.0049, 0.0051}) {
      const Vec3 point = on + above * normal;
      EXPECT_EQ(kernels::find_on_ellipsoid(e, point.data(), point.data(), 0.005, 1.0, found), above < 0.005);
    }
  }
}

TEST(HairMeshContact, FrictionIsCoulombs) {
  using Padded = kernels::Padded<double>;
  const auto after = [&](const Vec3& velocity, double mu) {
    const Padded v{velocity[0], velocity[1], velocity[2], 0};
    const Padded result =
        kernels::velocity_after_contact<double>(v, Padded{1, 0, 0, 0}, Padded{0, 1, 0, 0}, mu);
    return Vec3(result[0], result[1], result[2]);
  };
  EXPECT_LE((after({3, -1, 0}, 0.5) - Vec3(2.5, 0, 0)).norm(), 1e-15) << "slides";
  EXPECT_LE((after({1.2, -1, 0.2}, 0.5) - Vec3(1, 0, 0)).norm(), 1e-15) << "sticks";
  EXPECT_LE((after({3, 1, 0}, 0.5) - Vec3(3, 1, 0)).norm(), 1e-15) << "leaves";
}

// A prism that stands free on a slope: it stays where mu is above the slope's tangent, and slides below it.
TEST(HairMeshContact, AMeshOnASlopeSticksOrSlides) {
  for (const double mu : {0.0, 0.2, 0.8}) {
    HairMeshParameters parameters;
    parameters.held_roots = false, parameters.drag = 0;
    parameters.shear = parameters.horizontal = parameters.volume = 2e4;
    MeshRun<double> run(prism_column(4, 3, 0.1, 0.1), parameters);
    // Upside down for the solver: the outermost layer, which is external as all but roots are, stands on the
    // slope.
    const double tangent = 0.4;
    const Vec3 normal = Vec3(tangent, 1, 0).normalized(), down = Vec3(1, -tangent, 0).normalized();
    const auto find = [&](const double*, const double* point, double reach, MeshSurfacePoint<double>& found) {
      const double above = normal.dot(Vec3(point[0], point[1], point[2]));
      if (!(above < reach)) return false;
      for (int k = 0; k < 3; ++k)
        found.point[k] = point[k] - above * normal[k], found.normal[k] = normal[k], found.velocity[k] = 0;
      found.friction = mu;
      return true;
    };
    Eigen::Matrix3d turn;
    turn << down, -normal, down.cross(-normal);
    for (int v = 0; v < run.vertices(); ++v) run.put(v, turn * (run.mesh.at(v) - Vec3(0, 0.1, 0)));
    run.set();
    constexpr int kFrames = 48;
    const auto mean = [&](const std::vector<double>& of) {
      Vec3 sum = Vec3::Zero();
      for (int v = 0; v < run.vertices(); ++v) sum += Eigen::Map<const Vec3>(of.data() + 3 * v);
      return Vec3(sum / run.vertices());
    };
    const Vec3 before = mean(run.position);
    Vec3 halfway = Vec3::Zero();
    for (int frame = 0; frame < kFrames; ++frame) {
      run.frame();
      run.solver->collide(kernels::mesh_surface<double>(find)), run.solver->minimise();
      run.get();
      if (frame + 1 == kFrames / 2) halfway = mean(run.velocity);
    }
    const double steep = tangent / std::hypot(1, tangent), flat = 1 / std::hypot(1, tangent);
    const double gained = (mean(run.velocity) - halfway).dot(down), time = kFrames / 2 / 24.0;
    if (mu > tangent)
      EXPECT_LE((mean(run.position) - before).norm(), 0.02) << mu;
    else
      EXPECT_NEAR(gained / time, 9.81 * (steep - mu * flat), 0.03 * 9.81) << mu;
    EXPECT_GE((mean(run.position) - before).dot(normal), -0.02) << "it does not sink";
  }
}

// What friction has held leaves at once when it is pulled off, wherever rounding has left it.
TEST(HairMeshContact, AMeshThatIsPulledOffItsGroundLeavesIt) {
  HairMeshParameters parameters;
  parameters.held_roots = false, parameters.drag = 0;
  MeshRun<float> run(prism_column(4, 3, 0.1, 0.1), parameters);
  const float ground = 0.37F;
  const auto find = [&](const float*, const float* point, float reach, MeshSurfacePoint<float>& found) {
    if (!(point[1] - ground < reach)) return false;
    found = {{point[0], ground, point[2]}, {0, 1, 0}, {0, 0, 0}, 0.8F};
    return true;
  };
  Eigen::Matrix3d upside_down = Eigen::Vector3d(1, -1, -1).asDiagonal();
  for (int v = 0; v < run.vertices(); ++v)
    run.put(v, upside_down * (run.mesh.at(v) - Vec3(0, 0.1, 0)) + Vec3(0, ground, 0));
  run.set();
  const auto lowest = [&] {
    double low = 1e9;
    for (int v = 0; v < run.vertices(); ++v) low = std::min(low, run.at(v).y() - ground);
    return low;
  };
  const auto stand = [&](int frames) {
    for (int frame = 0; frame < frames; ++frame) {
      run.frame();
      run.solver->collide(kernels::mesh_surface<float>(find)), run.solver->minimise();
    }
    run.get();
  };
  stand(48);
  ASSERT_NEAR(lowest(), 0, 1e-5);
  run.step.gravity[1] = 9.81F;
  stand(6);  // in which it rises by at least h^2 g (1 + ... + 5)
  EXPECT_GT(lowest(), 0.5 * 9.81 * 15 / (24.0 * 24.0));
}

// A ball that drives into a hanging lock within one frame and stays moves far the vertices that it meets.
// With the rest of the mesh taken along the volume is all there two frames later; without, inner vertices are
// left in the ball, and the volume force takes longer to get them out.
double volume_after_a_blow(bool minimise) {
  MeshRun<float> run(hanging_lock(3, 9, 0.1, 0.3));
  run.frames(120);
  const double settled = run.solver->volume();
  kernels::MeshEllipsoid<float> ball{};
  for (int k = 0; k < 3; ++k) ball.axis[k][k] = 1, ball.radius[k] = 0.1F;
  ball.centre[1] = -0.2F, ball.centre[0] = 0.05F + 0.1F - 0.04F;  // 4 cm deep
  for (int frame = 0; frame < 3; ++frame) {
    run.frame();
    run.solver->collide(&ball, 1);
    if (minimise) run.solver->minimise();
  }
  return run.solver->volume() / settled;
}

TEST(HairMeshContact, MinimisingKeepsTheVolumeThroughACollision) {
  const double on = volume_after_a_blow(true), off = volume_after_a_blow(false);
  EXPECT_NEAR(on, 1, 0.02);
  EXPECT_GT(std::abs(off - 1), 0.02);
}

// A ball smaller than the faces of a hanging lock comes between its vertices: slowly, until it has pushed the
// face aside by half of its width, and as far within one step. Returns how near the face's middle comes to
// the ball's centre, less than 0 where it is left behind it.
double nearest_ahead(double radius, double speed, int frames) {
  MeshRun<float> run(hanging_lock(1, 4, 0.16, 0.3));
  run.frames(48);
  const double step = 1 / 24.0, level = -0.15;
  kernels::MeshEllipsoid<float> ball{};
  for (int k = 0; k < 3; ++k) ball.axis[k][k] = 1, ball.radius[k] = static_cast<float>(radius);
  ball.centre[1] = static_cast<float>(level), ball.velocity[0] = static_cast<float>(speed);
  double nearest = 1;
  for (int frame = 1; frame <= frames; ++frame) {
    ball.centre[0] = static_cast<float>(-0.3 + frame * step * speed);
    run.frame();
    run.solver->collide(&ball, 1), run.solver->minimise();
    run.get();
    // The lock's near face, between its second and third layer, whose middle the ball meets.
    Vec3 ahead(-ball.centre[0], -level, 0);
    for (const int column : {0, 1})
      for (const int layer : {1, 2}) ahead += run.at(4 * column + layer) / 4;
    nearest = std::min(nearest, std::copysign(ahead.norm(), ahead.x()));
  }
  return nearest;
}

// Places between vertices may be as deep in a solid as chords of what is round: 0.15 of their span.
TEST(HairMeshContact, NothingSmallSlipsThroughAFace) {
  const double radius = 0.06, deepest = 0.15 * std::hypot(0.16, 0.1);
  EXPECT_GE(nearest_ahead(radius, 0.5, 13), radius - deepest - 1e-3);
  EXPECT_GE(nearest_ahead(radius, 13 * 0.5, 1), radius - deepest - 1e-3);
}

}  // namespace
}  // namespace ringlet::kernels_testing
