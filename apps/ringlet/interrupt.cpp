#include "interrupt.h"

#include <csignal>

namespace ringlet::app {
namespace {

std::atomic<int> caught{0};
static_assert(std::atomic<int>::is_always_lock_free);

void note(int signal) {
  caught = signal;
  std::signal(signal, SIG_DFL);
}

}  // namespace

const std::atomic<int>& catch_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, note);
  return caught;
}

}  // namespace ringlet::app
