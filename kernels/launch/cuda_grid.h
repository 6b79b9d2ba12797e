// The grid of hair against hair on a CUDA stream, compiled apart from the strands' kernels.
#pragma once
#include <memory>

#include "kernels/grid/hair_grid.h"

namespace ringlet::kernels {

class CudaStream;

// All pointers that it is told are the device's. `stream` must outlive it.
std::unique_ptr<HairGrid<float>> make_cuda_grid(CudaStream& stream);

}  // namespace ringlet::kernels
