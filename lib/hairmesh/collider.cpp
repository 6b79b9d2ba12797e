#include "hairmesh/collider.h"

#include <algorithm>
#include <cmath>

namespace ringlet::hairmesh {
namespace {

constexpr double kDeeper = 1.5;  // than may be: rounding, and what the last step left

using kernels::SurfaceSample;
using kernels::Vector3;

}  // namespace

template <class T>
bool SolidCollider<T>::operator()(const T* before, const T* point, T reach,
                                  kernels::MeshSurfacePoint<T>& found) const {
  const Vector3<double> x{point[0], point[1], point[2]}, start{before[0], before[1], before[2]},
      velocity = (1 / step_) * (x - start);
  SurfaceSample<double> at = contact_.sample(x);
  kernels::LaneFigures<double> figures;
  const kernels::Entry<double> entry = kernels::hidden_entry(contact_, x, velocity, at, figures);
  Vector3<double> to = x, entered = entry.x;
  bool through = entry.found;
  if (!through && reach < T(0) && at.exact && at.distance < 0) {
    // It may have been a little inside before, and is nearer to the far side now.
    const Vector3<double> p = contact_.local(x), from = p - contact_.way(x, velocity, p, at.triangle);
    const SurfaceSample<double> was = kernels::sample_surface(contact_.solid, from, contact_.skin);
    through = was.exact && was.distance < 0 && was.distance >= kDeeper * static_cast<double>(reach) &&
              dot(was.normal, at.normal) < 0;
    entered = contact_.world(from - was.distance * was.normal);
  }
  if (through) {
    at = contact_.sample(entered);
    if (!at.exact) return false;
    // On from the entry without what would lead it farther in, unless that is inside again.
    const Vector3<double> normal = contact_.world_normal(at);
    to = x - std::min(dot(x - entered, normal), 0.0) * normal;
    const SurfaceSample<double> beside = contact_.sample(to);
    if (beside.exact && beside.distance < 0)
      at = beside;
    else
      at.distance = 0;
  } else if (!at.exact || !(at.distance < static_cast<double>(reach))) {
    return false;
  }
  const Vector3<double> normal = contact_.world_normal(at), on_surface = to - at.distance * normal,
                        surface_velocity = (1 / step_) * kernels::surface_displacement(contact_.solid, at);
  const auto fill = [](T(&values)[3], const Vector3<double>& v) {
    values[0] = static_cast<T>(v.x), values[1] = static_cast<T>(v.y), values[2] = static_cast<T>(v.z);
  };
  fill(found.point, on_surface), fill(found.normal, normal), fill(found.velocity, surface_velocity);
  found.friction = static_cast<T>(contact_.solid.friction);
  return true;
}

template <class T>
kernels::MeshEllipsoid<T> moving_ellipsoid(const scene::Ellipsoid& rest, const Pose& before, const Pose& now,
                                           const Vec3& origin, double step) {
  const Vec3 centre = now.rotation * rest.centre + now.position,
             centre_before = before.rotation * rest.centre + before.position;
  const Mat3 axes = now.rotation * rest.rotation.toRotationMatrix();
  const Eigen::AngleAxisd turn(Mat3(now.rotation * before.rotation.transpose()));
  const Vec3 velocity = (centre - centre_before) / step, spin = turn.angle() / step * turn.axis(),
             half = std::sin(turn.angle() / 2) * turn.axis();  // Eigen's angles are not over pi
  kernels::MeshEllipsoid<T> ellipsoid{};
  for (int c = 0; c < 3; ++c) {
    ellipsoid.centre[c] = static_cast<T>(centre[c] - origin[c]);
    ellipsoid.radius[c] = static_cast<T>(rest.radii[c]);
    ellipsoid.velocity[c] = static_cast<T>(velocity[c]), ellipsoid.spin[c] = static_cast<T>(spin[c]);
    ellipsoid.turn[c] = static_cast<T>(half[c]);
    for (int k = 0; k < 3; ++k) ellipsoid.axis[k][c] = static_cast<T>(axes(c, k));
  }
  ellipsoid.friction = static_cast<T>(rest.friction);
  return ellipsoid;
}

Vec3 carrying_velocity(const kernels::SolidView& solid, const Vec3& x, double step) {
  const Vector3<double> away{x.x() - solid.translation_before[0], x.y() - solid.translation_before[1],
                             x.z() - solid.translation_before[2]},
      local = kernels::rotate_back(solid.rotation_before, away);
  const SurfaceSample<double> at = kernels::sample_surface(solid, local, kernels::Patch{});
  if (!at.exact) return Vec3::Zero();
  const Vector3<double> way = kernels::surface_displacement(solid, at);
  return Vec3(way.x, way.y, way.z) / step;
}

template <class T>
Vec3 carrying_velocity(const kernels::MeshEllipsoid<T>& e, const Vec3& x, double step) {
  const Vec3 centre(e.centre[0], e.centre[1], e.centre[2]),
      velocity(e.velocity[0], e.velocity[1], e.velocity[2]), half(e.turn[0], e.turn[1], e.turn[2]);
  const Eigen::Quaterniond turn(std::sqrt(std::max(0.0, 1 - half.squaredNorm())), half.x(), half.y(),
                                half.z());
  const Vec3 arm = x - (centre - step * velocity);
  return velocity + (turn * arm - arm) / step;
}

template class SolidCollider<float>;
template class SolidCollider<double>;
template Vec3 carrying_velocity(const kernels::MeshEllipsoid<float>&, const Vec3&, double);
template Vec3 carrying_velocity(const kernels::MeshEllipsoid<double>&, const Vec3&, double);
template kernels::MeshEllipsoid<float> moving_ellipsoid(const scene::Ellipsoid&, const Pose&, const Pose&,
                                                        const Vec3&, double);
template kernels::MeshEllipsoid<double> moving_ellipsoid(const scene::Ellipsoid&, const Pose&, const Pose&,
                                                         const Vec3&, double);

}  // namespace ringlet::hairmesh
