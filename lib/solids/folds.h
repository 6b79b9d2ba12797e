// Folds: where a surface passes through itself, as skin does in an armpit or a limb that rests on another.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "kernels/solid/solid_view.h"
#include "solids/surface.h"

namespace ringlet::solids {

// The triangles that a ray along +x may cross, by where it starts in the yz plane.
class Crossings {
 public:
  // Of the triangles with their vertices now at `vertices` [m, level-set coordinates].
  void build(std::span<const Eigen::Vector3f> vertices, std::span<const Triangle> triangles);

  kernels::CrossingsView view() const;
  // Calls visit(triangle) for those that may meet the box of a and b in the yz plane, some more than once.
  void for_each_near(const Eigen::Vector3f& a, const Eigen::Vector3f& b,
                     const std::function<void(std::int32_t)>& visit) const;
  std::size_t bytes() const { return (start_.size() + triangle_.size()) * sizeof(std::int32_t); }

 private:
  template <class Visit>
  void for_each_bin(const Eigen::AlignedBox3f& box, const Visit& visit) const;

  kernels::CrossingsView view_{};
  std::vector<std::int32_t> start_, triangle_;
};

// Whether the surface has any: a vertex inside another part of it, or a triangle that another's edge pierces.
bool has_folds(const ClosedSurface& surface, std::span<const Eigen::Vector3f> vertices, float voxel_size);

}  // namespace ringlet::solids
