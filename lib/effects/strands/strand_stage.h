// The strand step of either model: springs, ghosts of AMS, air, implicit solve, lengths.
#pragma once
#include <memory>

#include "effects/stage.h"
#include "scene/scene_desc.h"

namespace ringlet::effects {

// `model` and `state` must outlive the stage.
template <class T>
std::unique_ptr<Stage<T>> make_strand_stage(const scene::Scene& scene, const state::StrandModel<T>& model,
                                            state::StrandState<T>& state);

// The kernel's parameters for a scene, but for the step.
template <class T>
kernels::StrandParameters<T> strand_parameters(const scene::Scene& scene);

}  // namespace ringlet::effects
