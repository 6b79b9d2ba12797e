// Which side of a closed surface a point near it lies on.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "solids/surface.h"

namespace ringlet::solids {

// Told from the closest triangle by angle-weighted pseudo-normals, which are right over faces, edges and
// vertices alike (Baerentzen and Aanaes 2005, "Signed distance computation using the angle weighted
// pseudonormal").
class SurfaceSide {
 public:
  // Both must outlive it; `vertices` [vertex_count], in any unit.
  SurfaceSide(const ClosedSurface& surface, std::span<const Vec3> vertices);

  // `triangle` is the one closest to the point. Empty where the triangles about it are wound this way and
  // that, or where the point lies on the surface.
  std::optional<bool> is_inside(const Vec3& point, std::int32_t triangle) const;

 private:
  bool is_well_wound(std::size_t triangle) const;

  const ClosedSurface& surface_;
  std::span<const Vec3> vertices_;
  std::vector<Vec3> face_normals_;    // unit, or zero where degenerate
  std::vector<Vec3> vertex_normals_;  // of any length
};

}  // namespace ringlet::solids
