// Folds: where the triangle closest to a point does not tell inside from outside, because the surface passes
// through itself, as skin does in an armpit, or because the solid is thin beside the voxels.
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
  struct Range {  // of bins, inclusive
    std::int32_t low[2], high[2];
    std::size_t size() const {
      return static_cast<std::size_t>(high[0] - low[0] + 1) * static_cast<std::size_t>(high[1] - low[1] + 1);
    }
  };
  void lay_out(const Eigen::AlignedBox2f& box, float edge);
  Range range_of(const Eigen::AlignedBox3f& box) const;
  template <class Visit>
  void for_each_bin(const Range& range, const Visit& visit) const;

  kernels::CrossingsView view_{};
  std::vector<std::int32_t> start_, triangle_;
};

// The triangles with a vertex that lies inside another part of the surface or over a thin part of the solid,
// those that another's edge pierces, and those whose edge it is; in ascending order.
std::vector<std::int32_t> folded_triangles(const ClosedSurface& surface,
                                           std::span<const Eigen::Vector3f> vertices, float voxel_size);

// As the table of `level_set`: 1 for tiles within two voxels of the triangles, whose vertices are now at
// `vertices`.
void mark_tiles(const kernels::LevelSetView& level_set, std::span<const Eigen::Vector3f> vertices,
                std::span<const Triangle> triangles, std::span<const std::int32_t> chosen,
                std::vector<unsigned char>& tiles);

}  // namespace ringlet::solids
