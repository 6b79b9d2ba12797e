// Contacts of a hair mesh's external vertices with what is solid: how a surface answers a vertex, and
// ellipsoids, the bodies of the hair mesh paper.
#pragma once
#include "kernels/hairmesh/hair_mesh_solver.h"
#include "kernels/hairmesh/padded_vector.h"

namespace ringlet::kernels {

inline namespace RINGLET_ISA {

// The point of the ellipsoid with these radii that is nearest to p, both in its axes. With y the nearest
// point, p - y is along the normal: y_k = r_k^2 p_k / (t + r_k^2), where t is the largest root of sum (r_k
// p_k / (t + r_k^2))^2 = 1. To the right of its poles the sum is convex and falls: Newton's method from a
// lower bound of the root climbs to it without passing it. Where p is on the plane across the shortest axis
// and near enough to the centre the root lies left of that axis' pole, and the nearest point is off the
// plane.
RINGLET_FUNCTION void nearest_on_ellipsoid(const double (&radius)[3], const double (&p)[3], double (&y)[3]) {
  int shortest = 0;
  for (int k = 1; k < 3; ++k)
    if (radius[k] < radius[shortest]) shortest = k;
  // In units of the shortest radius; `root` is t + r^2 there, `beyond` how much farther the other poles are.
  double ratio[3], square[3], beyond[3], root = 0;
  for (int k = 0; k < 3; ++k) {
    const double relative = radius[k] / radius[shortest];
    ratio[k] = abs(p[k] / radius[shortest] * relative);
    square[k] = relative * relative, beyond[k] = square[k] - 1;
    root = max(root, ratio[k] - beyond[k]);
  }
  for (int i = 0; i < 100; ++i) {
    double excess = -1, slope = 0;
    for (int k = 0; k < 3; ++k) {
      if (ratio[k] == 0) continue;
      const double term = ratio[k] / (root + beyond[k]);
      excess += term * term, slope += 2 * term * term / (root + beyond[k]);
    }
    const double next = root + excess / slope;
    if (!(excess > 0 && next > root)) break;
    root = next;
  }
  double left = 1;
  for (int k = 0; k < 3; ++k) {
    const double below = root + beyond[k];
    y[k] = below > 0 ? square[k] * p[k] / below : 0;
    if (k != shortest) left -= (y[k] / radius[k]) * (y[k] / radius[k]);
  }
  if (!(root > 0)) y[shortest] = radius[shortest] * sqrt(max(left, 0.0));
}

// As MeshSurface::find asks.
template <class T>
RINGLET_FUNCTION bool find_on_ellipsoid(const MeshEllipsoid<T>& e, const T* point, T reach,
                                        MeshSurfacePoint<T>& found) {
  double from[3], p[3], radius[3], y[3];
  for (int k = 0; k < 3; ++k) from[k] = double(point[k]) - double(e.centre[k]), radius[k] = e.radius[k];
  double within = 0, farther = 0;
  for (int k = 0; k < 3; ++k) {
    p[k] = from[0] * e.axis[k][0] + from[1] * e.axis[k][1] + from[2] * e.axis[k][2];
    const double near = p[k] / radius[k], far = p[k] / (radius[k] + double(reach));
    within += near * near, farther += far * far;
  }
  if (!(farther < 1))
    return false;  // the ellipsoid of longer radii holds all that is within reach, and little else
  nearest_on_ellipsoid(radius, p, y);
  double normal[3], square = 0;
  for (int k = 0; k < 3; ++k) normal[k] = y[k] / (radius[k] * radius[k]), square += normal[k] * normal[k];
  const double scale = 1 / sqrt(square);
  double arm[3];
  for (int i = 0; i < 3; ++i) {
    arm[i] = y[0] * e.axis[0][i] + y[1] * e.axis[1][i] + y[2] * e.axis[2][i];
    const double n = normal[0] * e.axis[0][i] + normal[1] * e.axis[1][i] + normal[2] * e.axis[2][i];
    found.point[i] = static_cast<T>(double(e.centre[i]) + arm[i]),
    found.normal[i] = static_cast<T>(scale * n);
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    found.velocity[i] = static_cast<T>(e.velocity[i] + e.spin[j] * arm[k] - e.spin[k] * arm[j]);
  }
  found.friction = e.friction;
  return true;
}

// Velocity after an inelastic contact with Coulomb friction: no approach is left along the normal, and the
// tangential velocity relative to the surface is slowed by at most mu times the change along the normal.
template <class T>
RINGLET_FUNCTION Padded<T> velocity_after_contact(Padded<T> velocity, Padded<T> surface_velocity,
                                                  Padded<T> normal, T friction) {
  const Padded<T> relative = velocity - surface_velocity;
  const T along = dot_product(relative, normal);
  if (!(along < T(0))) return velocity;
  const Padded<T> tangential = relative - along * normal;
  const T speed = sqrt(dot_product(tangential, tangential)), lost = friction * -along;
  return surface_velocity + (speed > lost ? (T(1) - lost / speed) * tangential : Padded<T>{});
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
