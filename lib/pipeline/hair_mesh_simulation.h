// A scene of the model `hair_mesh`: hair meshes are stepped, their strands follow once a frame.
#pragma once
#include <memory>

#include "pipeline/simulation.h"

namespace ringlet::pipeline {

// Reads every asset and allocates. Throws Error{kInput}, Error{kDevice} for CUDA: the model steps on the CPU.
std::unique_ptr<Simulation> make_hair_mesh_simulation(const scene::Scene& scene, const Options& options);

}  // namespace ringlet::pipeline
