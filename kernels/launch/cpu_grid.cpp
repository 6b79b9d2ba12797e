// The grid for one instruction set: compiled once for each, with RINGLET_ISA naming it
// (kernels/CMakeLists.txt).
#include "kernels/backend/host.h"
#include "kernels/grid/grid_solver.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

HairGrid<float>* new_float_grid(HostThreads threads) { return new GridSolver<Host, float>(threads); }
HairGrid<double>* new_double_grid(HostThreads threads) { return new GridSolver<Host, double>(threads); }

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
