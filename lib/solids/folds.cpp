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

// Whether a test holds for any of [0, count); the rest is not looked at once one has been found.
bool any_of(std::size_t count, const auto& test) {
  std::atomic<bool> found = false;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end() && !found; ++i)
      if (test(i)) found = true;
  });
  return found;
}

bool any_covered(std::span<const Vector3f> vertices, std::span<const Vector3f> normals,
                 const kernels::SolidView& solid, float above) {
  return any_of(vertices.size(), [&](std::size_t v) {
    const Vector3f x = vertices[v] + above * normals[v];
    return kernels::winding_number(solid, kernels::Vector3<float>{x.x(), x.y(), x.z()}) != 0;
  });
}

bool any_pierced(const ClosedSurface& surface, std::span<const Vector3f> vertices,
                 const Crossings& crossings) {
  const auto at = [&](std::int32_t v) -> const Vector3f& { return vertices[static_cast<std::size_t>(v)]; };
  return any_of(surface.triangles.size(), [&](std::size_t t) {
    bool found = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::int32_t from = surface.triangles[t][k], to = surface.triangles[t][(k + 1) % 3];
      if (from > to && surface.neighbours[3 * t + k] >= 0) continue;  // the neighbour looks at it
      crossings.for_each_near(at(from), at(to), [&](std::int32_t other) {
        const Triangle& v = surface.triangles[static_cast<std::size_t>(other)];
        const bool apart = std::ranges::find(v, from) == v.end() && std::ranges::find(v, to) == v.end();
        found = found || (apart && pierces(at(from), at(to), {at(v[0]), at(v[1]), at(v[2])}));
      });
    }
    return found;
  });
}

}  // namespace

void Crossings::build(std::span<const Vector3f> vertices, std::span<const Triangle> triangles) {
  Eigen::AlignedBox2f box;
  for (const Vector3f& v : vertices) box.extend(v.tail<2>());
  // About as many bins as triangles: a ray meets few that it does not cross.
  const float area = std::max(box.volume(), 1e-12f);
  const float edge =
      std::max(std::sqrt(area / static_cast<float>(std::max<std::size_t>(triangles.size(), 1))),
               box.sizes().maxCoeff() / 1024);
  view_.per_metre = 1 / edge;
  for (int axis = 0; axis < 2; ++axis) {
    view_.low[axis] = box.min()[axis];
    view_.count[axis] = static_cast<std::int32_t>(box.sizes()[axis] / edge) + 1;
  }
  const auto for_each_bin_of = [&](const Triangle& t, const auto& visit) {
    Eigen::AlignedBox3f bounds;
    for (const std::int32_t v : t) bounds.extend(vertices[static_cast<std::size_t>(v)]);
    for_each_bin(bounds, visit);
  };
  start_.assign(static_cast<std::size_t>(view_.count[0]) * static_cast<std::size_t>(view_.count[1]) + 1, 0);
  for (const Triangle& t : triangles) for_each_bin_of(t, [&](std::size_t bin) { ++start_[bin + 1]; });
  for (std::size_t bin = 1; bin < start_.size(); ++bin) start_[bin] += start_[bin - 1];
  triangle_.resize(static_cast<std::size_t>(start_.back()));
  std::vector<std::int32_t> next(start_.begin(), start_.end() - 1);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for_each_bin_of(triangles[t], [&](std::size_t bin) {
      triangle_[static_cast<std::size_t>(next[bin]++)] = static_cast<std::int32_t>(t);
    });
}

template <class Visit>
void Crossings::for_each_bin(const Eigen::AlignedBox3f& box, const Visit& visit) const {
  std::int32_t low[2], high[2];
  for (int axis = 0; axis < 2; ++axis) {
    const auto bin = [&](float x) {
      return std::clamp(static_cast<std::int32_t>((x - view_.low[axis]) * view_.per_metre), 0,
                        view_.count[axis] - 1);
    };
    low[axis] = bin(box.min()[axis + 1]), high[axis] = bin(box.max()[axis + 1]);
  }
  for (std::int32_t y = low[0]; y <= high[0]; ++y)
    for (std::int32_t z = low[1]; z <= high[1]; ++z) visit(static_cast<std::size_t>(y * view_.count[1] + z));
}

void Crossings::for_each_near(const Vector3f& a, const Vector3f& b,
                              const std::function<void(std::int32_t)>& visit) const {
  for_each_bin(Eigen::AlignedBox3f(a.cwiseMin(b), a.cwiseMax(b)), [&](std::size_t bin) {
    for (auto k = start_[bin]; k < start_[bin + 1]; ++k) visit(triangle_[static_cast<std::size_t>(k)]);
  });
}

kernels::CrossingsView Crossings::view() const {
  kernels::CrossingsView view = view_;
  view.start = start_.data(), view.triangle = triangle_.data();
  return view;
}

bool has_folds(const ClosedSurface& surface, std::span<const Vector3f> vertices, float voxel_size) {
  Crossings crossings;
  crossings.build(vertices, surface.triangles);
  kernels::SolidView solid{};
  solid.triangles = surface.triangles.front().data();
  solid.vertices = vertices.front().data();
  solid.crossings = crossings.view();
  return any_covered(vertices, vertex_normals(surface, vertices), solid,
                     kernels::kAboveVoxels * voxel_size) ||
         any_pierced(surface, vertices, crossings);
}

}  // namespace ringlet::solids
