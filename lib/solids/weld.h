// Joins the copies of a vertex that files keep apart along texture and normal seams, so that the surface is
// as closed as it looks.
#pragma once
#include <span>

#include "solids/rig.h"

namespace ringlet::solids {

// A partition of a rig's vertices into those that always coincide, numbered in order of first appearance.
struct Weld {
  std::vector<std::int32_t> label;           // [vertices of the file] welded vertex
  std::vector<std::int32_t> representative;  // [welded vertices] its first vertex in the file
};

// Vertices weld when position, influences and every morph delta agree exactly.
Weld find_weld(const Rig& rig);

// Splits what `positions` [vertices of the file] shows to be apart. Returns for each vertex of the finer
// partition the one of the coarser it came from.
std::vector<std::int32_t> refine(Weld& weld, std::span<const Vec3> positions);

// The rig with one vertex for each of the partition. Triangles keep their number and order, degenerate ones
// too.
Rig apply(Rig rig, const Weld& weld);

}  // namespace ringlet::solids
