// Strands under the impulses of their contacts.
//
// A strand gives way as a whole: what moves one of its particles takes the neighbours along, over a length
// that grows with how far it is moved, or it would tear the strand. Impulses f on unit masses move the
// particles by d = A^-1 f,
//
//   A d = d - kappa d'',   kappa = (kReach depth / l)^2
//
// d'' the second difference along the strand (free at the tip, nothing at prescribed particles), l its mean
// segment length, depth the farthest that one of its contacts is to be moved. A leaves sums as they are, so
// momentum is kept but for what goes into prescribed particles; its eigenvalues are 1 and more, so no impulse
// moves more mass than there is, and none makes energy.
//
// All contacts are answered at once. For that to overshoot nowhere each counts, in the place of the inverse
// mass that it would meet alone, the sum of what all contacts of the strand would do at its place: with c the
// contacts' shares c_i summed at each particle, the interpolation of A^-1 c. (The diagonal of a matrix that
// exceeds its rows' sums exceeds the matrix; without A this is mass splitting: Tonge, Benevolenski,
// Voroshilov 2012.)
#pragma once
#include "kernels/backend/pack.h"
#include "kernels/backend/words.h"
#include "kernels/contact/contact_passes.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// What contacts do to a particle, in three lanes, then what moves it: kPlace and kVelocity of each.
using ParticleLoad = Pack<double, 4>;
enum { kPlace, kVelocity, kLoads };

// What eliminating the particles before it leaves of a particle's row of A.
struct Elimination {
  double inverse, carry;
};

template <class T>
struct ContactStrands {
  ContactPairs<T> pairs;
  ContactLists lists;
  const std::int32_t* first_particle;  // [strands + 1]
  const Place<T>* start;               // extra: freedom
  Place<T>*end, *velocity;
  double* kappa;             // [strands], negative where nothing touches
  double* share;             // [particles] of contacts, then how it would respond to them
  Elimination* elimination;  // [particles]
  ParticleLoad* load;        // [particles][kLoads]
  std::int32_t clamped;

  RINGLET_KERNEL std::int32_t first(std::int32_t strand) const { return first_particle[strand]; }
  RINGLET_KERNEL std::int32_t particles(std::int32_t strand) const {
    return first_particle[strand + 1] - first_particle[strand];
  }

  // Calls visit(what `known` tells of the pair, whether the segment is its b).
  template <class Known, class Visit>
  RINGLET_KERNEL void for_contacts(std::int32_t segment, const Known* known, const Visit& visit) const {
    for (std::int32_t k = lists.first[segment]; k < lists.first[segment + 1]; ++k) {
      const std::int32_t entry = lists.entry[k], pair = entry >> 1;
      // Pairs lie about in memory, as the segments' partners do.
      prefetch(&known[lists.entry[k + lists.kPadding] >> 1]);
      if (pairs.active[pair]) visit(known[pair], (entry & 1) != 0);
    }
  }

  // Thomas algorithm: A's elimination once, then d = A^-1 f in place for the values of a strand's particles.
  RINGLET_FUNCTION void eliminate(std::int32_t strand) const {
    const std::int32_t n = particles(strand);
    const double kappa_here = kappa[strand];
    Elimination* at = elimination + first(strand);
    double carry = 0;
    for (std::int32_t i = clamped; i < n; ++i) {
      const double links = (i > 0 ? 1 : 0) + (i + 1 < n ? 1 : 0);
      const double inverse = 1 / (1 + kappa_here * (links - carry));
      carry = kappa_here * inverse;
      at[i] = {inverse, carry};
    }
  }
  // Of particles that are not prescribed, [particles][kEach].
  template <int kEach, class V>
  RINGLET_FUNCTION void respond(std::int32_t strand, V* values) const {
    const std::int32_t n = particles(strand);
    const V kappa_here(kappa[strand]);
    const Elimination* at = elimination + first(strand);
    V* value = values + static_cast<std::int64_t>(first(strand)) * kEach;
    V before[kEach];
    for (V& none : before) none = V(0.0);
    for (std::int32_t i = clamped; i < n; ++i)
      for (int k = 0; k < kEach; ++k)
        value[i * kEach + k] = before[k] = (value[i * kEach + k] + kappa_here * before[k]) * V(at[i].inverse);
    for (std::int32_t i = n - 2; i >= clamped; --i)
      for (int k = 0; k < kEach; ++k)
        value[i * kEach + k] = before[k] = value[i * kEach + k] + V(at[i].carry) * before[k];
  }
};

