// Whether the grid's pressure solver converges as theory says: a known solution on ever finer grids.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "study/axis.h"

namespace ringlet::study {

// The order that theory gives for the seven-point operator, in the width of a cell.
inline constexpr int kPressureOrder = 2;
// Cells along the radius of the ball that manufactured_pressure.h describes.
inline constexpr int kPressureEdges[] = {8, 16, 32, 64};
// The relative residual to solve to: under it what the solve leaves is no part of the error.
inline constexpr double kPressureResidual = 1e-10;

// What was measured on one grid. Errors are in the cells' middles, over the largest pressure [-].
struct PressureLevel {
  int edge = 0;
  std::int64_t cells = 0;
  double rms = 0, largest = 0;
  int iterations = 0;
  double residual = 0;  // relative, left
};

// In double precision on the CPU, with the machine's threads and instruction set. `residual`: relative, to
// solve to.
PressureLevel pressure_level(int edge, double residual, const Machine& machine);

// The orders by which an error fell from each level to the next.
struct PressureOrders {
  std::vector<double> rms, largest;  // one fewer than levels
};
PressureOrders pressure_orders(const std::vector<PressureLevel>& levels);

}  // namespace ringlet::study
