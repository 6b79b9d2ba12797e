// Ctrl-C and SIGTERM: the frame in flight is finished, then the run ends.
#pragma once
#include <atomic>

namespace ringlet::app {

// From here on the first SIGINT, SIGTERM or SIGHUP is noted in the returned value; a second one ends the
// program at once.
const std::atomic<int>& catch_signals();

}  // namespace ringlet::app