// How each contact's place would respond to all contacts of the strand, into velocity.extra.
template <class T>
struct FindResponse {
  ContactStrands<T> strands;
  static constexpr double kReach = 2;  // of a displacement along the strand, in its own size

  RINGLET_FUNCTION void operator()(std::int32_t strand) const {
    const std::int32_t n = strands.particles(strand), first = strands.first(strand);
    double depth = 0, length = 0;
    bool touched = false;
    double carried = 0;
    for (std::int32_t i = 0, p = first; i < n; ++i, ++p) {
      double here = carried;
      carried = 0;
      if (i + 1 < n) {
        strands.for_contacts(p, strands.pairs.touch, [&](const Touch<T>& touch, bool second) {
          const double share = summable(static_cast<double>(second ? touch.u : touch.s));
          here += 1 - share, carried += share, touched = true;
          depth = -touch.gap > depth ? -touch.gap : depth;
        });
        length += kernels::length(vector_of(strands.start[p + 1]) - vector_of(strands.start[p]));
      }
      strands.share[p] = here;
    }
    strands.kappa[strand] = -1;
    if (!touched) return;
    const double reach = kReach * depth * (n - 1) / max(length, 1e-9);
    strands.kappa[strand] = reach * reach;
    strands.eliminate(strand);
    strands.template respond<1>(strand, strands.share);
    for (std::int32_t p = first + strands.clamped; p < first + n; ++p)
      strands.velocity[p].extra = static_cast<T>(strands.share[p]);
  }
};

template <class T>
struct ApplyContacts {
  ContactStrands<T> strands;

  RINGLET_FUNCTION void operator()(std::int32_t strand) const {
    if (strands.kappa[strand] < 0) return;
    const std::int32_t n = strands.particles(strand), first = strands.first(strand);
    ParticleLoad begin[kLoads] = {0.0, 0.0};
    for (std::int32_t p = first; p < first + n; ++p) {
      ParticleLoad finish[kLoads] = {0.0, 0.0};
      if (p + 1 < first + n)
        strands.for_contacts(p, strands.pairs.record, [&](const ContactRecord<T>& record, bool second) {
          const double share = second ? record.on_velocity.extra : record.on_place.extra,
                       sign = second ? -1 : 1;
          split(record.on_place, sign, share, begin[kPlace], finish[kPlace]);
          split(record.on_velocity, sign, share, begin[kVelocity], finish[kVelocity]);
        });
      for (int k = 0; k < kLoads; ++k) strands.load[p * kLoads + k] = begin[k], begin[k] = finish[k];
    }
    strands.template respond<kLoads>(strand, strands.load);
    for (std::int32_t p = first + strands.clamped; p < first + n; ++p) {
      move(strands.end[p], strands.load[p * kLoads + kPlace]);
      move(strands.velocity[p], strands.load[p * kLoads + kVelocity]);
    }
  }

 private:
  // Both parts together are what the other segment has, but for the sign.
  RINGLET_KERNEL static void split(const Place<T>& impulse, double sign, double share, ParticleLoad& begin,
                                   ParticleLoad& finish) {
    const ParticleLoad whole = ParticleLoad(sign) * in_double(impulse),
                       part = summable(ParticleLoad(share) * whole);
    finish = finish + part, begin = begin + (summable(whole) - part);
  }
  RINGLET_KERNEL static ParticleLoad in_double(const Place<T>& place) {
    return __builtin_convertvector(Pack<T, 4>::load(&place.x).v, ParticleLoad::Vector);
  }
  RINGLET_KERNEL static void move(Place<T>& place, const ParticleLoad& by) {
    place.x = static_cast<T>(place.x + by.v[0]), place.y = static_cast<T>(place.y + by.v[1]),
    place.z = static_cast<T>(place.z + by.v[2]);
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
