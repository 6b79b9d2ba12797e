#include "pipeline/plan.h"

#include <algorithm>

namespace ringlet::pipeline {

Plan frames_planned(const scene::Scene& scene, const SubstepControl* control) {
  Plan plan;
  plan.substeps = scene.model.substeps;
  plan.least_substeps = control ? control->least() : plan.substeps;
  plan.frames = scene.frames.last - scene.frames.first + scene.frames.preroll;
  return plan;
}

effects::Launches launches_of_run(const Plan& plan, const SubstepControl* control,
                                  const std::function<effects::Launches(int substeps)>& of_frame) {
  effects::Launches frame = of_frame(plan.substeps);
  if (control) {
    const std::vector<int> shortest = control->tries(control->least());
    frame.least = of_frame(shortest[0]).least + of_frame(shortest[1]).least;
    frame.most = 0;
    for (int second = control->least(); second <= control->most(); ++second) {
      std::int64_t sum = 0;
      for (const int substeps : control->tries(second)) sum += of_frame(substeps).most;
      frame.most = std::max(frame.most, sum);
    }
  }
  return {plan.frames * frame.least, plan.frames * frame.most};
}

}  // namespace ringlet::pipeline
