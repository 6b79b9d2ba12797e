#include "solids/closest_triangle.h"

#include <algorithm>

namespace ringlet::solids {
namespace {

using Float4 = float __attribute__((vector_size(16)));

constexpr std::size_t kLeafTriangles = 4;
constexpr std::size_t kDeepest = 64;  // halving 2^31 triangles takes fewer boxes

Float4 dot(const Float4 (&a)[3], const Float4 (&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Float4 lower(Float4 a, Float4 b) { return a < b ? a : b; }
Float4 greater(Float4 a, Float4 b) { return a > b ? a : b; }
Float4 clamp01(Float4 x) { return lower(greater(x, Float4{}), Float4{} + 1); }

// |from - t along|^2
Float4 squared_residual(const Float4 (&from)[3], const Float4 (&along)[3], Float4 t) {
  const Float4 r[3]{from[0] - t * along[0], from[1] - t * along[1], from[2] - t * along[2]};
  return dot(r, r);
}

float inverse(double x) { return x > 0 ? static_cast<float>(1 / x) : 0.0f; }

}  // namespace

struct ClosestTriangle::Source {
  std::span<const Vec3> vertices;
  std::span<const Triangle> triangles;
  std::vector<Vec3> centres;  // of the chosen triangles, at all triangles' places

  std::array<Vec3, 3> corners(std::int32_t triangle) const {
    const Triangle& t = triangles[static_cast<std::size_t>(triangle)];
    return {vertices[static_cast<std::size_t>(t[0])], vertices[static_cast<std::size_t>(t[1])],
            vertices[static_cast<std::size_t>(t[2])]};
  }
  const Vec3& centre(std::int32_t triangle) const { return centres[static_cast<std::size_t>(triangle)]; }
};

void ClosestTriangle::Leaf::set(int lane, std::int32_t index, const std::array<Vec3, 3>& corners) {
  const Vec3 edge_b = corners[1] - corners[0], edge_c = corners[2] - corners[0];
  for (int axis = 0; axis < 3; ++axis) {
    a[axis][lane] = static_cast<float>(corners[0][axis]);
    ab[axis][lane] = static_cast<float>(edge_b[axis]);
    ac[axis][lane] = static_cast<float>(edge_c[axis]);
  }
  per_ab2[lane] = inverse(edge_b.squaredNorm());
  per_ac2[lane] = inverse(edge_c.squaredNorm());
  per_bc2[lane] = inverse((edge_c - edge_b).squaredNorm());
  per_det[lane] = inverse(edge_b.cross(edge_c).squaredNorm());
  triangle[lane] = index;
}

// The least of the distances to the three edges and, where the point lies over it, to the face. Each is a
// distance to some point of the triangle, however thin it is, so that rounding never makes the result too
// small.
Float4 ClosestTriangle::Leaf::squared_distances(const Eigen::Vector3f& point) const {
  const Float4 ap[3]{point.x() - a[0], point.y() - a[1], point.z() - a[2]};
  const Float4 bp[3]{ap[0] - ab[0], ap[1] - ab[1], ap[2] - ab[2]};
  const Float4 bc[3]{ac[0] - ab[0], ac[1] - ab[1], ac[2] - ab[2]};
  const Float4 along_b = dot(ab, ap), along_c = dot(ac, ap);
  const Float4 on_edges = lower(lower(squared_residual(ap, ab, clamp01(along_b * per_ab2)),
                                      squared_residual(ap, ac, clamp01(along_c * per_ac2))),
                                squared_residual(bp, bc, clamp01(dot(bc, bp) * per_bc2)));
  const Float4 ab2 = dot(ab, ab), ac2 = dot(ac, ac), abac = dot(ab, ac);
  const Float4 u = (ac2 * along_b - abac * along_c) * per_det, v = (ab2 * along_c - abac * along_b) * per_det;
  const Float4 from_c[3]{ap[0] - u * ab[0], ap[1] - u * ab[1], ap[2] - u * ab[2]};
  const Float4 on_face = squared_residual(from_c, ac, v);
  return (u >= 0) & (v >= 0) & (u + v <= 1) ? lower(on_face, on_edges) : on_edges;
}

float ClosestTriangle::Box::squared_distance(Float4 point) const {
  const Float4 outside = greater(greater(low - point, point - high), Float4{});
  const Float4 squares = outside * outside;
  return squares[0] + squares[1] + squares[2];
}

ClosestTriangle::ClosestTriangle(std::span<const Vec3> vertices, std::span<const Triangle> triangles,
                                 std::span<const std::int32_t> chosen) {
  if (chosen.empty()) return;
  Source source{vertices, triangles, std::vector<Vec3>(triangles.size())};
  for (const std::int32_t t : chosen) {
    const auto [a, b, c] = source.corners(t);
    source.centres[static_cast<std::size_t>(t)] = (a + b + c) / 3;
  }
  std::vector<std::int32_t> order(chosen.begin(), chosen.end());
  boxes_.emplace_back();
  split(source, 0, order);
}

void ClosestTriangle::split(Source& source, std::size_t box, std::span<std::int32_t> chosen) {
  Eigen::AlignedBox3f bounds;
  Eigen::AlignedBox3d middle;
  for (const std::int32_t t : chosen) {
    for (const Vec3& corner : source.corners(t)) bounds.extend(corner.cast<float>());
    middle.extend(source.centre(t));
  }
  for (int axis = 0; axis < 3; ++axis) {
    boxes_[box].low[axis] = bounds.min()[axis];
    boxes_[box].high[axis] = bounds.max()[axis];
  }
  if (chosen.size() <= kLeafTriangles) {
    boxes_[box].child = -1 - static_cast<std::int32_t>(leaves_.size());
    Leaf& leaf = leaves_.emplace_back();
    for (std::size_t lane = 0; lane < kLeafTriangles; ++lane) {  // spare lanes repeat the last triangle
      const std::int32_t t = chosen[std::min(lane, chosen.size() - 1)];
      leaf.set(static_cast<int>(lane), t, source.corners(t));
    }
    return;
  }
  Eigen::Index axis;
  middle.diagonal().maxCoeff(&axis);
  // Left gets whole leaves, so that few lanes are spare.
  const std::size_t half = (chosen.size() / 2 + kLeafTriangles - 1) / kLeafTriangles * kLeafTriangles;
  std::nth_element(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(half), chosen.end(),
                   [&](std::int32_t s, std::int32_t t) {
                     const double x = source.centre(s)[axis], y = source.centre(t)[axis];
                     return x < y || (x == y && s < t);
                   });
  const std::size_t left = boxes_.size();
  boxes_[box].child = static_cast<std::int32_t>(left);
  boxes_.resize(left + 2);
  split(source, left, chosen.first(half));
  split(source, left + 1, chosen.subspan(half));
}

void ClosestTriangle::search_leaf(const Eigen::Vector3f& point, std::int32_t leaf, Hit& best) const {
  const Leaf& candidates = leaves_[static_cast<std::size_t>(leaf)];
  const Float4 distances = candidates.squared_distances(point);
  for (int lane = 0; lane < static_cast<int>(kLeafTriangles); ++lane)
    if (distances[lane] < best.squared_distance) best = {distances[lane], candidates.triangle[lane], leaf};
}

ClosestTriangle::Hit ClosestTriangle::nearest(const Eigen::Vector3f& point, float squared_bound,
                                              std::int32_t leaf) const {
  Hit best{squared_bound, -1, leaf};
  if (leaves_.empty()) return best;
  search_leaf(point, leaf, best);
  const Float4 lanes{point.x(), point.y(), point.z(), 0};
  struct Visit {
    std::int32_t box;
    float squared_distance;
  };
  std::array<Visit, kDeepest> stack;
  std::size_t depth = 0;
  stack[depth++] = {0, boxes_[0].squared_distance(lanes)};
  while (depth > 0) {
    const Visit visit = stack[--depth];
    if (visit.squared_distance >= best.squared_distance) continue;
    const std::int32_t child = boxes_[static_cast<std::size_t>(visit.box)].child;
    if (child < 0) {
      search_leaf(point, -1 - child, best);
      continue;
    }
    Visit near{child, boxes_[static_cast<std::size_t>(child)].squared_distance(lanes)};
    Visit far{child + 1, boxes_[static_cast<std::size_t>(child) + 1].squared_distance(lanes)};
    if (far.squared_distance < near.squared_distance) std::swap(near, far);
    if (far.squared_distance < best.squared_distance) stack[depth++] = far;
    if (near.squared_distance < best.squared_distance) stack[depth++] = near;
  }
  return best;
}

}  // namespace ringlet::solids
