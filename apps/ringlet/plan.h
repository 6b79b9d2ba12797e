// ringlet plan SCENE
#pragma once
#include "settings.h"

namespace ringlet::app {

struct PlanOptions {
  SceneSettings scene;
  bool json = false;
};

// Prints what would run. Returns 0. Throws Error.
int run_plan(const PlanOptions& options);

}  // namespace ringlet::app
