// What a groom is like, in figures.
#pragma once
#include <optional>

#include "groom/strands.h"

namespace ringlet::groom {

// Of a number of values; percentiles between two of them are interpolated.
struct Summary {
  double min, mean, median, percentile_99, max;
};

// In the strands' unit of length. Empty: there is nothing to measure.
struct Measures {
  std::optional<Summary> length;     // of strands
  std::optional<Summary> segment;    // lengths
  std::optional<Summary> curvature;  // the angle between neighbouring segments over their mean length [1/m]
  // Roots per area [1/m^2]: the median over the roots of what the circle up to the eighth nearest says. For
  // roots that lie at random as wide as the circle; a square grid reads 1.22 times its density.
  std::optional<double> root_density;  // empty for fewer than nine roots
};

Measures measure(const Strands& strands);

}  // namespace ringlet::groom
