// One strand against one solid: samples, the velocity a touched particle is left with, and the place where a
// fast one entered (AMS paper 3.3; physics.md section 6).
//
// A particle found inside at x + h v first loses the part of its velocity that goes into the solid, with
// Coulomb friction (touch.h), and moves to x + h v'; if that is still inside it is pushed out along the
// normal (the paper's sign pushes deeper). One that has passed through the solid, or to the far side of a
// thin one, is taken back to where it entered and slides on from there.
#pragma once
#include "kernels/solid/surface.h"
#include "kernels/solid/touch.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
struct LaneFigures {
  bool touched = false;
  T pushed = T(0);  // largest push-out of the last round
  T strain = T(0);  // largest left
  T rounds = T(0);
  int swept = 0;
};

// How deep a segment may dip into the solid between its particles, in voxels: hair that lies on a round head
// is a polyline of chords. What is deeper is a thin part of the solid between two particles.
inline constexpr float kChordVoxels = 0.25f;

template <class T>
struct StrandContact {
  const SolidView& solid;
  Vector3<T> root;         // root point in level-set axes, relative to their origin
  Vector3<T> root_before;  // the same point against the solid's pose at the substep's start
  T step;
  T voxel, band;  // [m]
  Patch skin;     // that the strand grows on
  // How deep a particle may lie in the solid [m]: of one in which the root is buried, less the hair from
  // there.
  T slack = T(0);
  T home = T(0);  // 1 for the solid that strands grow on

  RINGLET_FUNCTION StrandContact(const SolidView& s, const Vector3<double>& root_point, T h)
      : solid(s),
        root(local(s.rotation, s.translation, root_point)),
        root_before(local(s.rotation_before, s.translation_before, root_point)),
        step(h),
        voxel(static_cast<T>(s.level_set[0].voxel_size)),
        band(static_cast<T>(s.level_set[0].background)) {}
  // The root point of one lane of a batch.
  RINGLET_FUNCTION StrandContact(const SolidView& s, const double* root_point, T h)
      : StrandContact(s, Vector3<double>{root_point[0], root_point[kLanes], root_point[2 * kLanes]}, h) {}

  RINGLET_FUNCTION static Vector3<T> local(const double* rotation, const double* translation,
                                           const Vector3<double>& point) {
    const double away[3] = {point.x - translation[0], point.y - translation[1], point.z - translation[2]};
    const auto along = [&](int axis) {
      return static_cast<T>(rotation[axis] * away[0] + rotation[3 + axis] * away[1] +
                            rotation[6 + axis] * away[2]);
    };
    return {along(0), along(1), along(2)};
  }

  // In level-set coordinates; `x` relative to the root point, world axes.
  RINGLET_FUNCTION Vector3<T> local(Vector3<T> x) const { return root + rotate_back(solid.rotation, x); }
  RINGLET_FUNCTION Vector3<T> world(Vector3<T> p) const { return rotate(solid.rotation, p - root); }

  // Distances are to where the particle may lie.
  RINGLET_FUNCTION SurfaceSample<T> sample(Vector3<T> x) const {
    SurfaceSample<T> at = sample_surface(solid, local(x), skin);
    at.distance = at.distance + slack;
    return at;
  }
  // The same where only what is deeper than a chord's dip matters.
  RINGLET_FUNCTION SurfaceSample<T> sample_inside(Vector3<T> x) const {
    SurfaceSample<T> at =
        sample_surface(solid, local(x), skin, static_cast<T>(kNearVoxels - kChordVoxels) * voxel);
    at.distance = at.distance + slack;
    return at;
  }
  // Begins at the root: no hair reaches out of a solid that its root is buried in deeper than the hair is
  // long.
  RINGLET_FUNCTION void begin_at_root() {
    slack = max(T(0), T(0) - sample_surface(solid, root, skin).distance);
  }
  RINGLET_FUNCTION void go_along(T segment) { slack = max(T(0), fma(T(-0.25), segment, slack)); }
  RINGLET_FUNCTION Vector3<T> world_normal(const SurfaceSample<T>& at) const {
    return rotate(solid.rotation, at.normal);
  }

  // Whether a strand that reaches `extent` [m] from its root over the substep may come near the solid.
  RINGLET_FUNCTION bool within_reach(T extent) const {
    const T reach = extent + length(root - root_before);
    return distance_to_bounds(solid.level_set[0], root) <= reach ||
           (solid.blend > 0.0f && distance_to_bounds(solid.level_set[1], root) <= reach);
  }

  RINGLET_FUNCTION SurfaceTouch<T> touch(const SurfaceSample<T>& at) const {
    return {world_normal(at), (T(1) / step) * surface_displacement(solid, at), static_cast<T>(solid.friction),
            home};
  }

