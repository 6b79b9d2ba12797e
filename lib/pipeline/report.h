// The figures of a frame, from what its stages gathered.
#pragma once
#include "effects/stage.h"
#include "state/frame.h"

namespace ringlet::pipeline {

// An empty report for this many strands.
effects::FrameReport empty_report(std::size_t strands);

// Named figures (schemas/cache.md lists them). `strand_steps`: strands times substeps of the frame.
state::Figures figures_of(const effects::FrameReport& report, std::int64_t strand_steps);

}  // namespace ringlet::pipeline
