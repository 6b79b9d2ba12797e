// How a run tells how far it is (`--progress`).
#pragma once
#include <memory>
#include <string>

#include "pipeline/simulation.h"

namespace ringlet::app {

class Progress {
 public:
  virtual ~Progress() = default;
  // `done` of `total` frames are stepped, the last in `seconds`.
  virtual void frame(int frame, int done, int total, double seconds,
                     const pipeline::StageSeconds& stages) = 0;
  virtual void end() {}
};

// `kind`: auto (a bar on a terminal, else plain), bar, plain, json, none.
std::unique_ptr<Progress> make_progress(const std::string& kind, int last_frame);

}  // namespace ringlet::app
