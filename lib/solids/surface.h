// A mesh's surface made fit for collision: closed, wound outward, its cavities known.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/geometry.h"

namespace ringlet::solids {

struct ClosedSurface {
  // The mesh's own, in their order (seams joined, some turned), then the caps'.
  std::vector<Triangle> triangles;
  // [triangles] Of a part that lies inside another and faces inward: a hollow's wall.
  std::vector<bool> bounds_cavity;
  // [triangles * 3] Across the edge from corner k to k + 1; -1 where there is none, or more than one.
  std::vector<std::int32_t> neighbours;
  // The boundary loops capped. Loop i's centre is vertex mesh_vertices + i.
  std::vector<std::vector<std::int32_t>> loops;
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
