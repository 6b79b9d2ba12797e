// ringlet bench
#pragma once
#include <string>
#include <vector>

#include "settings.h"

namespace ringlet::app {

struct BenchOptions {
  std::vector<std::string> scenes;  // scene files; empty: a grown wig of harolongo's size
  pipeline::Options options;
  int threads = 0;
  int repeats = 5;
  bool json = false;
};

// Times the strand step and, for scenes, whole frames by stage; prints one table. Returns 0. Throws Error.
int run_bench(const BenchOptions& options);

}  // namespace ringlet::app
