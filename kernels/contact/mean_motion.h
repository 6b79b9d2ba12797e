// The hair's motion at large: mean displacements on a lattice, smooth between its nodes.
//
// Locks of hair travel centimetres in a frame, neighbours against one another millimetres. Neighbours are
// looked for along what is left of a segment's way without the mean motion, so that hair that moves together
// costs no more than hair at rest. Sums are of whole numbers: in any order the same.
#pragma once
#include "kernels/contact/contact_data.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

struct MotionLattice {
  float low[3];    // first node [m]
  float per_cell;  // [1/m]
  std::int32_t nodes[3];

  RINGLET_KERNEL std::int32_t number(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return (z * nodes[1] + y) * nodes[0] + x;
  }
  RINGLET_KERNEL std::int32_t total() const { return nodes[0] * nodes[1] * nodes[2]; }
};

// Sums at one node.
struct MotionSum {
  long long displacement[3];  // in units of kMotionUnit
  long long count;
};
inline constexpr double kMotionUnit = 1.0 / (1LL << 32);  // [m]

struct MeanMotion {
  float mean[3];    // at a place [m]
  float spread[3];  // how much it changes over a metre, at most [-]
};

// Mean motion at a place near the hair.
RINGLET_KERNEL MeanMotion mean_motion(const MotionLattice& lattice, const MotionSum* sums, const float* at) {
  std::int32_t cell[3];
  float along[3];
  for (int c = 0; c < 3; ++c) {
    const float place = max((at[c] - lattice.low[c]) * lattice.per_cell, 0.0f);
    const std::int32_t last = lattice.nodes[c] - 2;
    cell[c] = place < static_cast<float>(last) ? static_cast<std::int32_t>(place) : last;
    along[c] = min(place - static_cast<float>(cell[c]), 1.0f);
  }
  float weights = 0, mean[3] = {}, low[3], high[3];
  for (int corner = 0; corner < 8; ++corner) {
    const int up[3] = {corner & 1, corner >> 1 & 1, corner >> 2};
    const MotionSum& sum = sums[lattice.number(cell[0] + up[0], cell[1] + up[1], cell[2] + up[2])];
    if (sum.count == 0) continue;
    float weight = 1e-6f;  // a corner's, and never nothing
    float product = 1;
    for (int c = 0; c < 3; ++c) product *= up[c] ? along[c] : 1 - along[c];
    weight += product;
    for (int c = 0; c < 3; ++c) {
      const float value = static_cast<float>(kMotionUnit * static_cast<double>(sum.displacement[c]) /
                                             static_cast<double>(sum.count));
      low[c] = weights == 0 ? value : min(low[c], value);
      high[c] = weights == 0 ? value : max(high[c], value);
      mean[c] = fma(weight, value, mean[c]);
    }
    weights += weight;
  }
  MeanMotion motion{};
  if (weights == 0) return motion;
  for (int c = 0; c < 3; ++c)
    motion.mean[c] = mean[c] / weights, motion.spread[c] = (high[c] - low[c]) * lattice.per_cell;
  return motion;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
