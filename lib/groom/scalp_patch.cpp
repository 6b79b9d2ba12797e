#include "groom/scalp_patch.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "groom/scalp.h"
#include "groom/up_axis.h"

namespace ringlet::groom {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kAzimuths = 120;       // at which the region's rim is looked for
constexpr double kStep = kPi / 180;  // of the way from the pole to the rim
constexpr int kGap = 3;              // steps that may miss the region, as at a crack between triangles
constexpr double kEdge = 1e-9;       // barycentric: a ray between two triangles meets both
constexpr double kInset = 0.98;      // of the way to the rim: the rim itself is a zigzag of triangles

[[noreturn]] void refuse(std::string what, std::string hint) {
  throw Error(ErrorKind::kInput, "scalp", std::move(what), std::move(hint));
}

// The triangles of the region, and where rays from the centre meet them.
class Region {
 public:
  Region(const ScalpRegion& region, const Scalp& scalp) : scalp_(scalp) {
    triangles_ = select_triangles(scalp, region.selection);
    centre = region.centre ? *region.centre : fit_centre();
    for (const std::int32_t t : triangles_) cones_.push_back(cone_about(t));
  }

  // The mean direction of the triangles from the centre.
  Vec3 middle() const {
    Vec3 sum = Vec3::Zero();
    for (const std::int32_t t : triangles_) {
      const Vec3 out = (corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3 - centre;
      sum += area_vector(scalp_, scalp_.triangles[t]).norm() * out.normalized();
    }
    if (!(sum.norm() > 0)) refuse("the region's triangles lie all about the centre", "give the pole");
    return sum.normalized();
  }

  // The farthest hit of the ray from the centre along a unit direction; 0: none.
  double distance_along(const Vec3& direction) const {
    double farthest = 0;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      if (!cones_[i].contains(direction)) continue;
      const std::int32_t t = triangles_[i];
      const Vec3 ab = corner(t, 1) - corner(t, 0), ac = corner(t, 2) - corner(t, 0),
                 from = centre - corner(t, 0);
      const Vec3 across = direction.cross(ac);
      const double determinant = ab.dot(across);
      if (determinant == 0) continue;
      const double u = from.dot(across) / determinant;
      if (!(u >= -kEdge && u <= 1 + kEdge)) continue;
      const Vec3 turned = from.cross(ab);
      const double v = direction.dot(turned) / determinant;
      if (!(v >= -kEdge && u + v <= 1 + kEdge)) continue;
      farthest = std::max(farthest, ac.dot(turned) / determinant);
    }
    return farthest;
  }

  Vec3 centre;

 private:
  // Directions from the centre that may meet a triangle: most rays pass most triangles.
  struct Cone {
    Vec3 axis;
    double least_cosine;
    bool contains(const Vec3& direction) const { return direction.dot(axis) >= least_cosine; }
  };

  Cone cone_about(std::int32_t triangle) const {
    std::array<Vec3, 3> out;
    for (int k = 0; k < 3; ++k) out[k] = (corner(triangle, k) - centre).normalized();
    Cone cone{(out[0] + out[1] + out[2]).normalized(), 1};
    for (const Vec3& direction : out)
      cone.least_cosine = std::min(cone.least_cosine, direction.dot(cone.axis));
    // A cone that is wider than half of space would leave out what lies between its corners.
    cone.least_cosine = cone.least_cosine > 0.1 ? cone.least_cosine - 1e-9 : -1;
    return cone;
  }

  const Vec3& corner(std::int32_t triangle, int k) const {
    return scalp_.vertices[scalp_.triangles[triangle][k]];
  }

  // Of the sphere |x|^2 - 2 c . x + d = 0 that fits the vertices best in the sense of least squares.
  Vec3 fit_centre() const {
    Vec3 origin = Vec3::Zero();
    for (const std::int32_t t : triangles_) origin += corner(t, 0) / static_cast<double>(triangles_.size());
    Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (const std::int32_t t : triangles_) {
      for (int c = 0; c < 3; ++c) {
        const Vec3 point = corner(t, c) - origin;
        const Eigen::Vector4d row(2 * point.x(), 2 * point.y(), 2 * point.z(), 1);
        normal += row * row.transpose();
        right += point.squaredNorm() * row;
      }
    }
    const Vec3 centre = normal.ldlt().solve(right).head<3>();
    if (!centre.allFinite()) refuse("no sphere fits the region's triangles", "give the centre");
    return origin + centre;
  }

