// One reader a file format. Private to the room: the way in is read() in groom.h.
#pragma once
#include <filesystem>

#include "groom/input_file.h"
#include "groom/strands.h"
#include "scene/scene_desc.h"

namespace ringlet::groom {

// A groom as the file has it: lengths in its own unit, axes its own.
struct FileGroom {
  Strands strands;
  scene::UnitsOverride declared;  // what the file says of its unit and up axis
};

FileGroom read_hair(const InputFile& file);
FileGroom read_hairsalon(const InputFile& file);
FileGroom read_tressfx(const InputFile& file);
FileGroom read_h5(const std::filesystem::path& file);

// The roots of a .tfxskin file, one for each of the groom's strands.
std::vector<RootSite> read_tressfx_skin(const InputFile& file, std::size_t strands);

}  // namespace ringlet::groom
