// What hair meshes collide with over a substep: the scene's solids, and ellipsoids.
#pragma once
#include <vector>

#include "core/geometry.h"
#include "kernels/hairmesh/hair_mesh_solver.h"
#include "kernels/solid/contact.h"
#include "scene/scene_desc.h"

namespace ringlet::hairmesh {

// A solid of a level set as the solver asks for it. Points and velocities are against `origin` [m], which
// does not move; `step` [s] is the substep that the view is of.
template <class T>
class SolidCollider {
 public:
  SolidCollider(const kernels::SolidView& solid, const Vec3& origin, double step)
      : contact_(solid, kernels::Vector3<double>{origin.x(), origin.y(), origin.z()}, step), step_(step) {}

  // As kernels::MeshSurface::find.
  bool operator()(const T* before, const T* point, T reach, kernels::MeshSurfacePoint<T>& found) const;

 private:
  kernels::StrandContact<double> contact_;  // as of a particle of a strand that is rooted at the origin
  double step_;
};

// How fast a solid will carry what is at x [m] on its surface at the substep's start [m/s].
Vec3 carrying_velocity(const kernels::SolidView& solid, const Vec3& x, double step);
// The same of an ellipsoid, with x against the solver's origin.
template <class T>
Vec3 carrying_velocity(const kernels::MeshEllipsoid<T>& ellipsoid, const Vec3& x, double step);

// An ellipsoid that was carried from `before` to `now` by a substep of `step` [s].
template <class T>
kernels::MeshEllipsoid<T> moving_ellipsoid(const scene::Ellipsoid& rest, const Pose& before, const Pose& now,
                                           const Vec3& origin, double step);

}  // namespace ringlet::hairmesh
