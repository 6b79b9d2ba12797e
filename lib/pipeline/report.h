// The figures of a frame, from what its stages gathered.
#pragma once
#include <optional>

#include "effects/stage.h"
#include "scene/scene_desc.h"
#include "state/frame.h"

namespace ringlet::pipeline {

// An empty report for this many strands.
effects::FrameReport empty_report(std::size_t strands);

// Named figures (schemas/cache.md lists them). `strand_steps`: strands times substeps of the frame;
// `hair_hair`: the scene's, for whose stages there are figures too.
state::Figures figures_of(const effects::FrameReport& report, std::int64_t strand_steps,
                          const std::optional<scene::HairHair>& hair_hair);

}  // namespace ringlet::pipeline
