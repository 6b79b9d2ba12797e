// Hair keeps its volume: density, pressure and friction on a grid (physics.md section 5).
#pragma once
#include <memory>
#include <vector>

#include "effects/stage.h"
#include "scene/scene_desc.h"
#include "solids/solid.h"

namespace ringlet::effects {

// For a scene with a grid. Takes its target density from what `at_rest` shows it. With the grid's shelter it
// makes `state.shelter`, by the wind in `state.wind`; the model then has radii. All references but the
// executor must outlive the stage.
template <class T>
std::unique_ptr<Stage<T>> make_grid_stage(const scene::Scene& scene, std::vector<solids::Solid>& solids,
                                          const state::StrandModel<T>& model, state::StrandState<T>& state,
                                          Executor<T>& executor);

}  // namespace ringlet::effects
