// Hair that lies on a solid, as contacts see it.
//
// Contacts are answered before solids. Of two hairs that fall alike on one another they would see no
// approach, and then the solid would stop the lower one alone and press both flat. So what a solid pressed
// in the substep before is seen as the solid will leave it: with the velocity of kernels/solid/touch.h and no
// lower than the plane it then lies in; and it does not give way into that plane: what is pushed along d
// counts 1 - min(0, d . n)^2 of its response. Into the state goes what lifts it off the plane or moves it
// along; the rest is the solids' to do.
#pragma once
#include "kernels/contact/contact_data.h"
#include "kernels/solid/touch.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
struct Motion {
  Vector3<T> place, velocity;
};

template <class T>
struct HeldParticle {
  SurfaceTouch<T> touch;
  Place<T> plane;  // its normal, 0 where nothing holds the particle; extra: its distance from the origin [m]
  T step;          // h [s]
  static constexpr T kLifted = T(1e-6);  // [m]

  RINGLET_KERNEL bool held() const { return dot(vector_of(plane), vector_of(plane)) > T(0); }
  RINGLET_KERNEL T height(Vector3<T> place) const { return dot(vector_of(plane), place) - plane.extra; }

  // The plane of a particle that moves so: none where it leaves the solid.
  RINGLET_KERNEL Place<T> plane_of(const Motion<T>& motion) const {
    if (!(dot(motion.velocity - touch.velocity, touch.normal) < T(0))) return {};
    const Vector3<T> n = touch.normal;
    return {n.x, n.y, n.z, dot(n, respond(motion).place)};
  }
  RINGLET_KERNEL Motion<T> seen(const Motion<T>& motion) const {
    if (!held()) return motion;
    const Motion<T> left = respond(motion);
    const T above = height(left.place);
    if (above > kLifted) return motion;
    return {fma(max(T(0), T(0) - above), vector_of(plane), left.place), left.velocity};
  }
  // What becomes of `motion` where contacts have made `now` of what they have seen.
  RINGLET_KERNEL Motion<T> after(const Motion<T>& motion, const Motion<T>& now) const {
    if (!held() || height(now.place) > kLifted) return now;
    const Motion<T> before = seen(motion);
    return {motion.place + outwards(now.place - before.place),
            motion.velocity + outwards(now.velocity - before.velocity)};
  }

 private:
  RINGLET_KERNEL Motion<T> respond(const Motion<T>& motion) const {
    const Vector3<T> velocity = touch.respond(motion.velocity);
    return {fma(step, velocity - motion.velocity, motion.place), velocity};
  }
  RINGLET_KERNEL Vector3<T> outwards(Vector3<T> change) const {
    const Vector3<T> n = vector_of(plane);
    return fma(max(T(0), T(0) - dot(change, n)), n, change);
  }
};

// The response of the places s of segments that are pushed along `along`. `plane`: of each particle;
// `free`: the segments' response if nothing held them, as extra.
template <class R>
RINGLET_KERNEL R held_response(const Place<Scalar<R>>* plane, const std::int32_t* segments, R s,
                               const GatheredSegment<R>& free, Vector3<R> along) {
  const Segment<R> normal = gather_segment<R>(plane, segments).places;
  const auto left = [&](Vector3<R> n) {
    const R into = min(R(0), dot(along, n));
    return R(1) - into * into;
  };
  const R begin = left(normal.begin) * free.begin_extra, end = left(normal.end) * free.end_extra;
  return fma(s, end - begin, begin);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
