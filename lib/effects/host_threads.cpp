#include "effects/host_threads.h"

#include <tbb/parallel_for.h>

namespace ringlet::effects {

kernels::HostThreads host_threads() {
  const auto run = [](void*, int chunks, void (*body)(const void* context, int chunk), const void* context) {
    tbb::parallel_for(0, chunks, [=](int chunk) { body(context, chunk); });
  };
  return {run, nullptr};
}

}  // namespace ringlet::effects
