// ringlet study
#pragma once
#include <string>
#include <vector>

#include "settings.h"

namespace ringlet::app {

struct StudyOptions {
  SceneSettings scene;
  std::vector<std::string> vary;       // POINTER=V1,V2,...; empty: /model/substeps=1,2,4,8,16,32
  std::vector<std::string> reference;  // POINTER=JSON that the reference has beside --set
  std::string output;                  // empty: out/NAME_study
  std::string frames;                  // A-B; empty: the scene's
  std::string budget, target;          // 40ms, 1e-3; empty: none
  int repeats = 3;
  int reference_cap = 1000;
  bool product = false, resume = false, overwrite = false, json = false, quiet = false;
};

// Measures what accuracy costs and prints the answers. Returns 0; 1 where no run meets --budget and --target;
// 128 + n where signal n stopped it. Throws Error.
int run_study(const StudyOptions& options);

}  // namespace ringlet::app
