// ringlet run SCENE
#pragma once
#include <filesystem>
#include <optional>

#include "settings.h"

namespace ringlet::app {

struct RunOptions {
  SceneSettings scene;
  std::filesystem::path output;  // empty: out/NAME
  std::string frames;            // A-B, or A; empty: the scene's
  bool resume = false, overwrite = false;
  std::string progress = "auto";
  std::filesystem::path trace;  // empty: none
};

// Simulates and writes the cache. Returns 0, or 128 + n where signal n stopped it. Throws Error.
int run_run(const RunOptions& options);

}  // namespace ringlet::app
