// What the contacts of hair against hair are told, and what they tell.
#pragma once
#include <cstdint>

#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {

// What the last pass found, before it answered.
struct HairContactFigures {
  std::int64_t pairs = 0;      // of segments that passes look at
  std::int64_t contacts = 0;   // those that touch or have crossed
  std::int64_t crossings = 0;  // those that have crossed
  double depth = 0;            // largest overlap of those that have not [m]
};

// One application, over all that moved since the last.
template <class T>
struct HairContactStep {
  StrandBatches<T> batches;
  std::int32_t row_count;           // batches.row[batches.batches], which may be out of the host's reach
  StrandState<T> state;             // at the end; changed
  const T* start;                   // [rows][3] positions at the start, as `state` has them
  const double* start_root_points;  // [batches][3] [m]
  const double* root_points;        // [batches][3] at the end
  const T* radius;                  // [rows] of the hair at each particle [m]
  std::int32_t clamped;             // prescribed particles at each root
  T friction;                       // Coulomb mu [-]
};

}  // namespace ringlet::kernels
