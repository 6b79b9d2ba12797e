#include "study/pressure_order.h"

#include <algorithm>
#include <cmath>

#include "effects/host_threads.h"
#include "effects/instruction_set.h"
#include "kernels/launch/pressure.h"
#include "study/front.h"
#include "study/manufactured_pressure.h"
#include "study/threads.h"

namespace ringlet::study {

PressureLevel pressure_level(int edge, double residual, const Machine& machine) {
  constexpr int kMostIterations = 200;
  const Threads threads(machine.threads);
  const ManufacturedPressure<double> manufactured(edge);
  const auto n = static_cast<std::size_t>(manufactured.cells());
  std::vector<double> pressure(n);
  const kernels::PressureFigures told = kernels::solve_pressure(
      effects::choose_instruction_set(machine.options.instruction_set), effects::host_threads(),
      manufactured.problem(), residual, kMostIterations, pressure.data());
  PressureLevel level{edge, manufactured.cells(), 0, 0, told.iterations, told.residual};
  double squares = 0, most = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double exact = manufactured.exact()[i], error = std::abs(pressure[i] - exact);
    squares += error * error;
    level.largest = std::max(level.largest, error);
    most = std::max(most, exact);
  }
  level.rms = std::sqrt(squares / static_cast<double>(n)) / most, level.largest /= most;
  return level;
}

PressureOrders pressure_orders(const std::vector<PressureLevel>& levels) {
  std::vector<double> edges, rms, largest;
  for (const PressureLevel& level : levels)
    edges.push_back(level.edge), rms.push_back(level.rms), largest.push_back(level.largest);
  return {orders(edges, rms), orders(edges, largest)};
}

}  // namespace ringlet::study
