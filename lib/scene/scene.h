// scene::load, the only reader of scene JSON.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "scene/scene_desc.h"

namespace ringlet::scene {

struct LoadOptions {
  std::vector<std::string> overrides;  // `POINTER=JSON`, applied in order before validation; null removes
  std::string option = "--set";        // of the command line that gave them, for messages
};

// Reads, overrides, validates against schemas/scene.schema.json, fills in every default, checks meaning
// (files exist, ranges that depend on one another) and returns the scene. Throws Error{kInput} with every
// problem found, each with the file, the JSON pointer (or line and column where it is no JSON), the value and
// what was expected; Error{kUsage} for a malformed override.
Scene load(const std::filesystem::path& file, const LoadOptions& options = {});

}  // namespace ringlet::scene
