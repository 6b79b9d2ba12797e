// `--frames A-B`.
#pragma once
#include <string>

#include "pipeline/simulation.h"

namespace ringlet::app {

// The range that `text` names, all of the scene's where it is empty. Throws Error{kUsage} for one that the
// scene does not have.
pipeline::FrameRange parse_range(const std::string& text, const scene::Frames& frames);

}  // namespace ringlet::app
