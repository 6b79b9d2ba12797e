// A mesh with its openings closed, for winding numbers: the reference's own reading of "each boundary loop by
// a fan about its centroid". Loops that touch are one.
#pragma once
#include <algorithm>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include "oracle/mesh_distance.h"

namespace ringlet::oracle {

inline MeshDistance with_openings_closed(std::vector<MeshDistance::Vec3> vertices,
                                         std::vector<MeshDistance::Triangle> triangles) {
  // Vertices at one place are one vertex.
  std::map<std::array<double, 3>, std::int32_t> at_place;
  std::vector<std::int32_t> joined;
  for (const auto& v : vertices)
    joined.push_back(
        at_place.try_emplace({v.x(), v.y(), v.z()}, static_cast<std::int32_t>(joined.size())).first->second);
  // Boundary edges belong to an odd number of triangles; the last to name one gives its direction.
  std::map<std::pair<std::int32_t, std::int32_t>, std::pair<int, std::pair<std::int32_t, std::int32_t>>>
      edges;
  for (const auto& t : triangles) {
    const std::int32_t v[3] = {joined[t[0]], joined[t[1]], joined[t[2]]};
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
    for (int k = 0; k < 3; ++k) {
      auto& edge = edges[std::minmax(v[k], v[(k + 1) % 3])];
      ++edge.first, edge.second = {v[k], v[(k + 1) % 3]};
    }
  }
  std::erase_if(edges, [](const auto& edge) { return edge.second.first % 2 == 0; });
  // Loops: vertices that edges join, each named by its least.
  std::vector<std::int32_t> loop(vertices.size());
  std::iota(loop.begin(), loop.end(), 0);
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [ends, edge] : edges) {
      const std::int32_t least = std::min(loop[ends.first], loop[ends.second]);
      changed = changed || loop[ends.first] != least || loop[ends.second] != least;
      loop[ends.first] = loop[ends.second] = least;
    }
  }
  std::map<std::int32_t, std::pair<MeshDistance::Vec3, int>> sums;
  for (const auto& [ends, edge] : edges) {
    auto& [sum, count] = sums.try_emplace(loop[ends.first], MeshDistance::Vec3::Zero(), 0).first->second;
    sum += vertices[ends.first] + vertices[ends.second], count += 2;
  }
  std::map<std::int32_t, std::int32_t> centre;
  for (const auto& [name, sum] : sums) {
    centre[name] = static_cast<std::int32_t>(vertices.size());
    vertices.push_back(sum.first / sum.second);
  }
  for (const auto& [ends, edge] : edges)
    triangles.push_back({edge.second.second, edge.second.first, centre[loop[ends.first]]});
  return {std::move(vertices), std::move(triangles)};
}

}  // namespace ringlet::oracle
