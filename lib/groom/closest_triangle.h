// The triangle of a mesh nearest to a point, by a bounding-volume tree. Private to the room.
#pragma once
#include <span>
#include <vector>

#include "core/geometry.h"

namespace ringlet::groom {

struct ClosestPoint {
  std::int32_t triangle = -1;
  Vec3 barycentric = Vec3::Zero();
  Vec3 point = Vec3::Zero();
  double squared_distance = 0;
};

// The point of triangle abc closest to p: exact up to rounding, in its face, on an edge or at a corner.
ClosestPoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

// A triangle too thin to have a usable frame: its height is below 1e-4 of its longest edge.
bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c);

class ClosestTriangle {
 public:
  // Degenerate triangles are left out. Vertices and triangles must outlive it.
  ClosestTriangle(std::span<const Vec3> vertices, std::span<const Triangle> triangles);

  bool empty() const { return order_.empty(); }

  // The nearest triangle; the lowest index of several at the same distance. Safe from several threads.
  ClosestPoint find(const Vec3& p) const;

 private:
  // Children of an inner node follow it: the left one at once, the right one at `right`. A leaf has `right`
  // 0.
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t first, count, right;
  };
  void split(std::uint32_t first, std::uint32_t count);
  Eigen::AlignedBox3d box_of(std::int32_t triangle) const;

  std::span<const Vec3> vertices_;
  std::span<const Triangle> triangles_;
  std::vector<std::int32_t> order_;  // triangles, those of a node contiguous
  std::vector<Node> nodes_;
};

}  // namespace ringlet::groom
