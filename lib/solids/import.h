// Reads mesh files by assimp: glTF and GLB, FBX, COLLADA, OBJ, PLY, STL.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "solids/rig.h"
#include "solids/units.h"

namespace ringlet::solids {

struct ImportedMesh {
  Rig rig;  // in the file's units and axes, vertices as the file has them (not welded)
  DeclaredUnits declared;
};

// `clip` names the animation to take ("" the first, none: no animation). Throws Error{kInput}: unreadable
// file, no triangles, non-finite vertices or keys, unknown clip (the known ones are named), a joint without a
// node.
ImportedMesh import_mesh(const std::filesystem::path& file, const std::optional<std::string>& clip);

}  // namespace ringlet::solids