  const Scalp& scalp_;
  std::vector<std::int32_t> triangles_;
  std::vector<Cone> cones_;  // of the triangles
};

// Directions by angle from the pole and azimuth about it; azimuth 0 is towards the front.
class Polar {
 public:
  Polar(const Vec3& pole, const Vec3& forward) : pole_(pole) {
    first_ = forward - forward.dot(pole) * pole;
    if (!(first_.norm() > 1e-6 * forward.norm())) first_ = pole.unitOrthogonal();
    first_.normalize();
    second_ = pole_.cross(first_);
  }
  Vec3 at(double angle, double azimuth) const {
    return std::cos(angle) * pole_ +
           std::sin(angle) * (std::cos(azimuth) * first_ + std::sin(azimuth) * second_);
  }

 private:
  Vec3 pole_, first_, second_;
};

// The angle from the pole to the region's rim at each azimuth, smooth: never beyond the rim.
std::vector<double> find_rim(const Region& region, const Polar& polar, std::optional<double> angle) {
  std::vector<double> rim(kAzimuths, 0.0);
  const double end = std::min(angle.value_or(kPi), 0.97 * kPi);
  for (int i = 0; i < kAzimuths; ++i) {
    int missed = 0;
    for (int step = 1; step * kStep <= end && missed < kGap; ++step) {
      const bool hit = region.distance_along(polar.at(step * kStep, 2 * kPi * i / kAzimuths)) > 0;
      missed = hit ? 0 : missed + 1;
      if (hit) rim[i] = step * kStep;
    }
    if (end - rim[i] < kStep) rim[i] = end;
    if (!(rim[i] > 0))
      refuse("a ray from the centre by the pole meets none of the region's triangles",
             "give a pole in the region's middle, or a centre inside the head");
  }
  constexpr int kWindow = 5;
  const auto over_window = [&](const std::vector<double>& values, double first, const auto& fold) {
    std::vector<double> out(kAzimuths, first);
    for (int i = 0; i < kAzimuths; ++i)
      for (int k = -kWindow; k <= kWindow; ++k)
        out[i] = fold(out[i], values[(i + k + kAzimuths) % kAzimuths]);
    return out;
  };
  std::vector<double> smooth = over_window(rim, kPi, [](double a, double b) { return std::min(a, b); });
  smooth = over_window(smooth, 0.0, [](double a, double b) { return a + b / (2 * kWindow + 1); });
  for (double& value : smooth) value *= kInset;
  return smooth;
}

double rim_at(const std::vector<double>& rim, double azimuth) {
  const double at = azimuth / (2 * kPi) * kAzimuths;
  const int below = static_cast<int>(std::floor(at));
  const auto value = [&](int i) { return rim[((i % kAzimuths) + kAzimuths) % kAzimuths]; };
  return value(below) + (at - below) * (value(below + 1) - value(below));
}

// How many vertices each ring has: in proportion to its number, six more from ring to ring or nearly so, as
// in a pattern of hexagons. With the pole they sum to `vertices`.
std::vector<int> ring_sizes(int vertices) {
  int rings = 1;
  while (std::pow(3.0 * rings * (rings + 1), 0.5) * std::pow(3.0 * (rings + 1) * (rings + 2), 0.5) <
         vertices - 1)
    ++rings;
  const double step = (vertices - 1) / (rings * (rings + 1) / 2.0);
  std::vector<int> sizes;
  int so_far = 0;
  for (int i = 1; i <= rings; ++i) {
    const int up_to = static_cast<int>(std::lround(step * i * (i + 1) / 2));
    sizes.push_back(up_to - so_far);
    so_far = up_to;
  }
  return sizes;
}

// Faces between two rings of vertices from `inner` and `outer` on: a quad for each vertex of the smaller
// ring, and triangles, evenly among them, for what the larger one has more.
void join_rings(int inner, int inner_size, int outer, int outer_size, std::vector<HairMesh::Face>& faces) {
  const int steps = std::max(inner_size, outer_size);
  // Rounded alike on both sides of the front, so that the patch is as symmetric as the head.
  const auto on = [steps](int step, int size) {
    const auto rounded = [&](int s) { return static_cast<int>((2ll * s * size + steps) / (2ll * steps)); };
    return 2 * step <= steps ? rounded(step) : size - rounded(steps - step);
  };
  for (int step = 0; step < steps; ++step) {
    const int i0 = on(step, inner_size), i1 = on(step + 1, inner_size);
    const int o0 = on(step, outer_size), o1 = on(step + 1, outer_size);
    const std::int32_t a = inner + i0 % inner_size, b = outer + o0 % outer_size, c = outer + o1 % outer_size,
                       d = inner + i1 % inner_size;
    if (i0 == i1)
      faces.push_back({a, b, c, -1});
    else if (o0 == o1)
      faces.push_back({a, b, d, -1});
    else
      faces.push_back({a, b, c, d});
  }
}

Mat3 head_axes(const ScalpRegion& region, scene::Axis up) {
  Mat3 axes = up_rotation(scene::Axis::kY, up);
  if (!region.forward) return axes;
  const Vec3 upward = axes.col(1), level = *region.forward - region.forward->dot(upward) * upward;
  if (!(level.norm() > 1e-6 * region.forward->norm()))
    refuse("the forward direction is that of the up axis", "give the direction that the face looks in");
  axes.col(2) = level.normalized();
  axes.col(0) = upward.cross(axes.col(2));
  return axes;
}

// The radii along three axes of the ellipsoid about the centre that is nearest to the points in the algebraic
// sense; not far from the mean distance along an axis that they say little of.
Vec3 fit_radii(const std::vector<Vec3>& points, const Vec3& centre, const Mat3& axes) {
  Mat3 normal = Mat3::Zero();
  Vec3 right = Vec3::Zero();
  double mean = 0;
  for (const Vec3& point : points) {
    const Vec3 local = axes.transpose() * (point - centre), squares = local.cwiseAbs2();
    normal += squares * squares.transpose();
    right += squares;
    mean += local.norm() / static_cast<double>(points.size());
  }
  const Vec3 inverse_squares = normal.ldlt().solve(right);
  Vec3 radii;
  for (int k = 0; k < 3; ++k)
    radii[k] =
        std::clamp(inverse_squares[k] > 0 ? 1 / std::sqrt(inverse_squares[k]) : mean, 0.7 * mean, 1.4 * mean);
  return radii;
}

}  // namespace

