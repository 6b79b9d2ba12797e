#include <algorithm>
#include <cmath>

#include "groom/continuation.h"
#include "groom/edit_operations.h"

namespace ringlet::groom {
namespace {

constexpr double kRounding = 1e-9;  // of a strand: a length this little short is there

double length_of(std::span<const Vec3> points) {
  double length = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) length += (points[i + 1] - points[i]).norm();
  return length;
}

double missing_length(const scene::Lengthen& by, double length) {
  if (by.by) return *by.by;
  if (by.to) return std::max(0.0, *by.to - length);
  return (*by.factor - 1) * length;
}

// The rotation of the root's frame carried up to the tip, each segment turning the least that takes it from
// rest to now.
Mat3 rotation_at_tip(const EditedStrand& strand) {
  Mat3 rotation = strand.rotation;
  for (std::size_t i = 0; i + 1 < strand.rest.size(); ++i) {
    const Vec3 carried = rotation * (strand.rest[i + 1] - strand.rest[i]),
               now = strand.position[i + 1] - strand.position[i];
    if (carried.squaredNorm() > 0 && now.squaredNorm() > 0)
      rotation = Quat::FromTwoVectors(carried, now) * rotation;
  }
  return rotation;
}

// ---- Extension -------------------------------------------------------------------------------------

struct Extension {
  double old_tip;     // [m] by which the last segment grows
  std::size_t added;  // particles
  double last;        // [m] length of the last new segment; the others have the spacing
};

Extension divide(double length, double last_segment, double spacing) {
  Extension extension{std::clamp(spacing - last_segment, 0.0, length), 0, spacing};
  length -= extension.old_tip;
  const double whole = std::floor(length / spacing);
  const double left_over = length - whole * spacing;
  extension.added = static_cast<std::size_t>(whole);
  if (left_over >= kStub * spacing) {
    ++extension.added;
    extension.last = left_over;
  } else if (extension.added > 0) {
    extension.last = spacing + left_over;
  } else {
    extension.old_tip += left_over;
  }
  return extension;
}

// The last segment grows in its own direction, now as at rest.
void grow_last(EditedStrand& strand, double length, const Mat3& rest_to_now) {
  const std::size_t tip = strand.rest.size() - 1;
  std::size_t before = tip - 1;
  while (before > 0 && strand.rest[before] == strand.rest[tip]) --before;
  const Vec3 along = (strand.rest[tip] - strand.rest[before]).normalized();
  const Vec3 now = strand.position[tip] - strand.position[before];
  strand.rest[tip] += length * along;
  strand.position[tip] += length * (now.norm() > 0 ? Vec3(now.normalized()) : Vec3(rest_to_now * along));
}

void extend(EditedStrand& strand, double length) {
  const double step = std::max(strand.spacing, spacing(strand.rest));
  const std::size_t tip = strand.rest.size() - 1;
  const Extension extension = divide(length, (strand.rest[tip] - strand.rest[tip - 1]).norm(), step);
  const Mat3 rest_to_now = rotation_at_tip(strand);
  if (extension.old_tip > 0) grow_last(strand, extension.old_tip, rest_to_now);
  if (extension.added == 0) return;
  Continuation continuation(strand.rest, step);
  for (std::size_t i = 1; i <= extension.added; ++i) {
    const Vec3 segment = (i < extension.added ? step : extension.last) * continuation.next();
    strand.rest.push_back(strand.rest.back() + segment);
    strand.position.push_back(strand.position.back() + rest_to_now * segment);
  }
  strand.velocity.resize(strand.rest.size(), strand.velocity[tip]);
}

void scale(std::vector<Vec3>& points, double factor) {
  for (Vec3& point : points) point = points.front() + factor * (point - points.front());
}

}  // namespace

double spacing(std::span<const Vec3> rest) {
  if (rest.size() < 2) return 0;
  const auto mean = [](std::span<const Vec3> points) {
    return length_of(points) / static_cast<double>(points.size() - 1);
  };
  return rest.size() == 2 ? mean(rest) : std::max(mean(rest), mean(rest.first(rest.size() - 1)));
}

bool lengthen(EditedStrand& strand, const scene::Lengthen& by) {
  const double length = length_of(strand.rest), missing = missing_length(by, length);
  if (!(length > 0 && missing > kRounding * length)) return false;
  if (by.mode == scene::Lengthening::kExtend) {
    extend(strand, missing);
  } else {
    scale(strand.rest, 1 + missing / length);
    scale(strand.position, 1 + missing / length);
  }
  return true;
}

// ---- The most particles ------------------------------------------------------------------------------

namespace {

// What is known of all the shapes that a strand may have by now.
class Bound {
 public:
  explicit Bound(std::span<const Vec3> rest) : spacing_(spacing(rest)) {
    reach_.push_back(0);
    for (std::size_t i = 0; i + 1 < rest.size(); ++i)
      reach_.push_back(reach_.back() + (rest[i + 1] - rest[i]).norm());
  }

  std::size_t particles() const { return reach_.size(); }

  void operator()(const scene::Trim&) { may_be_cut_ = true; }
  void operator()(const scene::Comb&) {}
  void operator()(const scene::Rest&) { std::fill(reach_.begin(), reach_.end(), 0.0); }
  void operator()(const scene::Lengthen& by) {
    if (by.mode == scene::Lengthening::kScale || !(spacing_ > 0)) return;
    const std::size_t most = by.by       ? particles() + added(*by.by / spacing_)
                             : by.factor ? particles() + added((*by.factor - 1) * segments())
                                         : most_up_to(*by.to);
    grow(most);
  }

 private:
  double segments() const { return static_cast<double>(particles() - 1); }

  // New particles for a length of so many segments; rounding here or there must not make it one too few.
  static std::size_t added(double segments) {
    return static_cast<std::size_t>(std::max(0.0, std::floor(segments * (1 + 1e-5) + 1 - kStub + 1e-5)));
  }

  // Lengthened to `length`, from whatever it was cut down to. Its last segment may be a stub, but grows to
  // the spacing first.
  std::size_t most_up_to(double length) const {
    std::size_t most = particles();
    for (std::size_t count = may_be_cut_ ? 2 : particles(); count <= particles(); ++count) {
      double least = reach_[count - 2] + spacing_;
      if (!may_be_cut_) least = std::max(least, reach_[count - 1]);
      most = std::max(most, count + added((length - least) / spacing_));
    }
    return most;
  }

  // Segments that are added are no shorter than the spacing, but for the last.
  void grow(std::size_t particles) {
    for (std::size_t i = 1; i < particles; ++i) {
      const double extended = reach_[i - 1] + spacing_;
      if (i < reach_.size()) {
        reach_[i] = std::min(reach_[i], extended);
      } else {
        reach_.push_back(extended);
      }
    }
    may_be_cut_ = true;
  }

  double spacing_;
  std::vector<double> reach_;  // [m] the least length up to each particle, a last one that was cut aside
  bool may_be_cut_ = false;    // at any length
};

}  // namespace

std::size_t most_particles(std::span<const Vec3> rest, std::span<const scene::GroomingOperation> operations) {
  Bound bound(rest);
  for (const scene::GroomingOperation& operation : operations) std::visit(bound, operation.what);
  return bound.particles();
}

}  // namespace ringlet::groom
