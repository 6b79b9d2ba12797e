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

  // The plane of a particle that moves so: none where it leaves the solid.
  RINGLET_KERNEL Place<T> plane_of(const Motion<T>& motion) const {
    if (!(dot(motion.velocity - touch.velocity, touch.normal) < T(0))) return {};
    const Vector3<T> n = touch.normal;
    return {n.x, n.y, n.z, dot(n, respond(motion).place)};
  }
  // Whether it lies in its plane still: contacts may have lifted it, or sent it off.
  RINGLET_KERNEL bool holds(const Motion<T>& motion) const {
    const Vector3<T> n = vector_of(plane);
    if (!(dot(n, n) > T(0))) return false;
    const Motion<T> left = respond(motion);
    return dot(n, left.place) - plane.extra <= kLifted && dot(left.velocity - touch.velocity, n) <= kLeaving;
  }
  // As the solid will leave it that holds it.
  RINGLET_KERNEL Motion<T> seen(const Motion<T>& motion) const {
    const Motion<T> left = respond(motion);
    const Vector3<T> n = vector_of(plane);
    return {fma(max(T(0), plane.extra - dot(n, left.place)), n, left.place), left.velocity};
  }
  // What becomes of `motion` where the solid holds it and contacts have made `now` of what they have seen.
  RINGLET_KERNEL Motion<T> after(const Motion<T>& motion, const Motion<T>& now, T& load) const {
    const Motion<T> before = seen(motion);
    const Vector3<T> n = vector_of(plane), moved = now.place - before.place,
                     turned = now.velocity - before.velocity;
    const T lifted = dot(moved, n), sent_off = dot(turned, n), pressed = max(T(0), -sent_off);
    const Vector3<T> moves = fma(max(T(0), -lifted), n, moved), turns = fma(pressed, n, turned);
    if (lifted > kLifted || sent_off > kLeaving) {
      load = T(0);
      return {before.place + moves, before.velocity + turns};
    }
    load += pressed;
    return {motion.place + moves, motion.velocity + turns};
  }

 private:
  RINGLET_KERNEL Motion<T> respond(const Motion<T>& motion) const {
    const Vector3<T> velocity = touch.respond(motion.velocity);
    return {fma(step, velocity - motion.velocity, motion.place), velocity};
  }
};

// The response of the places s of segments that are pushed along `along`. `held`: the normal of the plane
// that each particle lies in, or 0; `free`: the segments' response if nothing held them, as extra.
template <class R>
RINGLET_KERNEL R held_response(const Place<Scalar<R>>* held, const std::int32_t* segments, R s,
                               const GatheredSegment<R>& free, Vector3<R> along) {
  const Segment<R> normal = gather_segment<R>(held, segments).places;
  const auto left = [&](Vector3<R> n) {
    const R into = min(R(0), dot(along, n));
    return sqrt(max(R(0), R(1) - into * into));
  };
  const R begin = left(normal.begin) * free.begin_extra, end = left(normal.end) * free.end_extra;
  return fma(s, end - begin, begin);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
