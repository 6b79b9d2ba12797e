// Kernel launches.
#pragma once
#include <cstdint>

namespace ringlet::effects {

// As many as there may be, and the least.
struct Launches {
  std::int64_t least, most;
};

}  // namespace ringlet::effects
