// The rigid pose that best takes one set of points to another.
#pragma once
#include <span>

#include "core/geometry.h"

namespace ringlet::solids {

// Least squares over x = rotation * from + position (Kabsch); `from` and `to` [points]. Points on one line
// leave the turn about it undetermined: any one is given.
Pose fit_pose(std::span<const Vec3> from, std::span<const Vec3> to);

}  // namespace ringlet::solids
