// The grid of hair against hair as the program calls it, whatever it was compiled for.
#pragma once
#include <cstddef>

#include "kernels/grid/grid_step.h"

namespace ringlet::kernels {

template <class T>
class HairGrid {
 public:
  virtual ~HairGrid();
  // Takes the strands' numbers and their densities at rest from a state that is posed at rest.
  virtual void at_rest(const GridStep<T>& step) = 0;
  // Velocities, and positions of hair that is too dense, become what the pressure leaves.
  virtual GridFigures run(const GridStep<T>& step) = 0;
  // How much of the wind gets through the hair as the last run found it.
  virtual void shelter(const HairShelter<T>& shelter) = 0;
  virtual std::size_t bytes() const = 0;
};

}  // namespace ringlet::kernels
