// Makes the solver of a hair mesh for an instruction set.
#pragma once
#include <memory>
#include <vector>

#include "kernels/hairmesh/hair_mesh_elements.h"
#include "kernels/hairmesh/hair_mesh_solver.h"
#include "kernels/hairmesh/hair_mesh_topology.h"
#include "kernels/launch/launch.h"

namespace ringlet::kernels {

// For T = float or double, at rest: `rest` holds [vertices][3] positions [m], numbered as by the topology.
// The mesh has to be sound (see HairMeshModel).
template <class T>
std::unique_ptr<HairMeshSolver<T>> make_hair_mesh_solver(InstructionSet set, const HairMeshTopology& topology,
                                                         const std::vector<double>& rest,
                                                         const HairMeshParameters& parameters);

}  // namespace ringlet::kernels
