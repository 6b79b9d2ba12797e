// Whether values are finite: a product with zero is zero, or it is not a number.
#pragma once
#include <cstdint>

#include "kernels/launch/launch.h"

namespace ringlet::kernels {

// Whether all `count` values are. They are aligned to 64 bytes, and whole rows of kLanes.
template <class T>
using FiniteCheck = bool (*)(const T* values, std::int64_t count);

template <class T>
FiniteCheck<T> finite_check(InstructionSet set);

}  // namespace ringlet::kernels
