// Where two JSON texts differ; private to the room.
#pragma once
#include <string>
#include <vector>

#include "cache/compare.h"

namespace ringlet::cache {

// Every leaf that is not the same in both, by JSON pointer with values as JSON text (empty: not there). Texts
// that are no JSON differ as a whole, at the pointer "".
std::vector<Difference> json_differences(const std::string& a, const std::string& b);

}  // namespace ringlet::cache
