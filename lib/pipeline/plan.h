// What would run: the stages a scene calls for and those it does not.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "effects/launches.h"
#include "pipeline/substep_control.h"
#include "scene/scene_desc.h"

namespace ringlet::pipeline {

struct PlannedStage {
  std::string name;
  std::string what;  // for people
  bool runs;
  std::size_t bytes;  // memory it owns; 0 where it does not run
  // Kernel launches over the whole run, preroll included; 0 where it does not run. They differ where what is
  // met on the way decides.
  effects::Launches launches;
};

struct Plan {
  std::int64_t strands = 0, particles = 0;
  int substeps = 0, least_substeps = 0;  // of a frame: the most and the least that it is kept with
  int frames = 0;                        // stepped, preroll included
  std::vector<PlannedStage> stages;      // in the order they run
};

// The stage of frames that are taken more than once, where an error chooses the substeps.
inline constexpr const char* kTries = "tries";
inline constexpr const char* kTriesAre =
    "a frame's start and what its tries led to, for substeps by tolerance";

// A plan of the scene's frames and substeps, without stages. `control`: null where the substeps are fixed.
Plan frames_planned(const scene::Scene& scene, const SubstepControl* control);

// The launches of all frames, from those of a frame that is taken once in so many substeps.
effects::Launches launches_of_run(const Plan& plan, const SubstepControl* control,
                                  const std::function<effects::Launches(int substeps)>& of_frame);

}  // namespace ringlet::pipeline
