// The air at every segment, which the strand step then lets drag on it.
#pragma once
#include <memory>

#include "effects/stage.h"
#include "scene/scene_desc.h"
#include "solids/mesh.h"

namespace ringlet::effects {

// For a scene with wind. Makes `state.air`, and writes `state.wind`. `head`, null without one, gives shelter
// where the scene asks for it; `origin` is a point near the hair [m]. All references must outlive the stage.
template <class T>
std::unique_ptr<Stage<T>> make_wind_stage(const scene::Scene& scene, const solids::AnimatedMesh* head,
                                          const Vec3& origin, const state::StrandModel<T>& model,
                                          state::StrandState<T>& state);

}  // namespace ringlet::effects
