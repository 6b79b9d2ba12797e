// What `run`, `plan` and `bench` take alike.
#pragma once
#include <string>
#include <vector>

#include "pipeline/simulation.h"

namespace ringlet::app {

struct SceneSettings {
  std::string file;
  std::vector<std::string> overrides;  // --set POINTER=JSON
  pipeline::Options options;           // backend, precision, instruction set
  int threads = 0;                     // 0: as many as the machine has
};

}  // namespace ringlet::app
