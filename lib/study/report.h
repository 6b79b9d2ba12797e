// The report for people.
#pragma once
#include <string>

#include "study/study.h"

namespace ringlet::study {

// One page of Markdown beside plot.svg: what the next digit costs, which settings waste time, which is the
// knee, and what these answers rest on.
std::string report(const Study& study);

// The rows as an aligned table for a terminal.
std::string table(const Study& study);

// How the pick reads, `--set` lines and all; says so where no run meets what is wanted.
std::string picked_text(const Study& study);

}  // namespace ringlet::study
