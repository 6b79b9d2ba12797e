// What a run hands on: its header, and frames as the scene's cache asks for them.
#pragma once
#include <span>

#include "pipeline/world.h"
#include "state/frame.h"
#include "state/strand_model.h"

namespace ringlet::pipeline {

// Whether the scene's cache is to have this field.
bool asks_for(const scene::Scene& scene, const char* field);

// Everything but the machine and the range of frames.
state::RunHeader make_header(const scene::Scene& scene, const World& world);

// Frame `number`, at `time` [s], without the solver's figures; `step`: the substep that led there [s]. Of
// strands that are shorter than there is room for, the particles beyond the tip lie on it.
template <class T>
state::Frame make_frame(const scene::Scene& scene, const World& world, const state::StrandModel<T>& model,
                        const state::StrandState<T>& state, int number, double time, double step);

// The same of strands that something else than a strand model places: [particles] in the world [m], [m/s].
state::Frame make_frame(const scene::Scene& scene, const World& world, std::span<const Vec3> positions,
                        std::span<const Vec3> velocities, int number, double time);

// The strand of the cache that a simulated one is.
std::int64_t strand_in_cache(const World& world, std::int64_t simulated);

}  // namespace ringlet::pipeline
