// How far outside a closed mesh a point is.
#pragma once
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "kernels/solid/solid_view.h"
#include "scene/scene_desc.h"
#include "solids/closest_triangle.h"
#include "solids/folds.h"
#include "solids/surface.h"

namespace ringlet::solids {

// Of a mesh at one instant, with the surface that hair collides with: openings are capped and parts that are
// inside out turned, which the log says under `name`. Inside is what the surface winds round, where parts
// overlap too. Vertices count to the single precision of their distance from the mesh's middle.
class MeshDistance {
 public:
  // A surface that encloses nothing is warned of: no point is inside it.
  MeshDistance(const std::string& name, std::span<const Vec3> vertices, std::span<const Triangle> triangles);
  MeshDistance(const MeshDistance&) = delete;
  MeshDistance& operator=(const MeshDistance&) = delete;

  // [m] negative inside. Safe from several threads.
  double operator()(const Vec3& point) const;

 private:
  ClosedSurface surface_;
  Vec3 origin_;
  std::vector<Eigen::Vector3f> vertices_;  // about the origin
  ClosestTriangle nearest_;
  Crossings crossings_;
  kernels::SolidView view_{};
};

// The same of a mesh file in its rest pose. Throws Error{kInput} for one that cannot be read.
std::function<double(const Vec3&)> distance_to(const scene::MeshDesc& mesh, const scene::Units& units);

}  // namespace ringlet::solids
