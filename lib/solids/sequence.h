// A mesh as a numbered sequence of files, one a frame.
#pragma once
#include <filesystem>
#include <span>
#include <vector>

#include "solids/rig.h"
#include "solids/units.h"

namespace ringlet::solids {

// True where the file's name has `#` characters, which stand for the digits of a frame number.
bool is_sequence(const std::filesystem::path& file);

// The first file as a rig at rest, and the vertices of every file in turn.
struct Sequence {
  Rig rig;                                           // welded
  DeclaredUnits declared;                            // of the first file
  std::vector<std::vector<Eigen::Vector3f>> frames;  // [files][vertices], file units
};

// Throws Error{kInput}: no file of that pattern, a missing number, a file whose triangles are not the
// first's.
Sequence read_sequence(const std::filesystem::path& pattern);

// Vertices `position` >= 0 files after the first one, straight lines between files, moved by `placement`.
// After the last file they hold, or with `loop` go on to the first.
void sample_sequence(const Sequence& sequence, double position, bool loop, const Affine& placement,
                     std::span<Vec3> out);

}  // namespace ringlet::solids
