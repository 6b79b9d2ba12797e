// An order of strands that is not that of the files they come from.
#pragma once
#include "state/strand_model.h"

namespace ringlet::state {

// [strands] as batch * kLanes + lane, by root points along a curve that fills space, then by rest shapes:
// what is near one another comes soon after one another, and whatever follows this order does not depend on
// how a groom lists its strands.
template <class T>
std::vector<std::int32_t> strands_by_root(const StrandModel<T>& model, const StrandState<T>& state);

}  // namespace ringlet::state