ScalpPatch lay_scalp_patch(const ScalpRegion& region, int vertices, const Scalp& scalp, scene::Axis up) {
  if (vertices < 7 || vertices > 100000)
    refuse(fmt::format("found {} vertices, expected 7 to 100000", vertices), "of one layer");
  const Region triangles(region, scalp);
  ScalpPatch patch;
  patch.centre = triangles.centre;
  patch.axes = head_axes(region, up);
  const Vec3 pole = region.pole ? region.pole->normalized() : triangles.middle();
  const Polar polar(pole, patch.axes.col(2));
  const std::vector<double> rim = find_rim(triangles, polar, region.angle);
  patch.front = polar.at(rim[0], 0);

  const auto add = [&](double angle, double azimuth) {
    const Vec3 direction = polar.at(angle, azimuth);
    const double distance = triangles.distance_along(direction);
    if (!(distance > 0))
      refuse("the region has a hole where a vertex of the patch would be", "choose a region without holes");
    patch.points.push_back(patch.centre + distance * direction);
  };
  const std::vector<int> sizes = ring_sizes(vertices);
  add(0, 0);
  int inner = 0;
  for (std::size_t ring = 0; ring < sizes.size(); ++ring) {
    const int outer = static_cast<int>(patch.points.size()), size = sizes[ring];
    for (int j = 0; j < size; ++j) {
      const double azimuth = 2 * kPi * j / size;
      add(rim_at(rim, azimuth) * static_cast<double>(ring + 1) / static_cast<double>(sizes.size()), azimuth);
    }
    for (int j = 0; ring == 0 && j < size; ++j)
      patch.faces.push_back({0, outer + j, outer + (j + 1) % size, -1});
    if (ring > 0) join_rings(inner, sizes[ring - 1], outer, size, patch.faces);
    inner = outer;
  }
  patch.radii = fit_radii(patch.points, patch.centre, patch.axes);
  return patch;
}

}  // namespace ringlet::groom
