// The units that a groom's file is read in. Private to the room.
#pragma once
#include <string>

#include "scene/scene_desc.h"

namespace ringlet::groom {

// The scene's word on this file (`asked`) goes before the file's own (`declared`), the file's before the
// scene's default. The choice is logged under `file`.
scene::Units file_units(const std::string& file, const scene::UnitsOverride& asked,
                        const scene::UnitsOverride& declared, const scene::Units& scene_units);

}  // namespace ringlet::groom
