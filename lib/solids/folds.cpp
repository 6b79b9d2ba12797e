#include "solids/folds.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "kernels/solid/surface.h"

namespace ringlet::solids {
namespace {

using Vector3f = Eigen::Vector3f;

// A solid no thicker than this, in voxels, is thin: the triangles closest to the voxels about a point in it
// may all be of one side.
constexpr float kThinVoxels = 1.5f;

std::vector<Vector3f> vertex_normals(const ClosedSurface& surface, std::span<const Vector3f> vertices) {
  std::vector<Vector3f> normals(vertices.size(), Vector3f::Zero());
  for (const Triangle& t : surface.triangles) {
    const Vector3f &a = vertices[static_cast<std::size_t>(t[0])],
                   &b = vertices[static_cast<std::size_t>(t[1])],
                   &c = vertices[static_cast<std::size_t>(t[2])];
    const Vector3f area = (b - a).cross(c - a);
    for (const std::int32_t v : t) normals[static_cast<std::size_t>(v)] += area;
  }
  for (Vector3f& n : normals) n.normalize();  // one without length stays
  return normals;
}

// Whether the edge passes through the triangle's inner part.
bool pierces(const Vector3f& from, const Vector3f& to, const std::array<Vector3f, 3>& corners) {
  const Vector3f way = to - from, a = corners[0] - from, b = corners[1] - from, c = corners[2] - from;
  const float ab = way.dot(a.cross(b)), bc = way.dot(b.cross(c)), ca = way.dot(c.cross(a));
  const bool through = (ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0);
  if (!through) return false;
  const Vector3f normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  return (normal.dot(a) > 0) != (normal.dot(corners[0] - to) > 0);
}

using Marks = std::vector<std::atomic<unsigned char>>;

// Calls visit(i) for all of [0, count), many at a time.
void for_all(std::size_t count, const auto& visit) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) visit(i);
  });
}

// By vertices: those that another part covers, and those under which the solid is thin.
void mark_by_vertices(const ClosedSurface& surface, std::span<const Vector3f> vertices,
                      const Crossings& crossings, float voxel_size, Marks& folded) {
  kernels::SolidView solid{};
  solid.triangles = surface.triangles.front().data();
  solid.vertices = vertices.front().data();
  solid.crossings = crossings.view();
  const auto is_inside = [&](const Vector3f& x) {
    return kernels::winding_number(solid, kernels::Vector3<float>{x.x(), x.y(), x.z()}) != 0;
  };
  const std::vector<Vector3f> normals = vertex_normals(surface, vertices);
  std::vector<unsigned char> found(vertices.size());
  for_all(vertices.size(), [&](std::size_t v) {
    const bool covered = is_inside(vertices[v] + kernels::kAboveVoxels * voxel_size * normals[v]);
    found[v] = covered || !is_inside(vertices[v] - kThinVoxels * voxel_size * normals[v]);
  });
  for_all(folded.size(), [&](std::size_t t) {
    for (const std::int32_t v : surface.triangles[t])
      if (found[static_cast<std::size_t>(v)]) folded[t] = 1;
  });
}

void mark_pierced(const ClosedSurface& surface, std::span<const Vector3f> vertices,
                  const Crossings& crossings, Marks& folded) {
  const auto at = [&](std::int32_t v) -> const Vector3f& { return vertices[static_cast<std::size_t>(v)]; };
  for_all(folded.size(), [&](std::size_t t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = surface.triangles[t][k], to = surface.triangles[t][(k + 1) % 3];
      if (from > to && surface.neighbours[3 * t + k] >= 0) continue;  // the neighbour looks at it
      crossings.for_each_near(at(from), at(to), [&](std::int32_t other) {
        const Triangle& v = surface.triangles[static_cast<std::size_t>(other)];
        if (std::ranges::find(v, from) != v.end() || std::ranges::find(v, to) != v.end()) return;
        if (pierces(at(from), at(to), {at(v[0]), at(v[1]), at(v[2])}))
          folded[t] = 1, folded[static_cast<std::size_t>(other)] = 1;
      });
    }
  });
}

}  // namespace

void Crossings::lay_out(const Eigen::AlignedBox2f& box, float edge) {
  view_.per_metre = 1 / edge;
  for (int axis = 0; axis < 2; ++axis) {
    view_.low[axis] = box.min()[axis];
    view_.count[axis] = static_cast<std::int32_t>(box.sizes()[axis] / edge) + 1;
  }
}

Crossings::Range Crossings::range_of(const Eigen::AlignedBox3f& box) const {
  Range range;
  for (int axis = 0; axis < 2; ++axis) {
    const auto bin = [&](float x) {
      return std::clamp(static_cast<std::int32_t>((x - view_.low[axis]) * view_.per_metre), 0,
                        view_.count[axis] - 1);
    };
    range.low[axis] = bin(box.min()[axis + 1]), range.high[axis] = bin(box.max()[axis + 1]);
  }
  return range;
}

