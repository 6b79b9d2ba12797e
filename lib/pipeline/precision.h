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
// root, round by 2^-24 of the strand's length, as measured on strands of 34 to 500 particles with segments of
// one length. What is finer is never met, and strands would take ever more substeps for it.
inline constexpr double kFinestStrainInFloat = 8e-8;

// Holds lengths no finer than float tells them, and warns where effects.inextensible asks for that.
// `particles`: of the strand that has most.
void hold_lengths_as_float_can(scene::Scene& scene, std::int32_t particles);

}  // namespace ringlet::pipeline