  // The particle's way over the substep as the solid sees it, level-set axes [m]. A surface that deforms
  // takes along what is near it.
  RINGLET_FUNCTION Vector3<T> way(Vector3<T> x, Vector3<T> v, Vector3<T> p, std::int32_t nearest) const {
    const Vector3<T> before = root_before + rotate_back(solid.rotation_before, fma(T(0) - step, v, x));
    const std::int32_t carrier = nearest >= 0 ? nearest : skin.triangle;
    if (solid.vertices == solid.vertices_before || carrier < 0) return p - before;
    return p - before -
           local_displacement(solid, carrier, closest_on_triangle(solid, carrier, p).barycentric);
  }
};

// Where a particle entered the solid on its way.
template <class T>
struct Entry {
  bool found = false;
  Vector3<T> x;  // relative to the root point, world axes; just inside
  T left;        // share of the substep that was still to come
};

// Looks along the last `way` to p for the solid, in steps as long as the distances allow but no shorter than
// half a voxel: thinner parts are found where a step ends in them. `ends_inside` tells of p.
template <class T>
RINGLET_FUNCTION Entry<T> find_entry(const StrandContact<T>& contact, Vector3<T> p, Vector3<T> way,
                                     T distance, bool ends_inside) {
  constexpr int kMostProbes = 256, kHalvings = 6;
  const T least = max(T(0.5) * contact.voxel, distance / T(kMostProbes));
  const auto depth_after = [&](T gone) {
    return -sample_surface(contact.solid, fma(gone / distance - T(1), way, p), contact.skin).distance;
  };
  T outside = T(0), inside = least;
  if (depth_after(T(0)) > T(0.25) * contact.voxel) return {};  // it was inside before
  for (;; inside = outside + least) {
    if (!(inside < distance)) {
      if (!ends_inside) return {};
      inside = distance;
      break;
    }
    const T depth = depth_after(inside);
    if (depth > T(0)) break;
    outside = max(inside, inside - depth - least);
  }
  for (int k = 0; k < kHalvings; ++k) {
    const T middle = T(0.5) * (outside + inside);
    (depth_after(middle) > T(0) ? inside : outside) = middle;
  }
  return {true, contact.world(fma(inside / distance - T(1), way, p)), T(1) - inside / distance};
}

// An entry that the sample at the particle's end does not show: it has passed through, or is nearer to the
// far side.
template <class T>
RINGLET_FUNCTION Entry<T> hidden_entry(const StrandContact<T>& contact, Vector3<T> x, Vector3<T> v,
                                       const SurfaceSample<T>& at, LaneFigures<T>& figures) {
  const Vector3<T> p = contact.local(x), way = contact.way(x, v, p, at.triangle);
  const T distance = length(way);
  if (distance > contact.band) ++figures.swept;
  const bool inside = at.distance < T(0) && at.exact;
  const bool suspect = inside ? dot(way, at.normal) > T(0) && distance > -at.distance
                              : distance > max(T(0.5) * contact.voxel, at.distance);
  return suspect ? find_entry(contact, p, way, distance, inside) : Entry<T>{};
}

// The velocity and push-out stages for one particle; true where it touched. `touch` comes as it last was,
// with its load, which is felt on the same side of the same solid; `clearance` becomes how far outside the
// solid the particle is at least [m].
template <class T>
RINGLET_FUNCTION bool collide_particle(const StrandContact<T>& contact, Vector3<T>& x, Vector3<T>& v,
                                       SurfaceTouch<T>& touch, T& clearance, LaneFigures<T>& figures) {
  SurfaceSample<T> at = contact.sample(x);
  clearance = max(T(0), at.distance);
  const Entry<T> entry = contact.slack > T(0) ? Entry<T>{} : hidden_entry(contact, x, v, at, figures);
  if (entry.found) at = contact.sample(entry.x);
  if (!at.exact || !(entry.found || at.distance < T(0))) return false;
  clearance = T(0);
  const SurfaceTouch<T> last = touch;
  touch = contact.touch(at);
  if (last.home == touch.home && dot(last.normal, touch.normal) > T(0)) touch.load = last.load;
  const Vector3<T> changed = touch.respond(v);
  if (entry.found)
    x = entry.x + entry.left * contact.step * (changed - touch.velocity);
  else
    x = fma(contact.step, changed - v, x);
  v = changed;
  at = contact.sample(x);
  if (at.distance < T(0) && at.exact) {
    touch = contact.touch(at);
    x = fma(-at.distance, touch.normal, x);
  }
  return true;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
