// What a contact does to the two segments: unilateral, with Coulomb friction, on places and on velocities.
//
// With c_i the share of particle i in the contact (1 - s, s on a; u - 1, -u on b), m_i its freedom (1, or 0
// where it is prescribed; hair has unit mass) and n_i the number of contacts that it is shared among (mass
// splitting, Tonge, Benevolenski, Voroshilov 2012: as many copies of the particle, each with its part of the
// mass, then their mean), one contact sees the inverse mass
//
//   w = sum_i c_i^2 m_i n_i
//
// and an impulse p moves particle i by m_i c_i p. Every contact takes from the motion of its copies, and a
// mean of copies has no more energy than they have: passes make no energy.
//
// Places: p = max(0, -gap) / w along the normal; against the slip since the two met, at most mu times that.
// Velocities: the same with the approaching velocity for the overlap and the tangential velocity for the
// slip. A place is only put right, which is not a motion: what the contact does to the motion, it does to
// the velocity. So hair that comes to rest on hair keeps nothing of the way it was pushed back, whatever the
// time between two applications; and since gravity's slip and fall grow alike over that time, hair sticks on
// hair below the angle of friction.
#pragma once
#include "kernels/contact/contact_data.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// The mass that two places have together along their normal, and across it.
template <class R>
struct ContactMass {
  R along, across;
};

// An impulse that makes up for `lacking` (distance or speed along the normal), `relaxation` times, and for
// `slip` (across the normal) as far as friction goes. [m] or [m/s]
template <class R>
RINGLET_KERNEL Vector3<R> contact_impulse(Vector3<R> normal, R lacking, R relaxation, Vector3<R> slip,
                                          R friction, const ContactMass<R>& mass) {
  const R along = max(lacking, R(0)) * mass.along;
  const R size = length(slip);
  const R against = min(friction * along, size * mass.across);
  const R scale = against * inverse_or_zero(size, R(Scalar<R>(1e-18)));
  return fma(R(0) - scale, slip, relaxation * along * normal);
}

template <class R>
RINGLET_KERNEL Vector3<R> across(Vector3<R> normal, Vector3<R> a) {
  return fma(R(0) - dot(normal, a), normal, a);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
