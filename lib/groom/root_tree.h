// Strands by where their roots are.
#pragma once
#include <nanoflann.hpp>
#include <vector>

#include "core/geometry.h"

namespace ringlet::groom {

// Roots as nanoflann sees them.
struct RootCloud {
  std::vector<Vec3> roots;
  std::size_t kdtree_get_point_count() const { return roots.size(); }
  double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return roots[i][static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using RootTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, RootCloud>, RootCloud, 3>;

}  // namespace ringlet::groom
