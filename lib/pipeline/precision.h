// What single precision cannot tell.
#pragma once
#include <span>

#include "scene/scene_desc.h"

namespace ringlet::pipeline {

// The stiffest coupling that strands may have in float [1/s^2]. Above it an implicit step weighs the springs,
// h^2 kappa, against the inertia 1 by more than float's 24 bits can: the inertia is lost in the pivots.
inline constexpr double kStiffestInFloat = 1e9;

// `scaled`: World::stiffness. Throws Error{kInput} for a stiffness above kStiffestInFloat.
void refuse_stiff_in_float(const scene::Scene& scene, std::span<const float> scaled);

}  // namespace ringlet::pipeline