template <class Visit>
void Crossings::for_each_bin(const Range& range, const Visit& visit) const {
  for (std::int32_t y = range.low[0]; y <= range.high[0]; ++y)
    for (std::int32_t z = range.low[1]; z <= range.high[1]; ++z)
      visit(static_cast<std::size_t>(y * view_.count[1] + z));
}

void Crossings::build(std::span<const Vector3f> vertices, std::span<const Triangle> triangles) {
  constexpr std::size_t kMostEntries = 32;  // for each triangle, on average: long slivers lie in many bins
  Eigen::AlignedBox2f bounds;
  for (const Vector3f& v : vertices) bounds.extend(v.tail<2>());
  std::vector<Eigen::AlignedBox3f> boxes(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::int32_t v : triangles[t]) boxes[t].extend(vertices[static_cast<std::size_t>(v)]);
  // About as many bins as triangles, so that a ray meets few that it does not cross.
  const float area =
      std::max(bounds.volume(), 1e-12f) / static_cast<float>(std::max<std::size_t>(boxes.size(), 1));
  for (float edge = std::max(std::sqrt(area), bounds.sizes().maxCoeff() / 1024);; edge *= 2) {
    lay_out(bounds, edge);
    std::size_t entries = 0;
    for (const auto& box : boxes) entries += range_of(box).size();
    if (entries <= kMostEntries * boxes.size() || view_.count[0] * view_.count[1] == 1) break;
  }
  start_.assign(static_cast<std::size_t>(view_.count[0]) * static_cast<std::size_t>(view_.count[1]) + 1, 0);
  for (const auto& box : boxes) for_each_bin(range_of(box), [&](std::size_t bin) { ++start_[bin + 1]; });
  for (std::size_t bin = 1; bin < start_.size(); ++bin) start_[bin] += start_[bin - 1];
  triangle_.resize(static_cast<std::size_t>(start_.back()));
  std::vector<std::int32_t> next(start_.begin(), start_.end() - 1);
  for (std::size_t t = 0; t < boxes.size(); ++t)
    for_each_bin(range_of(boxes[t]), [&](std::size_t bin) {
      triangle_[static_cast<std::size_t>(next[bin]++)] = static_cast<std::int32_t>(t);
    });
}

void Crossings::for_each_near(const Vector3f& a, const Vector3f& b,
                              const std::function<void(std::int32_t)>& visit) const {
  for_each_bin(range_of({a.cwiseMin(b), a.cwiseMax(b)}), [&](std::size_t bin) {
    for (auto k = start_[bin]; k < start_[bin + 1]; ++k) visit(triangle_[static_cast<std::size_t>(k)]);
  });
}

kernels::CrossingsView Crossings::view() const {
  kernels::CrossingsView view = view_;
  view.start = start_.data(), view.triangle = triangle_.data();
  return view;
}

std::vector<std::int32_t> folded_triangles(const ClosedSurface& surface, std::span<const Vector3f> vertices,
                                           float voxel_size) {
  Crossings crossings;
  crossings.build(vertices, surface.triangles);
  Marks folded(surface.triangles.size());
  mark_by_vertices(surface, vertices, crossings, voxel_size, folded);
  mark_pierced(surface, vertices, crossings, folded);
  std::vector<std::int32_t> result;
  for (std::size_t t = 0; t < folded.size(); ++t)
    if (folded[t]) result.push_back(static_cast<std::int32_t>(t));
  return result;
}

void mark_tiles(const kernels::LevelSetView& level_set, std::span<const Vector3f> vertices,
                std::span<const Triangle> triangles, std::span<const std::int32_t> chosen,
                std::vector<unsigned char>& tiles) {
  const auto count = [&](int axis) { return static_cast<std::size_t>(level_set.tile_count[axis]); };
  tiles.assign(count(0) * count(1) * count(2), 0);
  const float per_tile = 1 / (8 * level_set.voxel_size);
  const Vector3f margin = Vector3f::Constant(2 * level_set.voxel_size);
  for (const std::int32_t t : chosen) {
    Eigen::AlignedBox3f box;
    for (const std::int32_t v : triangles[static_cast<std::size_t>(t)])
      box.extend(vertices[static_cast<std::size_t>(v)]);
    int low[3], high[3];
    for (int axis = 0; axis < 3; ++axis) {
      const auto tile = [&](float x) {
        return std::clamp(static_cast<int>(std::floor(x * per_tile)) - level_set.tile_min[axis], 0,
                          level_set.tile_count[axis] - 1);
      };
      low[axis] = tile(box.min()[axis] - margin[axis]), high[axis] = tile(box.max()[axis] + margin[axis]);
    }
    for (int x = low[0]; x <= high[0]; ++x)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int z = low[2]; z <= high[2]; ++z)
          tiles[(static_cast<std::size_t>(x) * count(1) + static_cast<std::size_t>(y)) * count(2) +
                static_cast<std::size_t>(z)] = 1;
  }
}

}  // namespace ringlet::solids
