// Hair against solids: level sets, friction, push-out, in turn with lengths.
#pragma once
#include <memory>
#include <vector>

#include "effects/stage.h"
#include "scene/scene_desc.h"
#include "solids/solid.h"

namespace ringlet::effects {

// `collides` holds 1 for each strand that solids act on. The rest must outlive the stage.
template <class T>
std::unique_ptr<Stage<T>> make_contact_stage(const scene::Scene& scene, std::vector<solids::Solid>& solids,
                                             const std::vector<unsigned char>& collides,
                                             const state::StrandModel<T>& model,
                                             state::StrandState<T>& state);

}  // namespace ringlet::effects
