// Hair that lies on a solid, as contacts see it.
//
// Contacts are answered before solids. Of two hairs that fall alike on one another they would see no
// approach, and then the solid would stop the lower one alone and press both flat. So what a solid pressed
// in the substep before is seen as the solid will leave it: with the velocity of kernels/solid/touch.h and no
// lower than the plane it then lies in; and it does not give way into that plane. With P what is left of
// motion, 1 - n n^T, a push along d counts |P d| of the response to all contacts: d . P e is at most |P d|
// for any other of their directions e. Into the state goes what takes it off the plane or along; what presses
// it into the plane is the load that the solid's friction feels, and the rest is the solids' to do.
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
  static constexpr T kLifted = T(1e-6), kLeaving = T(1e-5);  // [m], [m/s]; less is rounding

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
  // What becomes of `motion` where contacts have made `now` of what they have seen. Adds to the load.
  RINGLET_KERNEL Motion<T> after(const Motion<T>& motion, const Motion<T>& now, T& load) const {
    if (!held() || height(now.place) > kLifted) return now;
    if (dot(now.velocity - touch.velocity, vector_of(plane)) > kLeaving) return now;
    const Motion<T> before = seen(motion);
    const Vector3<T> n = vector_of(plane), turned = now.velocity - before.velocity,
                     moved = now.place - before.place;
    const T pressed = max(T(0), T(0) - dot(turned, n));
    load += pressed;
    return {motion.place + fma(max(T(0), T(0) - dot(moved, n)), n, moved),
            motion.velocity + fma(pressed, n, turned)};
  }

 private:
  RINGLET_KERNEL Motion<T> respond(const Motion<T>& motion) const {
    const Vector3<T> velocity = touch.respond(motion.velocity);
    return {fma(step, velocity - motion.velocity, motion.place), velocity};
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
    return sqrt(max(R(0), R(1) - into * into));
  };
  const R begin = left(normal.begin) * free.begin_extra, end = left(normal.end) * free.end_extra;
  return fma(s, end - begin, begin);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
