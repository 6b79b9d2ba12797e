#include "effects/wind/shelter_map.h"

#include <algorithm>
#include <cmath>

namespace ringlet::effects {

void ShelterMap::draw(std::span<const Vec3> vertices, std::span<const Triangle> triangles, const Vec3& wind) {
  const Vec3 along = wind.normalized(), right = along.unitOrthogonal();
  axes_ << right.transpose(), along.cross(right).transpose(), along.transpose();
  std::vector<Vec3> seen(vertices.size());
  Eigen::AlignedBox3d box;
  for (std::size_t v = 0; v < seen.size(); ++v) box.extend(seen[v] = axes_ * vertices[v]);
  const Vec3 size = box.sizes();
  cell_ = std::max({size.x(), size.y(), 1e-9}) / kCells;
  columns_ = static_cast<int>(size.x() / cell_) + 1, rows_ = static_cast<int>(size.y() / cell_) + 1;
  origin_ = Vec3(box.min().x() + 0.5 * cell_, box.min().y() + 0.5 * cell_, 0);
  front_.assign(static_cast<std::size_t>(columns_) * rows_, std::numeric_limits<float>::infinity());
  rear_.assign(front_.size(), -std::numeric_limits<float>::infinity());
  for (Vec3& v : seen) {
    v = (v - origin_).cwiseProduct(Vec3(1 / cell_, 1 / cell_, 1));  // in cells, and the depth in metres
    // Triangles smaller than a cell may lie between the middles of all.
    mark(static_cast<int>(std::lround(v.x())), static_cast<int>(std::lround(v.y())), v.z());
  }
  for (const Triangle& t : triangles) draw_triangle(seen[t[0]], seen[t[1]], seen[t[2]]);
}

void ShelterMap::reserve() {
  constexpr std::size_t kMost = std::size_t{kCells + 1} * (kCells + 1);
  front_.reserve(kMost), rear_.reserve(kMost);
}

void ShelterMap::mark(int column, int row, double depth) {
  if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return;
  const std::size_t cell = static_cast<std::size_t>(row) * columns_ + column;
  front_[cell] = std::min(front_[cell], static_cast<float>(depth));
  rear_[cell] = std::max(rear_[cell], static_cast<float>(depth));
}

// The cells whose middles lie in the triangle.
void ShelterMap::draw_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const auto side = [](const Vec3& p, const Vec3& q, double x, double y) {
    return (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
  };
  const double area = side(a, b, c.x(), c.y());
  if (area == 0) return;
  const auto [left, right] = std::minmax({a.x(), b.x(), c.x()});
  const auto [low, high] = std::minmax({a.y(), b.y(), c.y()});
  for (int row = static_cast<int>(std::ceil(low)); row <= high; ++row)
    for (int column = static_cast<int>(std::ceil(left)); column <= right; ++column) {
      const double u = side(b, c, column, row) / area, v = side(c, a, column, row) / area, w = 1 - u - v;
      if (u >= 0 && v >= 0 && w >= 0) mark(column, row, u * a.z() + v * b.z() + w * c.z());
    }
}

kernels::ShelterMap ShelterMap::view() const {
  kernels::ShelterMap map{};
  const Vec3 world = axes_.transpose() * origin_;
  for (int c = 0; c < 3; ++c) {
    map.origin[c] = world[c];
    map.right[c] = static_cast<float>(axes_(0, c));
    map.up[c] = static_cast<float>(axes_(1, c));
    map.wind[c] = static_cast<float>(axes_(2, c));
  }
  map.per_cell = static_cast<float>(1 / cell_);
  map.columns = columns_, map.rows = rows_;
  map.front = front_.data(), map.rear = rear_.data();
  return map;
}

}  // namespace ringlet::effects
