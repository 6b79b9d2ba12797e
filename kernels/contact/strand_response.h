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
#include "kernels/backend/words.h"
#include "kernels/contact/contact_passes.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr int kLoads = 7;

// What contacts do to a particle: shares, impulses on its place and on its velocity. Then what moves it.
struct ParticleLoad {
  double value[kLoads];
  double carry;  // of the elimination
};

template <class T>
struct ContactStrands {
  ContactPairs<T> pairs;
  ContactLists lists;
  const std::int32_t* first_particle;  // [strands + 1]
  const Place<T>* start;               // extra: freedom
  Place<T>*end, *velocity;
  ParticleLoad* load;  // [particles]
  double* kappa;       // [strands], negative where nothing touches
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

  // d = A^-1 f in place, components [kBegin, kEnd) of the loads: Thomas algorithm.
  template <int kBegin, int kEnd>
  RINGLET_FUNCTION void respond(std::int32_t strand, double kappa_here) const {
    const std::int32_t n = particles(strand);
    ParticleLoad* at = load + first(strand);
    double carry = 0;
    for (std::int32_t i = 0; i < n; ++i) {
      ParticleLoad& here = at[i];
      if (i < clamped) {
        for (int k = kBegin; k < kEnd; ++k) here.value[k] = 0;
        here.carry = 0;
        continue;
      }
      const double links = (i > 0 ? 1 : 0) + (i + 1 < n ? 1 : 0);
      const double inverse = 1 / (1 + kappa_here * (links - carry));
      for (int k = kBegin; k < kEnd; ++k) {
        const double before = i > 0 ? at[i - 1].value[k] : 0;
        here.value[k] = (here.value[k] + kappa_here * before) * inverse;
      }
      carry = here.carry = kappa_here * inverse;
    }
    for (std::int32_t i = n - 2; i >= clamped; --i)
      for (int k = kBegin; k < kEnd; ++k) at[i].value[k] += at[i].carry * at[i + 1].value[k];
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
          const double share = summable(second ? touch.y : touch.x);
          here += 1 - share, carried += share, touched = true;
          depth = -touch.z > depth ? -touch.z : depth;
        });
        length += kernels::length(vector_of(strands.start[p + 1]) - vector_of(strands.start[p]));
      }
      strands.load[p].value[0] = here;
    }
    strands.kappa[strand] = -1;
    if (!touched) return;
    const double reach = kReach * depth * (n - 1) / max(length, 1e-9);
    const double kappa = reach * reach;
    strands.kappa[strand] = kappa;
    strands.template respond<0, 1>(strand, kappa);
    for (std::int32_t i = 0, p = first; i < n; ++i, ++p)
      strands.velocity[p].extra = static_cast<T>(strands.load[p].value[0]);
  }
};

template <class T>
struct ApplyContacts {
  ContactStrands<T> strands;

  RINGLET_FUNCTION void operator()(std::int32_t strand) const {
    if (strands.kappa[strand] < 0) return;
    const std::int32_t n = strands.particles(strand), first = strands.first(strand);
    for (int k = 0; k < kLoads; ++k) strands.load[first].value[k] = 0;
    for (std::int32_t i = 0, p = first; i + 1 < n; ++i, ++p) {
      ParticleLoad &begin = strands.load[p], &finish = strands.load[p + 1];
      for (int k = 0; k < kLoads; ++k) finish.value[k] = 0;
      strands.for_contacts(p, strands.pairs.record, [&](const ContactRecord<T>& record, bool second) {
        const double share = second ? record.on_velocity.extra : record.on_place.extra,
                     sign = second ? -1 : 1;
        for (int c = 0; c < 3; ++c) {
          split(sign * (&record.on_place.x)[c], share, begin.value[1 + c], finish.value[1 + c]);
          split(sign * (&record.on_velocity.x)[c], share, begin.value[4 + c], finish.value[4 + c]);
        }
      });
    }
    strands.template respond<1, kLoads>(strand, strands.kappa[strand]);
    for (std::int32_t i = strands.clamped, p = first + i; i < n; ++i, ++p) {
      move(strands.end[p], strands.load[p].value + 1), move(strands.velocity[p], strands.load[p].value + 4);
    }
  }

 private:
  // Both parts together are what the other segment has, but for the sign.
  RINGLET_KERNEL static void split(double impulse, double share, double& begin, double& finish) {
    const double part = summable(share * impulse);
    finish += part, begin += summable(impulse) - part;
  }
  RINGLET_KERNEL static void move(Place<T>& place, const double* by) {
    place.x = static_cast<T>(place.x + by[0]), place.y = static_cast<T>(place.y + by[1]),
    place.z = static_cast<T>(place.z + by[2]);
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
