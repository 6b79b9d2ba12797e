// Makes the grid of hair against hair for an instruction set.
#pragma once
#include <memory>

#include "kernels/backend/host.h"
#include "kernels/grid/hair_grid.h"
#include "kernels/launch/launch.h"

namespace ringlet::kernels {

// For T = float or double, on the CPU.
template <class T>
std::unique_ptr<HairGrid<T>> make_hair_grid(InstructionSet set, HostThreads threads);

}  // namespace ringlet::kernels
