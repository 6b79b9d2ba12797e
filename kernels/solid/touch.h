// Where a particle touches a solid, and the velocity that it is left with there (AMS paper 3.3; physics.md
// section 6).
#pragma once
#include "kernels/backend/vector.h"

namespace ringlet::kernels {

// What is kept of a touch from one substep to the next, [rows][kTouchReals]: the surface's normal, outwards,
// 0 where nothing touches; its velocity [m/s], along the normal no faster than the particle has followed it,
// and against the strand's root where it is the solid that strands grow on; Coulomb's mu [-]; 1 for that
// solid, else 0; and from hair that lies on the particle, the speed [m/s] that it was pressed with.
enum TouchReal { kTouchNormal, kTouchVelocity = 3, kTouchFriction = 6, kTouchHome, kTouchLoad, kTouchReals };

inline namespace RINGLET_ISA {

template <class T>
struct SurfaceTouch {
  Vector3<T> normal, velocity;
  T friction;
  T home = T(0);
  T load = T(0);

  // Of a velocity v against the surface's: u, whose part into the solid goes, with Coulomb friction, also of
  // the load.
  //
  //   v' = v_solid + max(0, 1 - mu (|u_n| + load) / |u_t|) u_t
  RINGLET_FUNCTION Vector3<T> respond(Vector3<T> v) const {
    const Vector3<T> u = v - velocity;
    const T along = dot(u, normal);
    if (along > T(0)) return v;  // separating
    const Vector3<T> tangential = fma(-along, normal, u);
    const T slip = length(tangential);
    const T keep = max(T(0), fma(friction * (along - load), inverse_or_zero(slip, T(1e-12)), T(1)));
    return fma(keep, tangential, velocity);
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
