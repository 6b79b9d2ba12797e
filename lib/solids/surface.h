// A mesh's surface made fit for collision: closed, wound outward, its cavities known.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/geometry.h"

namespace ringlet::solids {

struct ClosedSurface {
  std::vector<Triangle> triangles;  // the mesh's own, in their order (seams joined, some turned), then the caps'
  std::vector<bool>
      bounds_cavity;  // [triangles] of a part that lies inside another and faces inward: a hollow's wall
  std::vector<std::vector<std::int32_t>>
      loops;  // the boundary loops capped; loop i's centre is vertex mesh_vertices + i
  std::vector<std::int32_t> neighbours;  // [triangles * 3] across the edge from corner k to k + 1, -1: none
  std::size_t mesh_vertices = 0;

  std::size_t vertex_count() const { return mesh_vertices + loops.size(); }

  // Puts the cap centres where the loops' vertices now are; `vertices` [vertex_count], the mesh's first.
  void follow(std::span<Vec3> vertices) const;
};

// Caps each boundary loop by a fan about its centroid and turns parts that are inside out, saying so in the
// log under `name`. Any mesh is closed so, non-manifold ones too: boundary edges are those that an odd number
// of triangles use, and these always form loops.
ClosedSurface close_surface(const std::string& name, std::span<const Vec3> vertices,
                            std::span<const Triangle> mesh);

}  // namespace ringlet::solids
