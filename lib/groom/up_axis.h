// Turning between up axes.
#pragma once
#include "core/geometry.h"
#include "scene/scene_desc.h"

namespace ringlet::groom {

// The shortest rotation that takes axis `from` to axis `to`: a quarter turn about the third axis, exact in
// floating point. y to z gives (x, y, z) -> (x, -z, y), as exchanging files with a z-up program does.
Mat3 up_rotation(scene::Axis from, scene::Axis to);

}  // namespace ringlet::groom
