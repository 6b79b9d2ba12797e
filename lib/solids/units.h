// What one unit of an asset's file is, and which way is up in it.
#pragma once
#include <filesystem>
#include <optional>

#include "core/geometry.h"
#include "scene/scene_desc.h"

namespace ringlet::solids {

// What a file says of itself; empty where it is silent.
using DeclaredUnits = scene::UnitsOverride;

// Turns one up axis into another by the quarter turns of the COLLADA specification: y to z about x, x to y
// about z.
Mat3 axis_rotation(scene::Axis from, scene::Axis to);

// Scene metres and axes from the file's numbers: the scene's override wins, else what the file declares, else
// the scene's own units. The choice is logged.
Mat3 file_to_scene(const std::filesystem::path& file, const DeclaredUnits& declared,
                   const scene::UnitsOverride& wanted, const scene::Units& scene_units);

}  // namespace ringlet::solids
