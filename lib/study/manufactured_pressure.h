// A problem of the grid's pressure whose solution is known.
//
// With r the distance from the origin, in the octant x, y, z > 0 of the unit ball,
//
//   -div(k grad p) = f
//   p = (1 - r^2) (3 + cos 3x + cos 2y cos 4z),   k = 1 + sin(2x + y) / 2
//
// f follows from these by hand. The planes are walls, which p meets at right angles; in the cells beyond the
// sphere, where the hair would have air, p is what its formula says there. The cells of the ball fill some of
// the lattice's tiles, and tiles at its rim in part.
#pragma once
#include <cstdint>
#include <vector>

#include "kernels/grid/pressure_problem.h"

namespace ringlet::study {

template <class T>
class ManufacturedPressure {
 public:
  // `edge`: cells along the ball's radius, a power of two from 4 to 256.
  explicit ManufacturedPressure(int edge);

  // Holds as long as this lives.
  kernels::PressureProblem<T> problem() const {
    return {cells(), key_.data(), neighbour_.data(), face_.data(), open_.data(), right_.data()};
  }
  std::int32_t cells() const { return static_cast<std::int32_t>(key_.size()); }
  const std::vector<double>& exact() const { return exact_; }  // [cells] p in their middles

 private:
  void add_cell(std::int32_t cell, const std::vector<std::int32_t>& number);

  int edge_;
  std::vector<std::uint64_t> key_;
  std::vector<std::int32_t> neighbour_;
  std::vector<T> face_, open_, right_;
  std::vector<double> exact_;
};

}  // namespace ringlet::study
