// Level sets of one surface on disk, found by what they were made of, so that runs of the same motion share
// them.
#pragma once
#include <filesystem>
#include <memory>
#include <string>

#include "solids/level_set.h"

namespace ringlet::solids {

struct LevelSetOptions {
  float voxel_size;                 // [m]
  int half_width;                   // voxels
  std::filesystem::path directory;  // of .vdb files; empty: none are kept
  std::string name;                 // of the solid, for the log
};

// Hexadecimal, of everything that a level set depends on.
std::string content_key(const ClosedSurface& surface, std::span<const Eigen::Vector3f> vertices,
                        const LevelSetOptions& options);

// The level set from the directory, or built and put there. A file that cannot be read is built anew and one
// that cannot be written is done without, each with a warning.
std::shared_ptr<const LevelSet> cached_level_set(const ClosedSurface& surface,
                                                 std::span<const Eigen::Vector3f> vertices,
                                                 const LevelSetOptions& options);

}  // namespace ringlet::solids
