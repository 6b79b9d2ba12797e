// Where a particle touches a solid, and the velocity that it is left with there (AMS paper 3.3; physics.md
// section 6).
#pragma once
#include "kernels/backend/vector.h"

namespace ringlet::kernels {

// Of a particle that a solid has pressed, [rows][kTouchReals]: the surface's normal, outwards, and velocity
// against the strand's root [m/s], world axes, and Coulomb's mu [-]. The normal is 0 where none has.
inline constexpr int kTouchReals = 3 + 3 + 1;

inline namespace RINGLET_ISA {

template <class T>
struct SurfaceTouch {
  Vector3<T> normal, velocity;
  T friction;

  // Of a velocity v against the surface's: u, whose part into the solid goes, with Coulomb friction.
  //
  //   v' = v_solid + max(0, 1 - mu |u_n| / |u_t|) u_t
  RINGLET_FUNCTION Vector3<T> respond(Vector3<T> v) const {
    const Vector3<T> u = v - velocity;
    const T along = dot(u, normal);
    if (along > T(0)) return v;  // separating
    const Vector3<T> tangential = fma(-along, normal, u);
    const T slip = length(tangential);
    const T keep = max(T(0), fma(friction * along, inverse_or_zero(slip, T(1e-12)), T(1)));
    return fma(keep, tangential, velocity);
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
