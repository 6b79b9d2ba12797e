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

RINGLET_FUNCTION double length_of(const double (&a)[3]) {
  return sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
}

// A point as the ellipsoid sees it, in its axes, when a share `left` of the step is still to come.
template <class T>
RINGLET_FUNCTION void in_ellipsoid_axes(const MeshEllipsoid<T>& e, const double (&x)[3], double step,
                                        double left, double (&p)[3]) {
  double from[3], turn[3];
  for (int k = 0; k < 3; ++k) {
    from[k] = x[k] - double(e.centre[k]) + left * step * double(e.velocity[k]);
    turn[k] = e.turn[k];
  }
  const double sine = length_of(turn);
  if (left > 0 && sine > 0) {
    // Turned as the ellipsoid has still to turn: between unit quaternions, normalised.
    const double cosine = sqrt(max(1 - sine * sine, 0.0));
    const double w = 1 + left * (cosine - 1), size = sqrt(w * w + left * sine * left * sine);
    double once[3];
    for (int k = 0; k < 3; ++k) turn[k] *= left / size;
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      once[k] = 2 * (turn[i] * from[j] - turn[j] * from[i]);
    }
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      from[k] += w / size * once[k] + (turn[i] * once[j] - turn[j] * once[i]);
    }
  }
  for (int k = 0; k < 3; ++k) p[k] = from[0] * e.axis[k][0] + from[1] * e.axis[k][1] + from[2] * e.axis[k][2];
}

// Below 1: inside.
RINGLET_FUNCTION double ellipsoid_level(const double (&radius)[3], const double (&p)[3]) {
  double level = 0;
  for (int k = 0; k < 3; ++k) level += (p[k] / radius[k]) * (p[k] / radius[k]);
  return level;
}

// The share of the way from a, outside, to b at which it enters the ellipsoid; above 1 where it does not.
RINGLET_FUNCTION double entry_into_ellipsoid(const double (&radius)[3], const double (&a)[3],
                                             const double (&b)[3]) {
  double square = 0, along = 0, level = -1;
  for (int k = 0; k < 3; ++k) {
    const double way = (b[k] - a[k]) / radius[k], from = a[k] / radius[k];
    square += way * way, along += way * from, level += from * from;
  }
  const double discriminant = along * along - square * level;
  if (!(along < 0 && discriminant > 0)) return 2;
  return max(level, 0.0) / (sqrt(discriminant) - along);
}

// Where a vertex that entered the ellipsoid on its way would have slid to by the step's end: on from the
// entry without what would have led it farther in. False where it did not enter, or was deeper than `skin`
// inside before [m].
template <class T>
RINGLET_FUNCTION bool slide_on_ellipsoid(const MeshEllipsoid<T>& e, const double (&radius)[3],
                                         const double (&before)[3], const double (&point)[3], double step,
                                         double skin, double (&p)[3]) {
  constexpr int kPieces = 16;  // of half a turn, each taken for straight
  const double turn[3] = {double(e.turn[0]), double(e.turn[1]), double(e.turn[2])};
  const int pieces = 1 + static_cast<int>(kPieces * length_of(turn));
  double from[3], to[3], end[3];
  in_ellipsoid_axes(e, before, step, 1.0, from), in_ellipsoid_axes(e, point, step, 0.0, end);
  if (ellipsoid_level(radius, from) < 1) {
    double above[3];
    nearest_on_ellipsoid(radius, from, to);
    for (int k = 0; k < 3; ++k) above[k] = to[k] - from[k], from[k] = to[k];
    if (length_of(above) > skin) return false;
  }
  for (int i = 1; i <= pieces; ++i) {
    const double share = double(i) / pieces;
    double x[3];
    for (int k = 0; k < 3; ++k) x[k] = before[k] + share * (point[k] - before[k]);
    in_ellipsoid_axes(e, x, step, 1 - share, to);
    const double entered = entry_into_ellipsoid(radius, from, to);
    if (entered < 1) {
      double normal[3], square = 0, inwards = 0;
      for (int k = 0; k < 3; ++k) {
        p[k] = from[k] + entered * (to[k] - from[k]);
        normal[k] = p[k] / (radius[k] * radius[k]), square += normal[k] * normal[k];
      }
      for (int k = 0; k < 3; ++k) inwards += normal[k] * (end[k] - p[k]);
      for (int k = 0; k < 3; ++k) p[k] = end[k] - min(inwards, 0.0) / square * normal[k];
      return true;
    }
    for (int k = 0; k < 3; ++k) from[k] = to[k];
  }
  return false;
}

// The ellipsoid's surface nearest p, in its axes.
template <class T>
RINGLET_FUNCTION void surface_of_ellipsoid(const MeshEllipsoid<T>& e, const double (&radius)[3],
                                           const double (&p)[3], MeshSurfacePoint<T>& found) {
  double y[3], normal[3], square = 0;
  nearest_on_ellipsoid(radius, p, y);
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
}

// As MeshSurface::find asks, over a step of `step` [s]. A point inside is moved to the nearest surface, one
// nearer to the far side, or through it, to where it slides from its entry.
template <class T>
RINGLET_FUNCTION bool find_on_ellipsoid(const MeshEllipsoid<T>& e, const T* before, const T* point, T reach,
                                        double step, MeshSurfacePoint<T>& found) {
  // That counts as the surface: of the shortest radius, and of how deep inside may be.
  constexpr double kSkin = 0.02, kDeeper = 1.5;
  double start[3], end[3], p[3], slid[3], radius[3], way[3], turn[3], shortest = double(e.radius[0]);
  for (int k = 0; k < 3; ++k) {
    start[k] = before[k], end[k] = point[k], radius[k] = e.radius[k], turn[k] = e.turn[k];
    way[k] = end[k] - start[k] - step * double(e.velocity[k]);
    shortest = min(shortest, radius[k]);
  }
  in_ellipsoid_axes(e, end, step, 0.0, p);
  const double gone = length_of(way), swept = gone + 2 * length_of(turn) * (length_of(p) + gone);
  const double skin = max(-kDeeper * double(reach), kSkin * shortest);
  const double level = ellipsoid_level(radius, p);
  // At most the distance: over it the level's root rises by no more than the distance over this radius.
  const double beside = (sqrt(level) - 1) * shortest;
  if (!(level < 1)) {
    if (swept > beside && slide_on_ellipsoid(e, radius, start, end, step, skin, slid)) {
      surface_of_ellipsoid(e, radius, slid, found);
      return true;
    }
    if (!(beside < double(reach))) return false;
  }
  surface_of_ellipsoid(e, radius, p, found);
  double above = 0;  // signed distance
  for (int k = 0; k < 3; ++k) above += (end[k] - double(found.point[k])) * double(found.normal[k]);
  if (level < 1 && swept > -above - skin && slide_on_ellipsoid(e, radius, start, end, step, skin, slid)) {
    // The near side, unless that is what is nearest anyway.
    MeshSurfacePoint<T> entry;
    surface_of_ellipsoid(e, radius, slid, entry);
    double same = 0;
    for (int k = 0; k < 3; ++k) same += double(entry.normal[k]) * double(found.normal[k]);
    if (same < 0) {
      found = entry;
      return true;
    }
  }
  return above < double(reach);
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
