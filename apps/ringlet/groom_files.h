// The groom files that `ringlet groom` reads and writes.
#pragma once
#include "groom.h"
#include "groom/strands.h"
#include "scene/scene_desc.h"

namespace ringlet::app {

// Throws Error{kUsage} where the output is no .h5.
void check_output(const std::filesystem::path& output);

void write_groom(const std::filesystem::path& output, const groom::Strands& strands, scene::Axis up);

// The metres in a unit given by its name or in metres. `option` is named where it is none.
double metres_in(const std::string& option, const std::string& unit);

// What the lengths and axes on the command line are in.
scene::Units units_of(const GroomFileOptions& options);

groom::Strands read_groom(const GroomFileOptions& options);

}  // namespace ringlet::app
