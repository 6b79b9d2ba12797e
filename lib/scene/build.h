// From scene JSON to plain structs.
#pragma once
#include <filesystem>

#include "scene/scene_desc.h"
#include "scene/schema.h"

namespace ringlet::scene {

// The structs of `document`: valid, filled in, its lengths in metres. `file` is the scene's, to which paths
// are relative. `resolved` and `hash` are left empty.
Scene build(const Json& document, const std::filesystem::path& file);

}  // namespace ringlet::scene
