#include "groom/untangle.h"

#include <algorithm>
#include <array>

namespace ringlet::groom {

namespace {

constexpr double kSmoothing = 0.3;                // of displacements, from sweep to sweep
constexpr int kSweeps = 100, kSmoothSweeps = 60;  // of a round, and with smoothing
constexpr double kShrink = 0.25;                  // what edges may shrink to from the scalp outward
constexpr double kDamping = 0.02;                 // of a vertex's step, relative to the trace of its system

// A corner tetrahedron: det(a - o, b - o, top - bottom), where o is one of bottom and top.
struct Corner {
  std::size_t origin, a, b, bottom, top;  // positions
  double scale;                           // [m^3] of its edges at the start
};

double shape(const Corner& corner, const std::vector<Vec3>& x) {
  const Vec3& o = x[corner.origin];
  return (x[corner.a] - o).cross(x[corner.b] - o).dot(x[corner.top] - x[corner.bottom]) / corner.scale;
}

// Of the shape by one of its vertices.
Vec3 gradient(const Corner& corner, std::size_t vertex, const std::vector<Vec3>& x) {
  const Vec3 a = x[corner.a] - x[corner.origin], b = x[corner.b] - x[corner.origin],
             rise = x[corner.top] - x[corner.bottom];
  Vec3 sum = Vec3::Zero();
  if (vertex == corner.a || vertex == corner.origin) sum += (vertex == corner.a ? 1 : -1) * b.cross(rise);
  if (vertex == corner.b || vertex == corner.origin) sum += (vertex == corner.b ? 1 : -1) * rise.cross(a);
  if (vertex == corner.top || vertex == corner.bottom) sum += (vertex == corner.top ? 1 : -1) * a.cross(b);
  return sum / corner.scale;
}

std::array<std::size_t, 4> vertices_of(const Corner& corner) {
  return {corner.origin, corner.a, corner.b, corner.origin == corner.bottom ? corner.top : corner.bottom};
}

std::vector<Corner> corners_of(const HairMesh& mesh) {
  std::vector<Corner> corners;
  const std::size_t n = mesh.vertices();
  for (const HairMesh::Face& face : mesh.faces) {
    const int count = HairMesh::corners(face);
    for (int layer = 0; layer + 1 < mesh.layers; ++layer) {
      for (int c = 0; c < count; ++c) {
        const auto at = [&](int corner, int k) {
          return k * n + static_cast<std::size_t>(face[corner % count]);
        };
        for (const int k : {layer, layer + 1})
          corners.push_back(
              {at(c, k), at(c + 1, k), at(c + count - 1, k), at(c, layer), at(c, layer + 1), 0});
      }
    }
  }
  for (Corner& corner : corners) {
    const auto& x = mesh.positions;
    const auto length = [&](std::size_t from, std::size_t to) {
      return std::max((x[to] - x[from]).norm(), kShrink * (x[to % n] - x[from % n]).norm());
    };
    corner.scale = length(corner.origin, corner.a) * length(corner.origin, corner.b) *
                   (x[corner.top] - x[corner.bottom]).norm();
  }
  return corners;
}

// The vertices next to each: along the edges of its layer, and twice each, because there are fewer, above and
// below.
std::vector<std::vector<std::size_t>> neighbours_of(const HairMesh& mesh) {
  const std::size_t n = mesh.vertices();
  std::vector<std::vector<std::size_t>> neighbours(mesh.positions.size());
  for (int k = 0; k < mesh.layers; ++k) {
    for (const HairMesh::Face& face : mesh.faces) {
      const int count = HairMesh::corners(face);
      for (int c = 0; c < count; ++c) {
        const std::size_t a = k * n + face[c], b = k * n + face[(c + 1) % count];
        neighbours[a].push_back(b);
        neighbours[b].push_back(a);
      }
    }
  }
  for (std::size_t below = 0; below + n < mesh.positions.size(); ++below) {
    neighbours[below].insert(neighbours[below].end(), 2, below + n);
    neighbours[below + n].insert(neighbours[below + n].end(), 2, below);
  }
  return neighbours;
}

class Untangler {
 public:
  Untangler(HairMesh& mesh, double least, const std::function<void(Vec3&)>& keep_clear)
      : x_(mesh.positions),
        fixed_(mesh.vertices()),
        least_(least),
        keep_clear_(keep_clear),
        start_(x_),
        corners_(corners_of(mesh)),
        of_vertex_(x_.size()),
        neighbours_(neighbours_of(mesh)) {
    for (std::size_t i = 0; i < corners_.size(); ++i)
      for (const std::size_t vertex : vertices_of(corners_[i]))
        of_vertex_[vertex].push_back(static_cast<std::uint32_t>(i));
  }

  bool is_done() const {
    return std::all_of(corners_.begin(), corners_.end(),
                       [&](const Corner& corner) { return shape(corner, x_) >= least_ / 2; });
  }

  void smooth() {
    std::vector<Vec3> smoothed = x_;
    for (std::size_t v = fixed_; v < x_.size(); ++v) {
      Vec3 mean = Vec3::Zero();
      for (const std::size_t other : neighbours_[v])
        mean += (x_[other] - start_[other]) / static_cast<double>(neighbours_[v].size());
      smoothed[v] = start_[v] + (1 - kSmoothing) * (x_[v] - start_[v]) + kSmoothing * mean;
      keep_clear_(smoothed[v]);
    }
    x_ = std::move(smoothed);
  }

  void sweep() {
    for (std::size_t vertex = fixed_; vertex < x_.size(); ++vertex)
      if (energy(vertex) > 0) relax(vertex);
  }

 private:
  double missing(std::uint32_t corner) const { return std::max(0.0, least_ - shape(corners_[corner], x_)); }

  double energy(std::size_t vertex) const {
    double sum = 0;
    for (const std::uint32_t i : of_vertex_[vertex]) sum += missing(i) * missing(i);
    return sum;
  }

  void relax(std::size_t vertex) {
    Mat3 normal = Mat3::Zero();
    Vec3 right = Vec3::Zero();
    for (const std::uint32_t i : of_vertex_[vertex]) {
      if (!(missing(i) > 0)) continue;
      const Vec3 slope = gradient(corners_[i], vertex, x_);
      normal += slope * slope.transpose();
      right += missing(i) * slope;
    }
    normal.diagonal().array() += kDamping * normal.trace();
    const double before = energy(vertex);
    const Vec3 from = x_[vertex];
    Vec3 step = normal.ldlt().solve(right);
    for (int halving = 0; halving < 8; ++halving, step /= 2) {  // corners that close meanwhile count too
      x_[vertex] = from + step;
      keep_clear_(x_[vertex]);
      if (energy(vertex) < before) return;
    }
    x_[vertex] = from;
  }

  std::vector<Vec3>& x_;
  std::size_t fixed_;
  double least_;
  const std::function<void(Vec3&)>& keep_clear_;
  std::vector<Vec3> start_;
  std::vector<Corner> corners_;
  std::vector<std::vector<std::uint32_t>> of_vertex_;
  std::vector<std::vector<std::size_t>> neighbours_;
};

}  // namespace

void untangle(HairMesh& mesh, double least, int rounds, const std::function<void(Vec3&)>& keep_clear) {
  Untangler untangler(mesh, least, keep_clear);
  for (int sweep = 0; sweep < rounds * kSweeps && !untangler.is_done(); ++sweep) {
    if (sweep > 0 && sweep % kSweeps < kSmoothSweeps) untangler.smooth();
    untangler.sweep();
  }
}

}  // namespace ringlet::groom
