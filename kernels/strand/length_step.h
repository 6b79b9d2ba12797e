// Lengths after a step of another kind has moved particles (the grid, hair against hair): the projection of
// length_projection.h by itself, for strands that are where they are.
#pragma once
#include "kernels/strand/length_projection.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {

// Written for each strand, [batches][kLengthFigures]: largest edge strain left [-], Newton iterations,
// largest speed [m/s], 1 where the strand is beyond the limits or not finite.
enum LengthFigure { kLengthStrain, kLengthIterations, kLengthSpeed, kLengthDiverged, kLengthFigures };

template <class T>
struct LengthStep {
  StrandBatches<T> batches;
  StrandState<T> state;
  T step;                   // [s] that the displacements took: velocities change by displacement / step
  std::int32_t clamped;     // prescribed particles at the root
  std::int32_t iterations;  // most Newton iterations; 0: lengths are looked at and left
  T tolerance;              // largest edge strain left [-]; a strand within it stays as it is, bit for bit
  T* figures;
  T strain_limit, speed_limit;  // [-], [m/s]
};

inline namespace RINGLET_ISA {

// Scratch of one pack: per particle position, velocity and the projection's.
inline constexpr int kLengthReals = 3 + 3 + kProjectionReals;

// The lengths of one pack of strands: `lane` is its first lane in the batch. `scratch` holds kLengthReals
// values a particle, `stride` apart.
template <class R>
RINGLET_KERNEL void hold_lengths(const LengthStep<Scalar<R>>& step, int batch, int lane, Scalar<R>* scratch,
                                 int stride) {
  using T = Scalar<R>;
  const std::int64_t row = step.batches.row[batch];
  const int particles = step.batches.row[batch + 1] - static_cast<int>(row);
  const std::int64_t base = row * 3 * kLanes + lane;
  T *x = step.state.position + base, *v = step.state.velocity + base;
  T *position = scratch, *velocity = scratch + 3 * particles * stride;
  for (int k = 0; k < 3 * particles; ++k) {
    store(position + k * stride, load<R>(x + k * kLanes));
    store(velocity + k * stride, load<R>(v + k * kLanes));
  }
  const R count = load<R>(step.batches.count + batch * kLanes + lane);
  const ProjectedStrand<R> lengths{position,
                                   velocity,
                                   R(T(1) / step.step),
                                   step.batches.rest_length + base,
                                   kLanes,
                                   nullptr,
                                   velocity + 3 * particles * stride,
                                   stride,
                                   particles,
                                   count,
                                   step.clamped};
  const Mask<R> there = count > R(0);
  const ProjectionResult<R> result = project_lengths(lengths, R(step.tolerance), step.iterations, there);

  R speed2 = R(0), check = R(0);  // `check` turns NaN where anything is not finite
  for (int i = 0; i < particles; ++i) {
    const Vector3<R> here = load3<R>(position + 3 * i * stride, stride),
                     speed = load3<R>(velocity + 3 * i * stride, stride);
    store3<R>(x + 3 * i * kLanes, kLanes, here);
    store3<R>(v + 3 * i * kLanes, kLanes, speed);
    speed2 = max(speed2, dot(speed, speed));
    check = fma(R(0), dot(speed, speed) + dot(here, here), check);
  }
  const R whole = speed2 + check;
  const Mask<R> healthy =
      (result.strain <= R(step.strain_limit)) & (whole <= R(step.speed_limit * step.speed_limit));
  T* figures = step.figures + static_cast<std::int64_t>(batch) * kLengthFigures * kLanes + lane;
  store(figures + kLengthStrain * kLanes, result.strain);
  store(figures + kLengthIterations * kLanes, result.iterations);
  store(figures + kLengthSpeed * kLanes, sqrt(whole));
  store(figures + kLengthDiverged * kLanes, select(there & !healthy, R(1), R(0)));
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
