#include "solids/surface_side.h"

#include <algorithm>
#include <cmath>

namespace ringlet::solids {
namespace {

const Vec3& at(std::span<const Vec3> vertices, std::int32_t v) {
  return vertices[static_cast<std::size_t>(v)];
}

// What of a triangle is closest to a point.
struct Closest {
  enum Kind { kVertex, kEdge, kFace } kind;
  std::size_t index;  // the vertex, or the edge from corner `index` to the next one
  Vec3 point;
};

Closest closest_on_edge(const Vec3& point, const std::array<Vec3, 3>& corners, std::size_t edge) {
  const std::size_t next = (edge + 1) % 3;
  const Vec3 along = corners[next] - corners[edge];
  const double length2 = along.squaredNorm(), reach = along.dot(point - corners[edge]);
  if (reach <= 0) return {Closest::kVertex, edge, corners[edge]};
  if (reach >= length2) return {Closest::kVertex, next, corners[next]};
  return {Closest::kEdge, edge, corners[edge] + reach / length2 * along};
}

Closest closest_on_triangle(const Vec3& point, const std::array<Vec3, 3>& corners, const Vec3& normal) {
  bool over_face = true;
  Closest best{Closest::kVertex, 0, corners[0]};
  for (std::size_t edge = 0; edge < 3; ++edge) {
    const Vec3 along = corners[(edge + 1) % 3] - corners[edge];
    over_face = over_face && normal.cross(along).dot(point - corners[edge]) > 0;
    const Closest candidate = closest_on_edge(point, corners, edge);
    if ((candidate.point - point).squaredNorm() < (best.point - point).squaredNorm()) best = candidate;
  }
  if (over_face) return {Closest::kFace, 0, point - normal.dot(point - corners[0]) * normal};
  return best;
}

double angle(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

}  // namespace

SurfaceSide::SurfaceSide(const ClosedSurface& surface, std::span<const Vec3> vertices)
    : surface_(surface), vertices_(vertices), vertex_normals_(vertices.size(), Vec3::Zero()) {
  face_normals_.reserve(surface.triangles.size());
  for (const Triangle& t : surface.triangles) {
    const Vec3 &a = at(vertices, t[0]), &b = at(vertices, t[1]), &c = at(vertices, t[2]);
    const Vec3 normal = (b - a).cross(c - a).stableNormalized();
    face_normals_.push_back(normal);
    vertex_normals_[static_cast<std::size_t>(t[0])] += angle(b - a, c - a) * normal;
    vertex_normals_[static_cast<std::size_t>(t[1])] += angle(c - b, a - b) * normal;
    vertex_normals_[static_cast<std::size_t>(t[2])] += angle(a - c, b - c) * normal;
  }
}

bool SurfaceSide::is_well_wound(std::size_t triangle) const {
  const Triangle& t = surface_.triangles[triangle];
  for (std::size_t c = 0; c < 3; ++c) {
    const std::int32_t neighbour = surface_.neighbours[3 * triangle + c];
    if (neighbour < 0) return false;
    const Triangle& n = surface_.triangles[static_cast<std::size_t>(neighbour)];
    const auto corner = static_cast<std::size_t>(std::find(n.begin(), n.end(), t[(c + 1) % 3]) - n.begin());
    if (n[(corner + 1) % 3] != t[c]) return false;
  }
  return true;
}

std::optional<bool> SurfaceSide::is_inside(const Vec3& point, std::int32_t triangle) const {
  const auto number = static_cast<std::size_t>(triangle);
  if (!is_well_wound(number)) return {};
  const Triangle& t = surface_.triangles[number];
  const std::array<Vec3, 3> corners{at(vertices_, t[0]), at(vertices_, t[1]), at(vertices_, t[2])};
  const Closest closest = closest_on_triangle(point, corners, face_normals_[number]);
  Vec3 normal = face_normals_[number];
  if (closest.kind == Closest::kEdge)
    normal += face_normals_[static_cast<std::size_t>(surface_.neighbours[3 * number + closest.index])];
  if (closest.kind == Closest::kVertex) normal = vertex_normals_[static_cast<std::size_t>(t[closest.index])];
  const double side = normal.dot(point - closest.point);
  if (side == 0) return {};
  return side < 0;
}

}  // namespace ringlet::solids
