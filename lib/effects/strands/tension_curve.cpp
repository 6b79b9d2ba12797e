#include "effects/strands/tension_curve.h"

#include <algorithm>
#include <vector>

namespace ringlet::effects {
namespace {

struct Interval {
  double width, slope;  // of its chord
};

std::vector<Interval> intervals_of(const scene::Curve& points) {
  std::vector<Interval> intervals;
  for (std::size_t k = 1; k < points.size(); ++k) {
    const double width = points[k][0] - points[k - 1][0];
    intervals.push_back({width, (points[k][1] - points[k - 1][1]) / width});
  }
  return intervals;
}

// The weighted harmonic mean of the chords on both sides: at most three times the lesser, so monotone.
double inner_slope(const Interval& before, const Interval& after) {
  if (before.slope <= 0 || after.slope <= 0) return 0;
  const double a = before.width + 2 * after.width, b = 2 * before.width + after.width;
  return (a + b) / (b / before.slope + a / after.slope);
}

}  // namespace

template <class T>
kernels::TensionCurve<T> tension_curve(const scene::Curve& points) {
  const std::vector<Interval> chords = intervals_of(points);
  std::vector<double> slopes(points.size());
  for (std::size_t k = 1; k < chords.size(); ++k) slopes[k] = inner_slope(chords[k - 1], chords[k]);
  if (!chords.empty()) {
    slopes.front() = std::min(1.0, 3 * chords.front().slope);
    slopes.back() = chords.back().slope;
  }
  kernels::TensionCurve<T> curve{};
  curve.pieces = static_cast<std::int32_t>(chords.size());
  curve.transition = static_cast<T>(points.front()[0]), curve.breaking = static_cast<T>(points.back()[0]);
  for (std::size_t k = 0; k < chords.size(); ++k) {
    const auto [width, chord] = chords[k];
    const double from = slopes[k], to = slopes[k + 1];
    const double c[4] = {points[k][1], from, (3 * chord - 2 * from - to) / width,
                         (from + to - 2 * chord) / (width * width)};
    curve.start[k] = static_cast<T>(points[k][0]);
    for (int power = 0; power < 4; ++power) curve.coefficient[k][power] = static_cast<T>(c[power]);
  }
  return curve;
}

template kernels::TensionCurve<float> tension_curve(const scene::Curve&);
template kernels::TensionCurve<double> tension_curve(const scene::Curve&);

}  // namespace ringlet::effects
