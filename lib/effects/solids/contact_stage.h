// Hair against solids: level sets, friction, push-out, in turn with lengths.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "effects/stage.h"
#include "scene/scene_desc.h"
#include "solids/solid.h"

namespace ringlet::effects {

// What strands grow on among the solids, as kernels::ContactStep has it.
struct Skin {
  std::int32_t home = -1;               // index of the solid; -1: none
  std::vector<std::int32_t> triangles;  // [strands] of that solid, or a kernels::Skin
};

// All but `skin` must outlive the stage.
template <class T>
std::unique_ptr<Stage<T>> make_contact_stage(const scene::Scene& scene, std::vector<solids::Solid>& solids,
                                             const Skin& skin, const state::StrandModel<T>& model,
                                             state::StrandState<T>& state);

}  // namespace ringlet::effects
