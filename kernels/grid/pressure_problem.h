// A problem of the grid's pressure that its caller sets up cell by cell, and what a solve of one tells.
#pragma once
#include <cstdint>

#include "kernels/grid/lattice.h"

namespace ringlet::kernels {

struct PressureFigures {
  int iterations = 0;       // of conjugate gradients, over all sets
  int sets = 0;             // that were solved on
  double residual = 0;      // relative, left
  bool compressed = false;  // there was something to do
};

// The p of pressure.h on any cells of a lattice.
template <class T>
struct PressureProblem {
  std::int32_t cells;
  const std::uint64_t* key;       // [cells] Morton keys, ascending
  const std::int32_t* neighbour;  // [kDirections][cells], the cell itself where there is none
  const T* face;                  // [kDirections][cells] c_f to that neighbour, 0 where there is none
  const T* open;                  // [cells] the sum of c_f over all faces, those to the outside as well
  const T* right;                 // [cells] b
};

}  // namespace ringlet::kernels
