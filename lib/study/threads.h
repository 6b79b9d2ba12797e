// How many threads a run of a study has.
#pragma once
#include <tbb/global_control.h>

#include <optional>

namespace ringlet::study {

// Holds the number of threads while it lives.
class Threads {
 public:
  explicit Threads(int threads) {  // 0: as many as the machine has
    if (threads > 0) control_.emplace(tbb::global_control::max_allowed_parallelism, threads);
  }

 private:
  std::optional<tbb::global_control> control_;
};

}  // namespace ringlet::study
