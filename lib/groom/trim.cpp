// Where strands are cut. Against a plane, a box or a sphere a segment is intersected; a mesh is known by its
// distance alone, which is walked along: no surface is nearer than that.
#include <algorithm>
#include <cmath>
#include <limits>

#include "groom/edit_operations.h"

namespace ringlet::groom {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRounding = 1e-9;    // of a segment: what lies this little beyond a surface lies on it
constexpr double kMicrometre = 1e-6;  // [m] the same for meshes
constexpr double kLeastStep = 1e-5;   // [m] along a segment that grazes a mesh

// The part of a line a + t (b - a) that lies in a convex body: enter < t < leave.
struct Stretch {
  double enter = -kInfinity, leave = kInfinity;

  bool is_empty() const { return !(enter < leave); }
  Stretch operator&(const Stretch& other) const {
    return {std::max(enter, other.enter), std::min(leave, other.leave)};
  }
};

constexpr Stretch kNothing{kInfinity, -kInfinity};

// Where a linear function that is `at_a` at t = 0 and `at_b` at t = 1 is negative.
Stretch where_negative(double at_a, double at_b) {
  if (at_a == at_b) return at_a < 0 ? Stretch{} : kNothing;
  const double zero = at_a / (at_a - at_b);
  return at_b > at_a ? Stretch{.leave = zero} : Stretch{.enter = zero};
}

Stretch inside(const scene::Plane& plane, const Vec3& a, const Vec3& b) {
  return where_negative(plane.normal.dot(a - plane.point), plane.normal.dot(b - plane.point));
}

Stretch inside(const std::array<Vec3, 2>& box, const Vec3& a, const Vec3& b) {
  Stretch stretch;
  for (int axis = 0; axis < 3; ++axis) {
    stretch = stretch & where_negative(box[0][axis] - a[axis], box[0][axis] - b[axis]) &
              where_negative(a[axis] - box[1][axis], b[axis] - box[1][axis]);
  }
  return stretch;
}

// |a + t way - centre|^2 < radius^2, its roots without cancellation.
Stretch inside(const scene::Sphere& sphere, const Vec3& a, const Vec3& b) {
  const Vec3 from_centre = a - sphere.centre, way = b - a;
  const double square = way.squaredNorm(), half = from_centre.dot(way),
               rest = from_centre.squaredNorm() - sphere.radius * sphere.radius;
  if (!(square > 0)) return rest < 0 ? Stretch{} : kNothing;
  const double discriminant = half * half - square * rest;
  if (!(discriminant > 0)) return kNothing;
  const double q = -(half + std::copysign(std::sqrt(discriminant), half));
  return {std::min(q / square, rest / q), std::max(q / square, rest / q)};
}

// The fraction of segment ab, `a` not cut away, where what is cut away begins.
template <class Body>
std::optional<double> first_cut(const Body& body, bool keep_inside, const Vec3& a, const Vec3& b) {
  const Stretch stretch = inside(body, a, b);
  if (keep_inside) {
    const bool starts_outside = stretch.is_empty() || stretch.enter > kRounding;
    const double cut = starts_outside ? 0 : std::max(stretch.leave, 0.0);
    return cut < 1 - kRounding ? std::optional(cut) : std::nullopt;
  }
  const Stretch on_segment = stretch & Stretch{0, 1};
  return on_segment.leave - on_segment.enter > kRounding ? std::optional(on_segment.enter) : std::nullopt;
}

// The same for a mesh: `kept` is how far from its surface a point lies in what is kept, negative beyond.
std::optional<double> first_cut(const std::function<double(const Vec3&)>& kept, const Vec3& a,
                                const Vec3& b) {
  const double length = (b - a).norm();
  const auto kept_at = [&](double t) { return kept(a + t * (b - a)); };
  double before = 0;
  for (double t = 0;;) {
    const double room = kept_at(t);
    if (room < -kMicrometre) {
      double beyond = t;
      while ((beyond - before) * length > kRounding * std::max(length, 1.0)) {
        const double middle = (before + beyond) / 2;
        (kept_at(middle) < 0 ? beyond : before) = middle;
      }
      return before;
    }
    if (t >= 1) return std::nullopt;
    before = t;
    t = length > 0 ? std::min(1.0, t + std::max(room, kLeastStep) / length) : 1.0;
  }
}

std::optional<Cut> cut_by_length(const std::vector<Vec3>& rest, double length) {
  double before = 0;
  for (std::size_t i = 0; i + 1 < rest.size(); ++i) {
    const double segment = (rest[i + 1] - rest[i]).norm();
    if (before + segment > length * (1 + kRounding))
      return Cut{i, std::max(0.0, (length - before) / segment)};
    before += segment;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Cut> find_cut(const EditedStrand& strand, const scene::Trim& trim,
                            const SignedDistance& cutter) {
  if (trim.length) return cut_by_length(strand.rest, *trim.length);
  const auto kept = [&](const Vec3& point) { return trim.keep_inside ? -cutter(point) : cutter(point); };
  for (std::size_t i = 0; i + 1 < strand.position.size(); ++i) {
    const Vec3 &a = strand.position[i], &b = strand.position[i + 1];
    const std::optional<double> cut = trim.plane    ? first_cut(*trim.plane, trim.keep_inside, a, b)
                                      : trim.box    ? first_cut(*trim.box, trim.keep_inside, a, b)
                                      : trim.sphere ? first_cut(*trim.sphere, trim.keep_inside, a, b)
                                                    : first_cut(kept, a, b);
    if (cut) return Cut{i, *cut};
  }
  return std::nullopt;
}

}  // namespace ringlet::groom
