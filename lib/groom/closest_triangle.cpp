#include "groom/closest_triangle.h"

#include <algorithm>
#include <limits>

namespace ringlet::groom {

namespace {
constexpr std::uint32_t kLeafTriangles = 4;

// The closest point of segment ab, as the fraction from a to b.
double closest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 edge = b - a;
  const double squared = edge.squaredNorm();
  return squared > 0 ? std::clamp((p - a).dot(edge) / squared, 0.0, 1.0) : 0.0;
}
}  // namespace

bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return !((b - a).cross(c - a).norm() > 1e-4 * longest);
}

ClosestPoint closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const std::array<const Vec3*, 3> corner = {&a, &b, &c};
  const Vec3 normal = (b - a).cross(c - a);
  const double squared = normal.squaredNorm();
  ClosestPoint best;
  for (int k = 0; k < 3;
       ++k) {  // the weight of a corner is the signed area that p spans with the edge opposite
    best.barycentric[k] =
        (*corner[(k + 2) % 3] - *corner[(k + 1) % 3]).cross(p - *corner[(k + 1) % 3]).dot(normal) / squared;
  }
  if ((best.barycentric.array() >= 0).all()) {
    best.barycentric /= best.barycentric.sum();
    best.point = best.barycentric[0] * a + best.barycentric[1] * b + best.barycentric[2] * c;
    best.squared_distance = (p - best.point).squaredNorm();
    return best;
  }
  best.squared_distance = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {  // p projects outside: the closest point is on the border
    const Vec3 &from = *corner[k], &to = *corner[(k + 1) % 3];
    const double t = closest_on_segment(p, from, to);
    const Vec3 point = (1 - t) * from + t * to;
    const double distance = (p - point).squaredNorm();
    if (!(distance < best.squared_distance)) continue;
    best = {.barycentric = Vec3::Zero(), .point = point, .squared_distance = distance};
    best.barycentric[k] = 1 - t;
    best.barycentric[(k + 1) % 3] = t;
  }
  return best;
}

ClosestTriangle::ClosestTriangle(std::span<const Vec3> vertices, std::span<const Triangle> triangles)
    : vertices_(vertices), triangles_(triangles) {
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Triangle& v = triangles[t];
    if (!is_degenerate(vertices[v[0]], vertices[v[1]], vertices[v[2]]))
      order_.push_back(static_cast<std::int32_t>(t));
  }
  if (!order_.empty()) split(0, static_cast<std::uint32_t>(order_.size()));
}

Eigen::AlignedBox3d ClosestTriangle::box_of(std::int32_t triangle) const {
  Eigen::AlignedBox3d box;
  for (const std::int32_t vertex : triangles_[triangle]) box.extend(vertices_[vertex]);
  return box;
}

// Appends the node of a range of order_ and all below it, halving by the median along the longest axis.
void ClosestTriangle::split(std::uint32_t first, std::uint32_t count) {
  const std::uint32_t node = static_cast<std::uint32_t>(nodes_.size());
  const auto begin = order_.begin() + first;
  nodes_.push_back({{}, first, count, 0});
  for (auto t = begin; t != begin + count; ++t) nodes_[node].box.extend(box_of(*t));
  if (count <= kLeafTriangles) return;
  int axis;
  nodes_[node].box.sizes().maxCoeff(&axis);
  const auto before = [&](std::int32_t s, std::int32_t t) {
    const double x = box_of(s).center()[axis], y = box_of(t).center()[axis];
    return x != y ? x < y : s < t;
  };
  const std::uint32_t half = count / 2;
  std::nth_element(begin, begin + half, begin + count, before);
  split(first, half);
  nodes_[node].right = static_cast<std::uint32_t>(nodes_.size());
  split(first + half, count - half);
}

ClosestPoint ClosestTriangle::find(const Vec3& p) const {
  ClosestPoint best{.squared_distance = std::numeric_limits<double>::infinity()};
  std::array<std::uint32_t, 64> stack;  // depth is at most the logarithm of the triangle count, 31
  std::size_t depth = 0;
  if (!nodes_.empty()) stack[depth++] = 0;
  while (depth > 0) {
    const Node& node = nodes_[stack[--depth]];
    if (node.box.squaredExteriorDistance(p) > best.squared_distance) continue;
    if (node.right != 0) {
      std::uint32_t near = static_cast<std::uint32_t>(&node - nodes_.data()) + 1, far = node.right;
      if (nodes_[far].box.squaredExteriorDistance(p) < nodes_[near].box.squaredExteriorDistance(p))
        std::swap(near, far);
      stack[depth++] = far;
      stack[depth++] = near;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Triangle& v = triangles_[order_[i]];
      ClosestPoint candidate = closest_on_triangle(p, vertices_[v[0]], vertices_[v[1]], vertices_[v[2]]);
      candidate.triangle = order_[i];
      if (candidate.squared_distance < best.squared_distance ||
          (candidate.squared_distance == best.squared_distance && candidate.triangle < best.triangle)) {
        best = candidate;
      }
    }
  }
  return best;
}

}  // namespace ringlet::groom
