// What single precision cannot tell.
#pragma once
#include <cstdint>
#include <span>

#include "scene/scene_desc.h"

namespace ringlet::pipeline {

// The stiffest coupling that strands may have in float [1/s^2]. Above it an implicit step weighs the springs,
// h^2 kappa, against the inertia 1 by more than float's 24 bits can: the inertia is lost in the pivots.
inline constexpr double kStiffestInFloat = 1e9;

// `scaled`: World::stiffness. Throws Error{kInput} for a stiffness above kStiffestInFloat.
void refuse_stiff_in_float(const scene::Scene& scene, std::span<const float> scaled);

// The strain that float tells a segment's length to, for each segment of its strand: positions, from the
// root, round by 2^-24 of the strand's length, as measured on strands of 34 to 500 particles. What is finer
// is never met, and strands would take ever more substeps for it.
inline constexpr double kFinestStrainInFloat = 8e-8;

// `particles`: of the longest strand. Throws Error{kInput} where effects.inextensible asks for finer lengths.
void refuse_fine_lengths_in_float(const scene::Scene& scene, std::int32_t particles);

}  // namespace ringlet::pipeline
