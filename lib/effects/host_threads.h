// The threads that kernels work on where they are not strand-local: TBB's.
#pragma once
#include "kernels/backend/host.h"

namespace ringlet::effects {

kernels::HostThreads host_threads();

}  // namespace ringlet::effects
