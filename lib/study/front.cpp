#include "study/front.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace ringlet::study {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool usable(const Point& point) { return std::isfinite(point.milliseconds) && std::isfinite(point.error); }

bool quicker(const Point& a, const Point& b) {
  return a.milliseconds != b.milliseconds ? a.milliseconds < b.milliseconds : a.error < b.error;
}

}  // namespace

std::vector<std::size_t> pareto_front(const std::vector<Point>& points) {
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::erase_if(order, [&](std::size_t k) { return !usable(points[k]); });
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return quicker(points[a], points[b]); });
  std::vector<std::size_t> front;
  for (const std::size_t k : order)
    if (front.empty() || points[k].error < kGain * points[front.back()].error) front.push_back(k);
  return front;
}

std::optional<std::size_t> dominating(const std::vector<Point>& points, const std::vector<std::size_t>& front,
                                      std::size_t point) {
  std::optional<std::size_t> best;
  if (std::find(front.begin(), front.end(), point) != front.end()) return best;
  for (const std::size_t k : front)
    if (points[k].milliseconds <= points[point].milliseconds &&
        kGain * points[k].error <= points[point].error)
      best = k;
  return best;
}

std::optional<std::size_t> knee(const std::vector<Point>& points, const std::vector<std::size_t>& front) {
  std::vector<std::size_t> positive;
  for (const std::size_t k : front)
    if (points[k].error > 0 && points[k].milliseconds > 0) positive.push_back(k);
  if (positive.size() < 3) return std::nullopt;
  const Point &first = points[positive.front()], &last = points[positive.back()];
  std::optional<std::size_t> found;
  double deepest = 1e-9;  // of the extents: rounding is no knee
  for (const std::size_t k : positive) {
    const double along = std::log(points[k].milliseconds / first.milliseconds) /
                         std::log(last.milliseconds / first.milliseconds);
    const double down = std::log(points[k].error / first.error) / std::log(last.error / first.error);
    if (down - along > deepest) deepest = down - along, found = k;
  }
  return found;
}

std::optional<double> digit_cost(const std::vector<Point>& points, const std::vector<std::size_t>& front) {
  constexpr double kLeast = 0.05;  // digits
  double n = 0, x = 0, y = 0, xx = 0, xy = 0, fewest = kInfinity, most = -kInfinity;
  for (const std::size_t k : front) {
    if (!(points[k].error > 0) || !(points[k].milliseconds > 0)) continue;
    const double digits = -std::log10(points[k].error), time = std::log10(points[k].milliseconds);
    fewest = std::min(fewest, digits), most = std::max(most, digits);
    n += 1, x += digits, y += time, xx += digits * digits, xy += digits * time;
  }
  const double spread = n * xx - x * x;
  if (n < 2 || !(spread > 0) || !(most - fewest >= kLeast)) return std::nullopt;
  return std::pow(10.0, (n * xy - x * y) / spread);
}

std::optional<double> digit_cost(const Point& from, const Point& to) {
  return digit_cost({from, to}, {0, 1});
}

std::vector<double> orders(const std::vector<double>& values, const std::vector<double>& errors) {
  std::vector<double> result;
  for (std::size_t k = 0; k + 1 < values.size(); ++k) {
    const bool known = errors[k] > 0 && errors[k + 1] > 0 && values[k] > 0 && values[k + 1] > values[k];
    result.push_back(known ? std::log(errors[k] / errors[k + 1]) / std::log(values[k + 1] / values[k])
                           : kNone);
  }
  return result;
}

std::optional<std::size_t> pick(const std::vector<Point>& points, const Wanted& wanted) {
  std::optional<std::size_t> best;
  for (std::size_t k = 0; k < points.size(); ++k) {
    const Point& point = points[k];
    if (!usable(point)) continue;
    if (wanted.budget && point.milliseconds > *wanted.budget) continue;
    if (wanted.target && point.error > *wanted.target) continue;
    const auto better = [&](const Point& than) {
      if (wanted.target) return quicker(point, than);
      return point.error != than.error ? point.error < than.error : point.milliseconds < than.milliseconds;
    };
    if (!best || better(points[*best])) best = k;
  }
  return best;
}

}  // namespace ringlet::study
