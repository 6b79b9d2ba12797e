#include "solids/mesh_distance.h"

#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "core/log.h"
#include "kernels/solid/surface.h"
#include "solids/mesh.h"

namespace ringlet::solids {
namespace {

Vec3 middle_of(std::span<const Vec3> vertices) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : vertices) box.extend(v);
  return box.center();
}

std::vector<Eigen::Vector3f> about(const Vec3& origin, const ClosedSurface& surface,
                                   std::span<const Vec3> mesh) {
  std::vector<Vec3> vertices(mesh.begin(), mesh.end());
  vertices.resize(surface.vertex_count());
  surface.follow(vertices);
  std::vector<Eigen::Vector3f> result;
  for (const Vec3& v : vertices) result.push_back((v - origin).cast<float>());
  return result;
}

ClosestTriangle tree_over(const std::vector<Eigen::Vector3f>& vertices,
                          const std::vector<Triangle>& triangles) {
  std::vector<Vec3> points;
  for (const Eigen::Vector3f& v : vertices) points.push_back(v.cast<double>());
  std::vector<std::int32_t> all(triangles.size());
  std::iota(all.begin(), all.end(), 0);
  return {points, triangles, all};
}

bool encloses_volume(const std::vector<Eigen::Vector3f>& vertices, const std::vector<Triangle>& triangles) {
  constexpr double kFlat = 1e-6;  // of the volume that its triangles reach over
  double volume = 0, reach = 0;
  for (const Triangle& t : triangles) {
    const auto at = [&](std::size_t k) {
      return Vec3(vertices[static_cast<std::size_t>(t[k])].cast<double>());
    };
    volume += at(0).dot(at(1).cross(at(2)));
    reach += at(0).norm() * (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
  return volume > kFlat * reach;
}

}  // namespace

MeshDistance::MeshDistance(const std::string& name, std::span<const Vec3> vertices,
                           std::span<const Triangle> triangles)
    : surface_(close_surface(name, vertices, triangles)),
      origin_(middle_of(vertices)),
      vertices_(about(origin_, surface_, vertices)),
      nearest_(tree_over(vertices_, surface_.triangles)) {
  if (!encloses_volume(vertices_, surface_.triangles))
    log_warning(name + ": the surface encloses no volume; nothing is inside it");
  crossings_.build(vertices_, surface_.triangles);
  view_.triangles = surface_.triangles.front().data();
  view_.neighbours = surface_.neighbours.data();
  view_.triangle_count = static_cast<std::int32_t>(surface_.triangles.size());
  view_.vertices = view_.vertices_before = vertices_.front().data();
  view_.crossings = crossings_.view();
}

// The tree's triangle is the closest to single precision; a walk from there finds the one that is.
double MeshDistance::operator()(const Vec3& point) const {
  const Vec3 local = point - origin_;
  const kernels::Vector3<double> p{local.x(), local.y(), local.z()};
  const auto hit = nearest_.nearest(local.cast<float>(), std::numeric_limits<float>::infinity());
  auto closest = kernels::closest_on_triangle(view_, hit.triangle, p);
  kernels::walk(view_, p, closest);
  const double away = std::sqrt(closest.distance2);
  return kernels::winding_number(view_, p) != 0 ? -away : away;
}

std::function<double(const Vec3&)> distance_to(const scene::MeshDesc& desc, const scene::Units& units) {
  const AnimatedMesh mesh(desc, units, {1, 1, 24, 0});
  const auto distance =
      std::make_shared<MeshDistance>(desc.file.string(), mesh.rest_vertices(), mesh.triangles());
  return [distance](const Vec3& point) { return (*distance)(point); };
}

}  // namespace ringlet::solids
