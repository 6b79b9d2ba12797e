// Strands with their particles spread evenly along the smooth curve through their points.
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "groom/assemble.h"
#include "groom/edit.h"

namespace ringlet::groom {
namespace {

constexpr double kPrecision = 1e-9;     // of a piece's chord, of lengths along it
constexpr double kMostParticles = 1e6;  // of a strand: beyond it a unit is wrong

// A cubic by its ends and their derivatives, as a function of u from 0 to `chord`.
struct Piece {
  Vec3 from, to, from_slope, to_slope;
  double chord;
  std::size_t source;  // the particle it starts from

  Vec3 at(double u) const {
    const double t = u / chord, s = 1 - t;
    return s * s * (1 + 2 * t) * from + t * t * (1 + 2 * s) * to +
           s * t * chord * (s * from_slope - t * to_slope);
  }
  double speed(double u) const {
    const double t = u / chord, s = 1 - t;
    return (6 * s * t / chord * (to - from) + s * (s - 2 * t) * from_slope + t * (t - 2 * s) * to_slope)
        .norm();
  }
};

// Gauss and Legendre's rule of five points.
double rough_length(const Piece& piece, double from, double to) {
  static const double kAt[] = {0.0, std::sqrt(5 - 2 * std::sqrt(10.0 / 7)) / 3,
                               std::sqrt(5 + 2 * std::sqrt(10.0 / 7)) / 3};
  static const double kWeight[] = {128.0 / 225, (322 + 13 * std::sqrt(70.0)) / 900,
                                   (322 - 13 * std::sqrt(70.0)) / 900};
  const double middle = (from + to) / 2, half = (to - from) / 2;
  double sum = kWeight[0] * piece.speed(middle);
  for (int k = 1; k < 3; ++k)
    sum += kWeight[k] * (piece.speed(middle - half * kAt[k]) + piece.speed(middle + half * kAt[k]));
  return half * sum;
}

double length_along(const Piece& piece, double from, double to, int halvings = 20) {
  const double middle = (from + to) / 2;
  const double whole = rough_length(piece, from, to);
  const double halves = rough_length(piece, from, middle) + rough_length(piece, middle, to);
  if (halvings == 0 || std::abs(whole - halves) <= kPrecision * piece.chord) return halves;
  return length_along(piece, from, middle, halvings - 1) + length_along(piece, middle, to, halvings - 1);
}

// The curve through a strand's points: by chord lengths, its slope at each point that of the parabola through
// it and its neighbours (Catmull and Rom's for uneven points). Points on a line stay on it.
class SmoothCurve {
 public:
  explicit SmoothCurve(const std::vector<Vec3>& points) {
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const double chord = (points[i + 1] - points[i]).norm();
      const Vec3 slope = (points[i + 1] - points[i]) / chord;
      if (chord > 0) pieces_.push_back({points[i], points[i + 1], slope, slope, chord, i});
    }
    set_slopes();
    for (const Piece& piece : pieces_) ends_.push_back(length() + length_along(piece, 0, piece.chord));
  }

  double length() const { return ends_.empty() ? 0 : ends_.back(); }

  struct Place {
    std::size_t piece;
    double u;
  };
  Place find(double along) const {
    const auto end = std::lower_bound(ends_.begin(), ends_.end() - 1, along);
    const auto number = static_cast<std::size_t>(end - ends_.begin());
    const Piece& piece = pieces_[number];
    const double target = along - (number > 0 ? ends_[number - 1] : 0);
    double low = 0, high = piece.chord, u = std::clamp(target, low, high);
    for (int step = 0; step < 60;
         ++step) {  // Newton's, kept between what is known to be too low and too high
      const double error = length_along(piece, 0, u) - target;
      if (std::abs(error) <= kPrecision * piece.chord) break;
      (error > 0 ? high : low) = u;
      const double next = u - error / piece.speed(u);
      u = next > low && next < high ? next : (low + high) / 2;
    }
    return {number, u};
  }

  const Piece& piece(const Place& place) const { return pieces_[place.piece]; }

 private:
  void set_slopes() {
    for (std::size_t i = 0; i + 1 < pieces_.size(); ++i) {
      Piece &before = pieces_[i], &after = pieces_[i + 1];
      const double whole = before.chord + after.chord;
      const Vec3 slope = after.chord / whole * ((before.to - before.from) / before.chord) +
                         before.chord / whole * ((after.to - after.from) / after.chord);
      before.to_slope = after.from_slope = slope;
    }
    if (pieces_.size() < 2) return;
    Piece &first = pieces_.front(), &last = pieces_.back();  // the parabola's other end
    first.from_slope = 2 / first.chord * (first.to - first.from) - first.to_slope;
    last.to_slope = 2 / last.chord * (last.to - last.from) - last.from_slope;
  }

  std::vector<Piece> pieces_;
  std::vector<double> ends_;  // length along the curve up to each piece's end
};

StrandShape resample(const StrandShape& shape, std::optional<int> particles, std::optional<double> step) {
  if (shape.points.size() < 2) return shape;
  const SmoothCurve curve(shape.points);
  const double segments =
      particles ? *particles - 1 : std::max(1.0, std::round(curve.length() / step.value()));
  if (segments >= kMostParticles) {
    throw Error(ErrorKind::kInput, "",
                fmt::format("a strand of {:.4g} m would get {:.0f} particles, at most {:.0f} are allowed",
                            curve.length(), segments + 1, kMostParticles),
                "look at the unit");
  }
  StrandShape result;
  const auto add = [&](const Vec3& point, float width) {
    result.points.push_back(point);
    if (!shape.widths.empty()) result.widths.push_back(width);
  };
  const auto width = [&](std::size_t i) { return shape.widths.empty() ? 0.0f : shape.widths[i]; };
  add(shape.points.front(), width(0));
  for (double i = 1; i < segments; ++i) {
    if (!(curve.length() > 0)) {  // all of it in one place
      add(shape.points.front(), width(0));
      continue;
    }
    const SmoothCurve::Place place = curve.find(curve.length() * i / segments);
    const Piece& piece = curve.piece(place);
    const auto share = static_cast<float>(place.u / piece.chord);
    add(piece.at(place.u), (1 - share) * width(piece.source) + share * width(piece.source + 1));
  }
  add(shape.points.back(), width(shape.points.size() - 1));
  return result;
}

}  // namespace

Strands resample(const Strands& strands, std::optional<int> particles, std::optional<double> step) {
  std::vector<StrandShape> shapes(strands.size());
  tbb::parallel_for(std::size_t{0}, shapes.size(),
                    [&](std::size_t s) { shapes[s] = resample(shape_of(strands, s), particles, step); });
  return assemble(strands, shapes);
}

}  // namespace ringlet::groom
