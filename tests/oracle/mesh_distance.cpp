#include "oracle/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <utility>

namespace ringlet::oracle {
namespace {

using Vec3 = MeshDistance::Vec3;

constexpr int kLeafTriangles = 4;
constexpr double kDipoleDistance = 3;  // in node radii: from there on a node's solid angle is its dipole's
constexpr double kDoubt = 0.2;         // a winding number this close to 1/2 is summed exactly

Vec3 closest_on_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const double length2 = ab.squaredNorm();
  if (length2 == 0) return a;
  return a + std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) * ab;
}

// The foot of the perpendicular where it lies in the triangle, otherwise the closest point of the three
// edges.
Vec3 closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 normal = (b - a).cross(c - a);
  const bool in_prism = normal.dot((b - a).cross(p - a)) > 0 && normal.dot((c - b).cross(p - b)) > 0 &&
                        normal.dot((a - c).cross(p - c)) > 0;
  if (in_prism) return p - normal * (normal.dot(p - a) / normal.squaredNorm());
  Vec3 best = closest_on_segment(p, a, b);
  for (const Vec3& candidate : {closest_on_segment(p, b, c), closest_on_segment(p, c, a)}) {
    if ((candidate - p).squaredNorm() < (best - p).squaredNorm()) best = candidate;
  }
  return best;
}

}  // namespace

MeshDistance::MeshDistance(std::vector<Vec3> vertices, std::vector<Triangle> triangles)
    : vertices_(std::move(vertices)), triangles_(std::move(triangles)), order_(triangles_.size()) {
  if (triangles_.empty()) throw std::invalid_argument("a mesh needs a triangle");
  for (const Triangle& triangle : triangles_) {
    for (const std::int32_t vertex : triangle) {
      if (vertex < 0 || static_cast<size_t>(vertex) >= vertices_.size()) {
        throw std::invalid_argument("a triangle names a vertex that does not exist");
      }
    }
  }
  std::iota(order_.begin(), order_.end(), 0);
  nodes_.reserve(2 * triangles_.size());
  nodes_.emplace_back();
  build(0, 0, static_cast<int>(order_.size()));
}

void MeshDistance::summarise(Node& node, int begin, int end) const {
  node.lower = Vec3::Constant(std::numeric_limits<double>::infinity());
  node.upper = -node.lower;
  node.area_vector = Vec3::Zero();
  Vec3 weighted = Vec3::Zero();
  double area = 0;
  for (int k = begin; k < end; ++k) {
    const Vec3 a = corner(order_[k], 0), b = corner(order_[k], 1), c = corner(order_[k], 2);
    node.lower = node.lower.cwiseMin(a).cwiseMin(b).cwiseMin(c);
    node.upper = node.upper.cwiseMax(a).cwiseMax(b).cwiseMax(c);
    const Vec3 area_vector = 0.5 * (b - a).cross(c - a);
    node.area_vector += area_vector;
    weighted += area_vector.norm() * (a + b + c) / 3;
    area += area_vector.norm();
  }
  node.centre = area > 0 ? Vec3(weighted / area) : Vec3(0.5 * (node.lower + node.upper));
  node.radius = (node.upper - node.centre).cwiseAbs().cwiseMax((node.centre - node.lower).cwiseAbs()).norm();
}

// Halves the triangles at the median of their centroids along the box's longest side.
void MeshDistance::build(int index, int begin, int end) {
  summarise(nodes_[index], begin, end);
  if (end - begin <= kLeafTriangles) {
    nodes_[index].first = begin;
    nodes_[index].count = end - begin;
    return;
  }
  int axis = 0;
  (nodes_[index].upper - nodes_[index].lower).maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  const auto centroid = [&](int t) { return corner(t, 0)[axis] + corner(t, 1)[axis] + corner(t, 2)[axis]; };
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](int s, int t) { return centroid(s) < centroid(t); });
  const int child = static_cast<int>(nodes_.size());
  nodes_[index].first = child;
  nodes_[index].count = 0;
  nodes_.resize(nodes_.size() + 2);
  build(child, begin, middle);
  build(child + 1, middle, end);
}

MeshDistance::Closest MeshDistance::closest(const Vec3& point) const {
  const auto box_distance2 = [&](int node) {
    const Vec3 outside = (nodes_[node].lower - point).cwiseMax(point - nodes_[node].upper).cwiseMax(0);
    return outside.squaredNorm();
  };
  double best2 = std::numeric_limits<double>::infinity();
  Closest best{best2, point, -1};
  std::vector<std::pair<double, int>> stack{{box_distance2(0), 0}};
  while (!stack.empty()) {
    const auto [distance2, index] = stack.back();
    stack.pop_back();
    if (distance2 >= best2) continue;
    const Node& node = nodes_[index];
    for (int k = node.first; k < node.first + node.count; ++k) {
      const int t = order_[k];
      const Vec3 candidate = closest_on_triangle(point, corner(t, 0), corner(t, 1), corner(t, 2));
      const double candidate2 = (candidate - point).squaredNorm();
      if (candidate2 < best2) {
        best2 = candidate2;
        best = {std::sqrt(candidate2), candidate, t};
      }
    }
    if (node.count == 0) {
      std::pair<double, int> near{box_distance2(node.first), node.first};
      std::pair<double, int> far{box_distance2(node.first + 1), node.first + 1};
      if (far.first < near.first) std::swap(near, far);
      stack.push_back(far);
      stack.push_back(near);
    }
  }
  return best;
}

// Van Oosterom and Strackee 1983: tan(Omega / 2) = a . (b x c) / (|a||b||c| + (a . b)|c| + (b . c)|a| + (c .
// a)|b|).
double MeshDistance::solid_angle(int triangle, const Vec3& point) const {
  const Vec3 a = corner(triangle, 0) - point, b = corner(triangle, 1) - point,
             c = corner(triangle, 2) - point;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

double MeshDistance::winding_number(const Vec3& point) const {
  double sum = 0;
  std::vector<int> stack{0};
  while (!stack.empty()) {
    const Node& node = nodes_[stack.back()];
    stack.pop_back();
    const Vec3 away = node.centre - point;
    const double distance = away.norm();
    if (distance > kDipoleDistance * node.radius) {
      sum += node.area_vector.dot(away) / (distance * distance * distance);
      continue;
    }
    for (int k = node.first; k < node.first + node.count; ++k) sum += solid_angle(order_[k], point);
    if (node.count == 0) {
      stack.push_back(node.first);
      stack.push_back(node.first + 1);
    }
  }
  return sum / (4 * std::numbers::pi);
}

double MeshDistance::exact_winding_number(const Vec3& point) const {
  double sum = 0;
  for (int t = 0; t < static_cast<int>(triangles_.size()); ++t) sum += solid_angle(t, point);
  return sum / (4 * std::numbers::pi);
}

bool MeshDistance::inside(const Vec3& point) const {
  double winding = std::abs(winding_number(point));
  if (std::abs(winding - 0.5) < kDoubt) winding = std::abs(exact_winding_number(point));
  return winding > 0.5;
}

double MeshDistance::signed_distance(const Vec3& point) const {
  const double distance = closest(point).distance;
  return inside(point) ? -distance : distance;
}

}  // namespace ringlet::oracle
