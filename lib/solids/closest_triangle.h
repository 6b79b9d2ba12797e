// The triangle of a surface nearest to a point: a tree of boxes, four triangles to a leaf.
//
// In single precision: distances are good to some 1e-6 of the coordinates' size.
#pragma once
#include <span>
#include <vector>

#include "core/geometry.h"

namespace ringlet::solids {

class ClosestTriangle {
 public:
  struct Hit {
    float squared_distance;
    std::int32_t triangle = -1;  // -1: none nearer than asked
    std::int32_t leaf = 0;       // where it was found: a hint for the next query
  };

  // A tree over triangles[c] for c in `chosen`; none is fine.
  ClosestTriangle(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
                  std::span<const std::int32_t> chosen);

  // The nearest triangle, where it is nearer than `squared_bound`. `leaf` of a hit near by makes the search
  // short. Of triangles at one distance any is given, always the same for the same arguments.
  Hit nearest(const Eigen::Vector3f& point, float squared_bound, std::int32_t leaf = 0) const;

 private:
  using Float4 = float __attribute__((vector_size(16)));

  // Corner a, edges from it, and what their inner products' inverses are; a lane each for four triangles.
  struct Leaf {
    Float4 a[3], ab[3], ac[3];
    Float4 per_ab2, per_ac2, per_bc2, per_det;
    std::int32_t triangle[4];
    void set(int lane, std::int32_t index, const std::array<Vec3, 3>& corners);
    Float4 squared_distances(const Eigen::Vector3f& point) const;
  };
  struct Box {
    Float4 low, high;    // the last lane is 0
    std::int32_t child;  // the left one, the right one follows it; or, where negative, the leaf -1 - child
    float squared_distance(Float4 point) const;
  };

  struct Source;  // what the tree is built from
  void split(Source& source, std::size_t box, std::span<std::int32_t> chosen);
  void search_leaf(const Eigen::Vector3f& point, std::int32_t leaf, Hit& best) const;

  std::vector<Leaf> leaves_;
  std::vector<Box> boxes_;
};

}  // namespace ringlet::solids
