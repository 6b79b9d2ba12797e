#include "groom/scalp.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/error.h"
#include "core/random.h"

namespace ringlet::groom {

double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
double length(const Vec3& a) { return std::sqrt(dot(a, a)); }

Vec3 area_vector(const Scalp& scalp, const Triangle& triangle) {
  const Vec3& origin = scalp.vertices[triangle[0]];
  return (scalp.vertices[triangle[1]] - origin).cross(scalp.vertices[triangle[2]] - origin);
}

namespace {
void check_mesh_exists(const Scalp& scalp, const std::string& name) {
  if (std::find(scalp.mesh_names.begin(), scalp.mesh_names.end(), name) != scalp.mesh_names.end()) return;
  throw Error(ErrorKind::kInput, "/scalp/mesh", fmt::format("the head has no mesh \"{}\"", name),
              fmt::format("it has: {}", fmt::join(scalp.mesh_names, ", ")));
}

bool inside(const std::array<Vec3, 2>& box, const Vec3& point) {
  return (point.array() >= box[0].array()).all() && (point.array() <= box[1].array()).all();
}
}  // namespace

std::vector<std::int32_t> select_triangles(const Scalp& scalp, const scene::ScalpSelection& selection) {
  if (selection.mesh) check_mesh_exists(scalp, *selection.mesh);
  const double least_cosine = cos_sin(selection.max_angle)[0];
  std::vector<std::int32_t> selected;
  for (std::size_t t = 0; t < scalp.triangles.size(); ++t) {
    const Triangle& triangle = scalp.triangles[t];
    const Vec3 area = area_vector(scalp, triangle);
    const double size = length(area);
    const Vec3 centroid =
        (scalp.vertices[triangle[0]] + scalp.vertices[triangle[1]] + scalp.vertices[triangle[2]]) / 3;
    if (!(size > 0)) continue;
    if (selection.mesh && scalp.mesh_names[scalp.mesh_of_triangle[t]] != *selection.mesh) continue;
    if (selection.box && !inside(*selection.box, centroid)) continue;
    if (selection.direction &&
        dot(area, *selection.direction) < least_cosine * size * length(*selection.direction)) {
      continue;
    }
    selected.push_back(static_cast<std::int32_t>(t));
  }
  if (selected.empty()) {
    throw Error(ErrorKind::kInput, "/scalp",
                fmt::format("selects none of the head's {} triangles", scalp.triangles.size()),
                "widen the box or the angle, or check the scene's units and up axis");
  }
  return selected;
}

std::vector<Vec3> vertex_normals(const Scalp& scalp) {
  std::vector<std::int32_t> order(scalp.vertices.size());
  std::iota(order.begin(), order.end(), 0);
  const auto less = [&](std::int32_t a, std::int32_t b) {
    const Vec3 &p = scalp.vertices[a], &q = scalp.vertices[b];
    return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
  };
  std::sort(order.begin(), order.end(),
            [&](std::int32_t a, std::int32_t b) { return less(a, b) || (!less(b, a) && a < b); });
  std::vector<std::int32_t> first(order.size());  // of the vertices at each vertex's position
  for (std::size_t i = 0; i < order.size(); ++i) {
    first[order[i]] = i > 0 && !less(order[i - 1], order[i]) ? first[order[i - 1]] : order[i];
  }
  std::vector<Vec3> normals(scalp.vertices.size(), Vec3::Zero());
  for (const Triangle& triangle : scalp.triangles) {
    const Vec3 area = area_vector(scalp, triangle);
    for (const std::int32_t vertex : triangle) normals[first[vertex]] += area;
  }
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (first[i] != static_cast<std::int32_t>(i)) continue;
    const double size = length(normals[i]);
    if (size > 0) normals[i] /= size;
  }
  for (std::size_t i = 0; i < normals.size(); ++i) normals[i] = normals[first[i]];
  return normals;
}

}  // namespace ringlet::groom
