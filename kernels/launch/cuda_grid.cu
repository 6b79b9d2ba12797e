#include "kernels/launch/cuda_grid.h"

#include "kernels/backend/cuda.h"
#include "kernels/grid/grid_solver.h"

namespace ringlet::kernels {

std::unique_ptr<HairGrid<float>> make_cuda_grid(CudaStream& stream) {
  return std::make_unique<GridSolver<Cuda, float>>(&stream);
}

}  // namespace ringlet::kernels
