#include "hairmesh/collider.h"

#include "kernels/solid/surface.h"

namespace ringlet::hairmesh {
namespace {

using kernels::Vector3;

Vec3 eigen(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

}  // namespace

template <class T>
bool SolidCollider<T>::operator()(const T* point, T reach, kernels::MeshSurfacePoint<T>& found) const {
  const Vec3 x = origin_ + Vec3(point[0], point[1], point[2]);
  const Vec3 away = x - Vec3(solid_.translation[0], solid_.translation[1], solid_.translation[2]);
  const Vector3<double> local =
      kernels::rotate_back(solid_.rotation, Vector3<double>{away.x(), away.y(), away.z()});
  const kernels::SurfaceSample<double> at = kernels::sample_surface(solid_, local, kernels::Patch{});
  if (!at.exact || !(at.distance < static_cast<double>(reach))) return false;
  const Vec3 normal = eigen(kernels::rotate(solid_.rotation, at.normal)),
             on_surface = x - at.distance * normal - origin_,
             velocity = eigen(kernels::surface_displacement(solid_, at)) / step_;
  for (int c = 0; c < 3; ++c) {
    found.point[c] = static_cast<T>(on_surface[c]), found.normal[c] = static_cast<T>(normal[c]);
    found.velocity[c] = static_cast<T>(velocity[c]);
  }
  found.friction = static_cast<T>(solid_.friction);
  return true;
}

template <class T>
kernels::MeshEllipsoid<T> moving_ellipsoid(const scene::Ellipsoid& rest, const Pose& before, const Pose& now,
                                           const Vec3& origin, double step) {
  const Vec3 centre = now.rotation * rest.centre + now.position,
             centre_before = before.rotation * rest.centre + before.position;
  const Mat3 axes = now.rotation * rest.rotation.toRotationMatrix();
  const Eigen::AngleAxisd turn(Mat3(now.rotation * before.rotation.transpose()));
  const Vec3 velocity = (centre - centre_before) / step, spin = turn.angle() / step * turn.axis();
  kernels::MeshEllipsoid<T> ellipsoid{};
  for (int c = 0; c < 3; ++c) {
    ellipsoid.centre[c] = static_cast<T>(centre[c] - origin[c]);
    ellipsoid.radius[c] = static_cast<T>(rest.radii[c]);
    ellipsoid.velocity[c] = static_cast<T>(velocity[c]), ellipsoid.spin[c] = static_cast<T>(spin[c]);
    for (int k = 0; k < 3; ++k) ellipsoid.axis[k][c] = static_cast<T>(axes(c, k));
  }
  ellipsoid.friction = static_cast<T>(rest.friction);
  return ellipsoid;
}

template class SolidCollider<float>;
template class SolidCollider<double>;
template kernels::MeshEllipsoid<float> moving_ellipsoid(const scene::Ellipsoid&, const Pose&, const Pose&,
                                                        const Vec3&, double);
template kernels::MeshEllipsoid<double> moving_ellipsoid(const scene::Ellipsoid&, const Pose&, const Pose&,
                                                         const Vec3&, double);

}  // namespace ringlet::hairmesh
