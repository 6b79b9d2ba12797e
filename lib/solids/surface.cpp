#include "solids/surface.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <numeric>
#include <unordered_map>

#include "core/log.h"

namespace ringlet::solids {
namespace {

bool is_degenerate(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

const Vec3& at(std::span<const Vec3> vertices, std::int32_t v) {
  return vertices[static_cast<std::size_t>(v)];
}

// Meshes that meet (a scalp and a face, an eye and its lid) are one surface: vertices at the same place at
// rest count as the first of them. Which moved part a seam then follows does not matter, as long as it stays
// closed.
std::vector<Triangle> join_seams(std::span<const Vec3> vertices, std::span<const Triangle> mesh) {
  struct Hash {
    std::size_t operator()(const std::array<double, 3>& p) const {
      std::size_t h = 0;
      for (const double x : p) h = h * 1000003 + std::hash<double>{}(x);
      return h;
    }
  };
  std::unordered_map<std::array<double, 3>, std::int32_t, Hash> first;
  first.reserve(vertices.size());
  std::vector<std::int32_t> same(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Vec3& x = vertices[v];
    same[v] = first.try_emplace({x.x() + 0.0, x.y() + 0.0, x.z() + 0.0}, static_cast<std::int32_t>(v))
                  .first->second;
  }
  std::vector<Triangle> joined(mesh.begin(), mesh.end());
  for (Triangle& t : joined)
    for (std::int32_t& v : t) v = same[static_cast<std::size_t>(v)];
  return joined;
}

// A boundary edge in the direction of the triangle that has it: its cap's triangle runs the other way.
struct Edge {
  std::int32_t from, to;
};

// The edges that an odd number of triangles use, in the triangles' order.
std::vector<Edge> boundary_edges(std::span<const Triangle> triangles) {
  const auto key = [](const Edge& e) {
    return static_cast<std::uint64_t>(std::min(e.from, e.to)) << 32 |
           static_cast<std::uint32_t>(std::max(e.from, e.to));
  };
  const auto for_each_edge = [&](auto&& visit) {
    for (const Triangle& t : triangles)
      if (!is_degenerate(t))
        for (std::size_t c = 0; c < 3; ++c) visit(Edge{t[c], t[(c + 1) % 3]});
  };
  std::unordered_map<std::uint64_t, int> uses;
  uses.reserve(2 * triangles.size());
  for_each_edge([&](const Edge& e) { ++uses[key(e)]; });
  std::vector<Edge> result;
  for_each_edge([&](const Edge& e) {
    int& count = uses[key(e)];
    if (count % 2 == 1) result.push_back(e), count = 0;
  });
  return result;
}

// Splits edges that meet every vertex an even number of times into loops that meet each vertex once. Each
// loop lists its edges.
std::vector<std::vector<Edge>> find_loops(const std::vector<Edge>& edges) {
  std::unordered_map<std::int32_t, std::vector<std::size_t>> edges_at;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    edges_at[edges[e].from].push_back(e);
    edges_at[edges[e].to].push_back(e);
  }
  std::vector<bool> used(edges.size(), false);
  // The way on from a vertex: an unused edge, rather one that starts there.
  const auto next = [&](std::int32_t vertex) {
    std::size_t found = edges.size();
    for (const std::size_t e : edges_at[vertex])
      if (!used[e] && (found == edges.size() || edges[e].from == vertex)) found = e;
    return found;
  };
  std::vector<std::vector<Edge>> loops;
  for (std::size_t start = 0; start < edges.size(); ++start) {
    std::vector<std::size_t> path;
    std::vector<std::int32_t> visited{edges[start].from};
    std::unordered_map<std::int32_t, std::size_t> position{{edges[start].from, 0}};
    for (std::size_t e = used[start] ? edges.size() : start; e != edges.size(); e = next(visited.back())) {
      used[e] = true;
      path.push_back(e);
      const std::int32_t reached = edges[e].from == visited.back() ? edges[e].to : edges[e].from;
      const auto [seen, is_new] = position.try_emplace(reached, visited.size());
      visited.push_back(reached);
      if (is_new) continue;
      const std::size_t keep = seen->second;
      std::vector<Edge>& loop = loops.emplace_back();
      for (std::size_t i = keep; i < path.size(); ++i) loop.push_back(edges[path[i]]);
      for (std::size_t i = keep + 1; i + 1 < visited.size(); ++i) position.erase(visited[i]);
      path.resize(keep);
      visited.resize(keep + 1);
    }
  }
  return loops;
}

// Across each triangle's edges, corner k to k + 1: the other triangle there; -1 where there is none, or more
// than one.
std::vector<std::int32_t> find_neighbours(const std::vector<Triangle>& triangles) {
  struct Uses {
    std::int32_t side[2] = {-1, -1};  // 3 * triangle + edge
    int count = 0;
  };
  std::unordered_map<std::uint64_t, Uses> edges;
  edges.reserve(2 * triangles.size());
  std::vector<std::int32_t> result(3 * triangles.size(), -1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (is_degenerate(triangles[t])) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::int32_t a = triangles[t][c], b = triangles[t][(c + 1) % 3];
      Uses& uses = edges[static_cast<std::uint64_t>(std::min(a, b)) << 32 |
                         static_cast<std::uint32_t>(std::max(a, b))];
      if (uses.count < 2) uses.side[uses.count] = static_cast<std::int32_t>(3 * t + c);
      ++uses.count;
    }
  }
  for (const auto& [edge, uses] : edges) {
    if (uses.count != 2) continue;
    result[static_cast<std::size_t>(uses.side[0])] = uses.side[1] / 3;
    result[static_cast<std::size_t>(uses.side[1])] = uses.side[0] / 3;
  }
  return result;
}

void cap(ClosedSurface& surface, const std::vector<Edge>& loop) {
  const auto centre = static_cast<std::int32_t>(surface.vertex_count());
  std::vector<std::int32_t>& vertices = surface.loops.emplace_back();
  for (const Edge& e : loop) {
    surface.triangles.push_back({e.to, e.from, centre});
    vertices.push_back(e.from);
    vertices.push_back(e.to);  // twice each: the mean is the same, whichever way the edges run
  }
}

// ---- Parts --------------------------------------------------------------------------------------

// The part (triangles joined through vertices) of each triangle, numbered from 0.
std::vector<std::size_t> parts_of(const std::vector<Triangle>& triangles, std::size_t vertex_count) {
  std::vector<std::size_t> parent(vertex_count);
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto root = [&parent](std::int32_t vertex) {
    auto v = static_cast<std::size_t>(vertex);
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const Triangle& t : triangles) parent[root(t[1])] = root(t[0]), parent[root(t[2])] = root(t[0]);
  std::unordered_map<std::size_t, std::size_t> number;
  std::vector<std::size_t> result;
  for (const Triangle& t : triangles)
    result.push_back(number.try_emplace(root(t[0]), number.size()).first->second);
  return result;
}

struct Part {
  std::vector<std::size_t> triangles;
  double volume = 0;  // signed: positive where it faces outward
};

std::vector<Part> find_parts(const ClosedSurface& surface, std::span<const Vec3> vertices) {
  const std::vector<std::size_t> part_of = parts_of(surface.triangles, vertices.size());
  std::vector<Part> parts(part_of.empty() ? 0 : *std::max_element(part_of.begin(), part_of.end()) + 1);
  for (std::size_t t = 0; t < part_of.size(); ++t) parts[part_of[t]].triangles.push_back(t);
  for (Part& part : parts) {
    const Vec3 origin = at(vertices, surface.triangles[part.triangles.front()][0]);  // keeps the sum's digits
    for (const std::size_t t : part.triangles) {
      const auto& [a, b, c] = surface.triangles[t];
      part.volume +=
          (at(vertices, a) - origin).dot((at(vertices, b) - origin).cross(at(vertices, c) - origin)) / 6;
    }
  }
  return parts;
}

// How often a closed part surrounds a point, by the solid angles of its triangles (van Oosterom and Strackee
// 1983).
double winding_number(const ClosedSurface& surface, std::span<const Vec3> vertices, const Part& part,
                      const Vec3& point) {
  double angle = 0;
  for (const std::size_t t : part.triangles) {
    const Triangle& triangle = surface.triangles[t];
    const Vec3 a = at(vertices, triangle[0]) - point, b = at(vertices, triangle[1]) - point,
               c = at(vertices, triangle[2]) - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4 * std::numbers::pi);
}

bool lies_in_another(const ClosedSurface& surface, std::span<const Vec3> vertices,
                     const std::vector<Part>& parts, const Part& part) {
  const Vec3& point = at(vertices, surface.triangles[part.triangles.front()][0]);
  return std::any_of(parts.begin(), parts.end(), [&](const Part& other) {
    return &other != &part && other.volume > -part.volume &&
           std::abs(winding_number(surface, vertices, other, point)) > 0.5;
  });
}

// A part that faces inward is a hollow's wall where another surrounds it, and otherwise inside out.
void orient_parts(ClosedSurface& surface, std::span<const Vec3> vertices, const std::string& name) {
  surface.bounds_cavity.assign(surface.triangles.size(), false);
  const std::vector<Part> parts = find_parts(surface, vertices);
  std::size_t turned = 0, cavities = 0;
  for (const Part& part : parts) {
    if (part.volume >= 0) continue;
    const bool is_cavity = lies_in_another(surface, vertices, parts, part);
    ++(is_cavity ? cavities : turned);
    for (const std::size_t t : part.triangles) {
      if (is_cavity)
        surface.bounds_cavity[t] = true;
      else
        std::swap(surface.triangles[t][1], surface.triangles[t][2]);
    }
  }
  if (turned > 0)
    log_info(fmt::format("{}: {} of {} closed parts were inside out and have been turned", name, turned,
                         parts.size()));
  if (cavities > 0)
    log_info(fmt::format("{}: {} closed parts are walls of hollows inside it", name, cavities));
}

}  // namespace

void ClosedSurface::follow(std::span<Vec3> vertices) const {
  for (std::size_t i = 0; i < loops.size(); ++i) {
    Vec3 sum = Vec3::Zero();
    for (const std::int32_t v : loops[i]) sum += at(vertices, v);
    vertices[mesh_vertices + i] = sum / static_cast<double>(loops[i].size());
  }
}

ClosedSurface close_surface(const std::string& name, std::span<const Vec3> vertices,
                            std::span<const Triangle> mesh) {
  ClosedSurface surface;
  surface.triangles = join_seams(vertices, mesh);
  surface.mesh_vertices = vertices.size();
  const std::vector<Edge> edges = boundary_edges(surface.triangles);
  for (const std::vector<Edge>& loop : find_loops(edges)) cap(surface, loop);
  if (!edges.empty())
    log_info(fmt::format("{}: the surface is open; {} boundary loops of {} edges in all have been capped",
                         name, surface.loops.size(), edges.size()));
  std::vector<Vec3> all(vertices.begin(), vertices.end());
  all.resize(surface.vertex_count());
  surface.follow(all);
  orient_parts(surface, all, name);
  surface.neighbours = find_neighbours(surface.triangles);
  return surface;
}

}  // namespace ringlet::solids
