// Turning between up axes.
#pragma once
#include "core/geometry.h"
#include "scene/scene_desc.h"

namespace ringlet::groom {

// Turns axes with `from` up into axes with `to` up, exactly: x to y a quarter turn about z, y to z about x,
// the other pairs by way of y, so that turning twice is turning once. Heads are turned alike: a groom keeps
// to its head.
Mat3 up_rotation(scene::Axis from, scene::Axis to);

}  // namespace ringlet::groom
