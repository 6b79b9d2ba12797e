// The pose a skin was bound in.
#pragma once
#include "solids/rig.h"

namespace ringlet::solids {

// Makes the bind pose the rest pose of a rig's skeleton: grooms are made on it, and what the joints' own
// nodes hold is often a frame of some clip. A rig without a skin, and one whose bind pose is of another
// scale than its nodes at rest, are left as they are. Returns how far the farthest vertex moved, file units.
double rest_in_bind_pose(Rig& rig);

}  // namespace ringlet::solids
