// The two forms of a hair mesh in a file. Private to the room: the way in is hair_mesh.h.
#pragma once
#include <string>
#include <string_view>

#include "groom/hair_mesh.h"

namespace ringlet::groom {

// A hair mesh as the file has it: lengths in its own unit, axes its own; not checked but for its form.
struct FileHairMesh {
  HairMesh mesh;
  scene::UnitsOverride declared;
};

// `name` is the file's, for messages. Throw Error{kInput}: at NAME:LINE:COLUMN where the JSON is broken,
// NAME#POINTER where it says something else than a hair mesh, NAME:LINE in an OBJ.
FileHairMesh parse_hair_mesh_json(std::string_view text, const std::string& name);
FileHairMesh parse_hair_mesh_obj(std::string_view text, const std::string& name);

std::string hair_mesh_json(const HairMesh& mesh, scene::Axis up);
std::string hair_mesh_obj(const HairMesh& mesh);

// Whether the text is JSON that says it is a hair mesh.
bool says_hair_mesh(std::string_view text);

}  // namespace ringlet::groom
