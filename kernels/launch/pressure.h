// The grid's pressure alone, for an instruction set.
#pragma once
#include "kernels/backend/host.h"
#include "kernels/grid/pressure_problem.h"
#include "kernels/launch/launch.h"

namespace ringlet::kernels {

// Solves a problem as the grid solves its own, for T = float or double, on the CPU. `residual`: relative, at
// which it stops; the figures tell what was left where `most_iterations` did not lead there. `pressure`:
// [cells], the answer.
template <class T>
PressureFigures solve_pressure(InstructionSet set, HostThreads threads, const PressureProblem<T>& problem,
                               double residual, int most_iterations, double* pressure);

}  // namespace ringlet::kernels
