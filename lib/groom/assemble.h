// Grooms put together again from strands that were changed one by one. Private to the room.
#pragma once
#include <span>
#include <vector>

#include "groom/strands.h"

namespace ringlet::groom {

struct StrandShape {
  std::vector<Vec3> points;
  std::vector<float> widths;  // as many, or none
};

StrandShape shape_of(const Strands& strands, std::size_t strand);

// `old` with these shapes in the place of its strands', roots and groups kept. A strand of no point is gone.
Strands assemble(const Strands& old, std::span<const StrandShape> shapes);

}  // namespace ringlet::groom
