// The grid for one instruction set: compiled once for each, with RINGLET_ISA naming it
// (kernels/CMakeLists.txt).
#include "kernels/backend/host.h"
#include "kernels/grid/grid_solver.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

HairGrid<float>* new_float_grid(HostThreads threads) { return new GridSolver<Host, float>(threads); }
HairGrid<double>* new_double_grid(HostThreads threads) { return new GridSolver<Host, double>(threads); }

namespace {

template <class T>
PressureFigures solve_pressure(HostThreads threads, const PressureProblem<T>& problem, double residual,
                               int most_iterations, double* answer) {
  Host host(threads);
  Pressure<Host, T> pressure;
  pressure.set(host, problem);
  const PressureFigures figures = pressure.solve(host, residual, most_iterations);
  for (std::int32_t i = 0; i < problem.cells; ++i) answer[i] = pressure.pressure.data()[i];
  return figures;
}

}  // namespace

PressureFigures solve_float_pressure(HostThreads threads, const PressureProblem<float>& problem,
                                     double residual, int most_iterations, double* answer) {
  return solve_pressure(threads, problem, residual, most_iterations, answer);
}
PressureFigures solve_double_pressure(HostThreads threads, const PressureProblem<double>& problem,
                                      double residual, int most_iterations, double* answer) {
  return solve_pressure(threads, problem, residual, most_iterations, answer);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
