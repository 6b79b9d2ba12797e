// The air at every segment of the strands: a mean wind, turbulence, and shelter behind the head.
//
// Turbulence is curl noise, the curl of a potential of random sines (Bridson et al. 2007; the spectrum after
// Kraichnan 1970). With wave vectors k_n and amplitudes a_n = k_n x c_n,
//
//   u(x) = sum_n a_n sin(2 pi (k_n . x + phi_n))
//
// Every term is divergence-free by itself, so the sum is exactly. The mean wind carries the pattern along
// (Taylor's hypothesis): the phases hold the way of the air so far.
#pragma once
#include "kernels/backend/vector.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {

inline constexpr int kMostModes = 48;

template <class T>
struct WindField {
  T mean[3];  // [m/s]
  std::int32_t modes;
  T wave[kMostModes][3];       // k_n [1/m], in turns
  T amplitude[kMostModes][3];  // a_n [m/s]
  T phase[kMostModes];         // phi_n now [turns]
  double origin[3];            // that waves are counted from, near the hair: keeps k_n . x precise [m]
};

template <class T>
struct WindStep {
  StrandBatches<T> batches;
  const T* position;          // [rows][3] as StrandState
  const double* root_points;  // [batches][3] in the world [m]
  WindField<T> field;
  const T* exposure;  // [rows] share of the wind that reaches the segment that begins there; null: all
  T* air;             // [rows][3] out: velocity of the air in the middle of that segment [m/s]
  const T* shelter = nullptr;  // [rows] share that hair before it lets through, as exposure; null: all
};

inline namespace RINGLET_ISA {

// x less its nearest integer, for |x| up to 2^22 in float and 2^51 in double.
template <class R>
RINGLET_KERNEL R fraction(R x) {
  constexpr bool kDouble = sizeof(Scalar<R>) == 8;
  const R big = R(Scalar<R>(kDouble ? 6755399441055744.0 : 12582912.0));  // 1.5 * 2^52, 1.5 * 2^23
  return x - ((x + big) - big);
}

// sin(2 pi x): absolute error under 3e-7 in float, 1e-13 in double, beside the rounding of x.
template <class R>
RINGLET_KERNEL R sine_of_turns(R x) {
  constexpr int kTerms = sizeof(Scalar<R>) == 8 ? 9 : 6;  // of Taylor's series of sin(2 pi y) / y in y^2
  constexpr double kSine[] = {6.283185307179586,  -41.341702240399755, 81.60524927607504,
                              -76.70585975306136, 42.058693944897634,  -15.094642576822984,
                              3.8199525848482803, -0.7181223017785001, 0.1042291622081394};
  const R f = fraction(x), quarter = R(Scalar<R>(0.25));
  const R folded = quarter - abs(abs(f) - quarter);  // in [0, 1/4], of the same sine but for the sign
  const R y = select(f < R(0), -folded, folded), y2 = y * y;
  R sum = R(Scalar<R>(kSine[kTerms - 1]));
  RINGLET_UNROLL
  for (int k = kTerms - 2; k >= 0; --k) sum = fma(y2, sum, R(Scalar<R>(kSine[k])));
  return y * sum;
}

template <class R>
RINGLET_KERNEL Vector3<R> air_velocity(const WindField<Scalar<R>>& field, Vector3<R> x) {
  Vector3<R> u = {R(field.mean[0]), R(field.mean[1]), R(field.mean[2])};
  for (int n = 0; n < field.modes; ++n) {
    const Scalar<R>*k = field.wave[n], *a = field.amplitude[n];
    const R turns = fma(R(k[2]), x.z, fma(R(k[1]), x.y, fma(R(k[0]), x.x, R(field.phase[n]))));
    u = fma(sine_of_turns(turns), Vector3<R>{R(a[0]), R(a[1]), R(a[2])}, u);
  }
  return u;
}

// The air at the segments of one pack of strands.
template <class R>
RINGLET_KERNEL void blow(const WindStep<Scalar<R>>& step, int batch, int lane) {
  using T = Scalar<R>;
  const std::int64_t row = step.batches.row[batch];
  const int particles = step.batches.row[batch + 1] - static_cast<int>(row);
  const std::int64_t base = row * 3 * kLanes + lane;
  constexpr int kWidth = Traits<R>::kWidth;
  alignas(64) T root[3 * kWidth];  // relative to the waves' origin
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < kWidth; ++k)
      root[c * kWidth + k] =
          static_cast<T>(step.root_points[(batch * 3 + c) * kLanes + lane + k] - step.field.origin[c]);
  const Vector3<R> origin = load3<R>(root, kWidth);
  Vector3<R> here = load3<R>(step.position + base, kLanes);
  for (int i = 0; i + 1 < particles; ++i) {
    const Vector3<R> next = load3<R>(step.position + base + 3 * (i + 1) * kLanes, kLanes);
    Vector3<R> u = air_velocity(step.field, origin + R(T(0.5)) * (here + next));
    if (step.exposure) u = load<R>(step.exposure + (row + i) * kLanes + lane) * u;
    if (step.shelter) u = load<R>(step.shelter + (row + i) * kLanes + lane) * u;
    store3<R>(step.air + base + 3 * i * kLanes, kLanes, u);
    here = next;
  }
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
