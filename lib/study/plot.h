// The work-precision plot.
#pragma once
#include <string>

#include "study/study.h"

namespace ringlet::study {

// An SVG picture: error against milliseconds a frame, both logarithmic; the Pareto front as a line through
// filled points, the others hollow, the knee ringed. Runs without both figures, or without error, are not on
// it.
std::string plot(const Study& study);

}  // namespace ringlet::study
