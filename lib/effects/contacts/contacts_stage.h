// Hair against hair, segment by segment: contacts at the sum of radii, friction.
#pragma once
#include <memory>

#include "effects/stage.h"
#include "scene/scene_desc.h"

namespace ringlet::effects {

// For a scene with contacts of hair; the model has radii. All references must outlive the stage.
template <class T>
std::unique_ptr<Stage<T>> make_contacts_stage(const scene::Scene& scene, const state::StrandModel<T>& model,
                                              state::StrandState<T>& state, Executor<T>& executor);

}  // namespace ringlet::effects
