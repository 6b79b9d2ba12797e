#include "groom/measure.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "groom/root_tree.h"

namespace ringlet::groom {
namespace {

std::optional<Summary> summary_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const auto quantile = [&](double fraction) {
    const double at = fraction * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(at);
    const double above = values[std::min(below + 1, values.size() - 1)];
    return std::lerp(values[below], above, at - std::floor(at));
  };
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  return Summary{values.front(), mean, quantile(0.5), quantile(0.99), values.back()};
}

// The angle between two vectors over their mean length; nothing where one has no length.
std::optional<double> curvature(const Vec3& before, const Vec3& after) {
  const double a = before.norm(), b = after.norm();
  if (!(a > 0 && b > 0)) return {};
  return std::atan2(before.cross(after).norm(), before.dot(after)) / ((a + b) / 2);
}

std::optional<double> root_density(const Strands& strands) {
  constexpr std::size_t kNeighbours = 8;
  // pi n r^2 of the k-th neighbour of points at random has a gamma distribution; its median is near k - 1/3.
  constexpr double kInCircle = kNeighbours - 1.0 / 3;
  if (strands.size() <= kNeighbours) return {};
  RootCloud cloud;
  for (std::size_t s = 0; s < strands.size(); ++s) cloud.roots.push_back(strands.points[strands.offsets[s]]);
  const RootTree tree(3, cloud);
  std::vector<double> densities;
  for (const Vec3& root : cloud.roots) {
    std::array<std::uint32_t, kNeighbours + 1> nearest;  // the root itself is one of them
    std::array<double, kNeighbours + 1> squared;
    tree.knnSearch(root.data(), nearest.size(), nearest.data(), squared.data());
    densities.push_back(kInCircle / (std::numbers::pi * squared.back()));
  }
  return summary_of(std::move(densities))->median;
}

}  // namespace

Measures measure(const Strands& strands) {
  std::vector<double> lengths, segments, curvatures;
  for (std::size_t s = 0; s < strands.size(); ++s) {
    double length = 0;
    for (auto i = strands.offsets[s] + 1; i < strands.offsets[s + 1]; ++i) {
      const Vec3 segment = strands.points[i] - strands.points[i - 1];
      segments.push_back(segment.norm());
      length += segments.back();
      if (i + 1 == strands.offsets[s + 1]) continue;
      if (const auto bend = curvature(segment, strands.points[i + 1] - strands.points[i]))
        curvatures.push_back(*bend);
    }
    lengths.push_back(length);
  }
  return {summary_of(std::move(lengths)), summary_of(std::move(segments)), summary_of(std::move(curvatures)),
          root_density(strands)};
}

}  // namespace ringlet::groom
