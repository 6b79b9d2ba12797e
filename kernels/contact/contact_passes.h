// Passes over the pairs: each finds the contacts as places are now, weighs and applies their impulses.
//
// Impulses on a particle are summed exactly, once rounded: the sum does not depend on the order of pairs, on
// threads, or on the order of strands. What one contact gives to a particle of one segment it takes from the
// other's.
#pragma once
#include "kernels/backend/words.h"
#include "kernels/contact/contact_response.h"
#include "kernels/contact/held_particles.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Where a pair touches, and how far apart it is there.
template <class T>
struct alignas(4 * sizeof(T)) Touch {
  T s, u, gap, none;
};

// What a contact does: vectors in x, y and z; s, then u.
template <class T>
struct alignas(8 * sizeof(T)) ContactRecord {
  Place<T> on_place;     // the normal, then the impulse on places
  Place<T> on_velocity;  // the slip, then the impulse on velocities
};

template <class T>
struct ContactPairs {
  const std::int32_t *a, *b;  // [pairs]
  const signed char* side;    // [pairs] see find_contact
  Touch<T>* touch;            // [pairs]
  ContactRecord<T>* record;   // [pairs]
  unsigned char* active;      // [pairs] 0: no contact, 1: a contact, 2: of segments that have crossed
  std::int32_t count;
};

template <class R>
RINGLET_KERNEL R load_sides(const signed char* side) {
  alignas(64) Scalar<R> sides[Traits<R>::kWidth];
  for (int lane = 0; lane < Traits<R>::kWidth; ++lane) sides[lane] = static_cast<Scalar<R>>(side[lane]);
  return load<R>(sides);
}

// Asks for what the pack some packs after this one will read: partners lie about in memory.
template <class R>
RINGLET_KERNEL void fetch_ahead(const ContactPairs<Scalar<R>>& pairs, const HairPlaces<Scalar<R>>& places,
                                std::int32_t first) {
  constexpr std::int32_t kWidth = Traits<R>::kWidth, kAhead = 4 * kWidth;
  if (pairs.count - first < kAhead + kWidth) return;
  for (int lane = 0; lane < kWidth; ++lane) {
    const std::int32_t b = pairs.b[first + kAhead + lane];
    prefetch(&places.start[b]), prefetch(&places.end[b]);
  }
}

// Contacts as places are now. For a pack of pairs.
template <class R>
struct FindContacts {
  using T = Scalar<R>;
  static constexpr int kWidth = Traits<R>::kWidth;
  ContactPairs<T> pairs;
  HairPlaces<T> places;

  RINGLET_FUNCTION void operator()(std::int32_t pack) const {
    const std::int32_t first = pack * kWidth;
    fetch_ahead<R>(pairs, places, first);
    const PackOfPairs<R> gathered(places, pairs.a + first, pairs.b + first);
    const SegmentPair<R> pair = gathered.places();
    const R reach = gathered.largest_reach();
    const PairContact<R> contact = find_contact(pair, reach, load_sides<R>(pairs.side + first));
    const R gap = contact.distance - (gathered.a.extra_at(contact.s) + gathered.b.extra_at(contact.u));
    // Hair that rests on hair is a contact still when the last pass has put its place right.
    const R touching = R(T(1e-2)) * reach;
    std::uint32_t active = lane_bits((gap < touching) & (dot(contact.normal, contact.normal) > R(T(0.5))));
    if (pairs.count - first < kWidth) active &= ~(~0u << (pairs.count - first));
    for (int lane = 0; lane < kWidth; ++lane) pairs.active[first + lane] = active >> lane & 1;
    if (active == 0) return;
    for (std::uint32_t crossed = lane_bits(contact.crossed) & active; crossed; crossed &= crossed - 1)
      pairs.active[first + __builtin_ctz(crossed)] = 2;
    const Vector3<R> before = pair.a_start.at(contact.s) - pair.b_start.at(contact.u),
                     after = pair.a.at(contact.s) - pair.b.at(contact.u);
    const Vector3<R> slip = contact.later * across(contact.normal, after - before), normal = contact.normal;
    store_quads<R>(&pairs.touch[first].s, 1, {contact.s, contact.u, gap, R(0)});
    store_quads<R>(&pairs.record[first].on_place.x, 2, {normal.x, normal.y, normal.z, contact.s});
    store_quads<R>(&pairs.record[first].on_velocity.x, 2, {slip.x, slip.y, slip.z, contact.u});
  }
};

// Places converge the faster for being moved beyond what a contact by itself would want: less than twice that
// is safe. Velocities are not, for they would bounce.
inline constexpr double kRelaxation = 1.5;

// Hair that solids hold so that it gives way by less than this share of what it would do freely, as where it
// is pressed together from both sides, is left to them: ever more, the less it gives way.
inline constexpr double kSqueezed = 0.1;

// Impulses of a pack of pairs, in the place of what they are made of.
template <class R>
struct WeighContacts {
  using T = Scalar<R>;
  static constexpr int kWidth = Traits<R>::kWidth;
  ContactPairs<T> pairs;
  const Place<T>* velocity;  // extra: how the particle responds to all contacts of its strand
  const Place<T>* held;      // normals of the planes that particles lie in, or 0; null: in none
  T friction;

  RINGLET_FUNCTION void operator()(std::int32_t pack) const {
    const std::int32_t first = pack * kWidth;
    bool any_active = false;
    for (int lane = 0; lane < kWidth; ++lane) any_active = any_active || pairs.active[first + lane];
    if (!any_active) return;
    T *on_place = &pairs.record[first].on_place.x, *on_velocity = &pairs.record[first].on_velocity.x;
    const Quad<R> place = load_quads<R>(on_place, 2), way = load_quads<R>(on_velocity, 2);
    const R s = place.w, u = way.w, gap = load_quads<R>(&pairs.touch[first].s, 1).z;
    const Vector3<R> normal = vector_of(place), slip = vector_of(way);
    const GatheredSegment<R> a = gather_segment<R>(velocity, pairs.a + first),
                             b = gather_segment<R>(velocity, pairs.b + first);
    const R free = a.extra_at(s) + b.extra_at(u), across_mass = inverse_or_zero(free, R(T(1e-6)));
    ContactMass<R> mass{across_mass, across_mass};
    if (held) {
      const R left = held_response(held, pairs.a + first, s, a, normal) +
                     held_response(held, pairs.b + first, u, b, R(T(-1)) * normal);
      const R least = R(T(kSqueezed)) * free, most = max(left, least);
      mass.along = left * inverse_or_zero(most * most, R(T(1e-12)));
    }
    const Vector3<R> speed = a.places.at(s) - b.places.at(u);
    const R mu(friction);
    const Vector3<R> moves = contact_impulse(normal, -gap, R(T(kRelaxation)), slip, mu, mass),
                     turns =
                         contact_impulse(normal, -dot(normal, speed), R(1), across(normal, speed), mu, mass);
    store_quads<R>(on_place, 2, {moves.x, moves.y, moves.z, s});
    store_quads<R>(on_velocity, 2, {turns.x, turns.y, turns.z, u});
  }
};

// The pairs of each segment: [first[segment], first[segment + 1]) of `entry`, which holds a pair's number
// and, in its lowest bit, whether the segment is its b. Some more are set, to look ahead.
struct ContactLists {
  static constexpr std::int32_t kPadding = 16;
  const std::int32_t* first;
  const std::int32_t* entry;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
