// Grooms start with particles inside the head: they are moved out in the rest shape, once, never by a kick.
#pragma once
#include <span>
#include <vector>

#include "core/geometry.h"
#include "kernels/solid/solid_view.h"
#include "scene/scene_desc.h"

namespace ringlet::effects {

struct PenetrationReport {
  std::int64_t inside = 0;   // particles inside, roots aside
  std::int64_t strands = 0;  // strands that have some
  double deepest = 0;        // [m]
  std::int64_t buried = 0;   // strands whose root lies deeper than they are long: left alone
};

// One groom's strands against one solid; `skin` holds the triangle that each grows on, or a kernels::Skin.
// `points` (world, at the pose of `solid`) are moved where `policy` is push_out; `skin` becomes kIgnoresHome
// for buried strands and those too short to matter; `prune` becomes 1 for strands to be left out (policy
// prune: those that have particles inside). Root particles stay.
PenetrationReport resolve_penetration(scene::Penetration policy, const kernels::SolidView& solid,
                                      std::span<const std::int64_t> offsets, std::span<Vec3> points,
                                      std::span<std::int32_t> skin, std::span<unsigned char> prune);

}  // namespace ringlet::effects
