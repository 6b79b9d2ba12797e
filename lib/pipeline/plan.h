// What would run: the stages a scene calls for and those it does not.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ringlet::pipeline {

struct PlannedStage {
  std::string name;
  std::string what;  // for people
  bool runs;
  std::size_t bytes;      // memory it owns; 0 where it does not run
  std::int64_t launches;  // kernel launches over the whole run, preroll included; 0 where it does not run
};

struct Plan {
  std::int64_t strands = 0, particles = 0;
  int substeps = 0;                  // a frame
  int frames = 0;                    // stepped, preroll included
  std::vector<PlannedStage> stages;  // in the order they run
};

}  // namespace ringlet::pipeline
