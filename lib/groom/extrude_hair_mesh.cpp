#include "groom/extrude_hair_mesh.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/error.h"
#include "core/log.h"
#include "groom/untangle.h"

namespace ringlet::groom {

namespace {

constexpr double kSteps = 40;        // of the integration to a head's radius of way
constexpr double kClear = 0.08;      // of the radius: nearer to the head, hair goes away from it
constexpr double kLeast = 0.01;      // of the radius: no layer but the scalp's is nearer to the head
constexpr double kLeastRise = 0.35;  // sine: how steeply hair leaves the scalp at least
constexpr double kShortest = 0.15;   // of the length: what a level leaves of hair that is below it
constexpr double kTurning = 3;       // lengths of the hair that half a turn counts for in where layers lie

// The place that hair is combed back from: so many degrees past the patch's front rim, so many radii from the
// centre; in how many radii from it the push is half, and the share of it that goes sideways.
constexpr double kAhead = 20, kBefore = 1.1, kReach = 1.5, kSideways = 0.1;

constexpr double kLeastShape = 0.1;  // of corner tetrahedra (untangle.h)
constexpr int kRounds = 4;           // of opening prisms
constexpr int kAttempts = 5;         // each with more lift
constexpr double kMoreLift = 0.1;    // of the radius

// The flow about one head (extrude_hair_mesh.h).
class Flow {
 public:
  Flow(const HairExtrusion& extrusion, const ScalpPatch& patch, const SignedDistance& head)
      : patch_(patch), head_(head), gravity_(extrusion.gravity), comb_(extrusion.comb) {
    const double top = 1 + extrusion.lift / patch.radius();
    source_ = std::max(top * top - 1 / top, 1e-3);  // some, so that hair has a way where nothing bends it
    // The front of the rim in the coordinates of the sphere, and on past it: down the forehead.
    const Vec3 front = (patch.axes.transpose() * patch.front).normalized();
    const double turn = kAhead * std::numbers::pi / 180;
    comb_from_ = kBefore * (Eigen::AngleAxisd(turn, Vec3::UnitX()) * front);
  }

  // Unit direction at a place.
  Vec3 at(const Vec3& x) const {
    const Vec3 y = (patch_.axes.transpose() * (x - patch_.centre)).cwiseQuotient(patch_.radii);
    const double r = y.norm();
    const Vec3 n = y / r, away = (y - comb_from_).cwiseProduct(Vec3(kSideways, 1, 1));
    const Vec3 pull = -Vec3::UnitY() + comb_ / (1 + std::pow(away.norm() / kReach, 4)) * away.normalized();
    const double k = std::min(1.0, 1 / (r * r * r)), out = pull.dot(n);
    const Vec3 flow = gravity_ * (pull + k / 2 * (pull - out * n) - k * out * n) + source_ / (r * r) * n;
    return keep_off((patch_.axes * flow.cwiseProduct(patch_.radii)).normalized(), x);
  }

  // Moves a place that is nearer to the head than a layer may be.
  void keep_clear(Vec3& x) const {
    const double least = kLeast * patch_.radius();
    for (int pass = 0; pass < 3; ++pass) {
      const double distance = head_(x);
      if (distance >= least) return;
      x += (1.01 * least - distance) * outward(x);
    }
  }

  // Unit vector away from the head.
  Vec3 outward(const Vec3& x) const {
    const double step = 1e-2 * patch_.radius();
    Vec3 slope;
    for (int k = 0; k < 3; ++k) {
      const Vec3 d = step * Vec3::Unit(k);
      slope[k] = head_(x + d) - head_(x - d);
    }
    const double size = slope.norm();
    return size > 0 ? Vec3(slope / size) : (x - patch_.centre).normalized();
  }

 private:
  // Near the head a direction rises from it, the more the nearer.
  Vec3 keep_off(const Vec3& direction, const Vec3& x) const {
    const double clear = kClear * patch_.radius(), distance = head_(x);
    if (!(distance < clear)) return direction;
    const Vec3 out = outward(x);
    const double least = kLeastRise * (1 - std::max(distance, 0.0) / clear), rise = direction.dot(out);
    return rise >= least ? direction : Vec3((direction + (least - rise) * out).normalized());
  }

  const ScalpPatch& patch_;
  const SignedDistance& head_;
  double gravity_, comb_, source_;
  Vec3 comb_from_;  // in the sphere's coordinates
};

// A streamline as points evenly apart.
struct Streamline {
  std::vector<Vec3> points;
  double step;  // [m]

  Vec3 at(double length) const {
    const double where = std::clamp(length / step, 0.0, static_cast<double>(points.size() - 1));
    const auto below = std::min(static_cast<std::size_t>(where), points.size() - 2);
    return points[below] + (where - static_cast<double>(below)) * (points[below + 1] - points[below]);
  }
};

Streamline follow(const Flow& flow, const Vec3& root, double length, double radius) {
  const auto steps = static_cast<int>(std::ceil(kSteps * length / radius));
  Streamline line{{root}, length / steps};
  for (int i = 0; i < steps; ++i) {  // midpoint rule
    const Vec3& x = line.points.back();
    const Vec3 middle = x + line.step / 2 * flow.at(x);
    line.points.push_back(x + line.step * flow.at(middle));
  }
  return line;
}

// How long the hair along a streamline is: to where it comes below the level.
double cut_length(const Streamline& line, double length, const std::optional<double>& level, const Vec3& up) {
  if (!level) return length;
  for (std::size_t i = 1; i < line.points.size(); ++i) {
    const double before = line.points[i - 1].dot(up) - *level, now = line.points[i].dot(up) - *level;
    if (now < 0) {
      const double share = before > 0 ? before / (before - now) : 0;
      return std::max(kShortest * length, line.step * (static_cast<double>(i - 1) + share));
    }
  }
  return length;
}

// At which shares of the streamlines' lengths the layers lie, the same for all: from layer to layer the same
// sum of length, as a share of the whole, and of mean turning, which is what a prism suffers from.
std::vector<double> layer_shares(const std::vector<Streamline>& lines, const std::vector<double>& lengths,
                                 int layers) {
  constexpr int kParts = 400;
  std::vector<double> up_to(kParts + 1, 0.0);  // of turning
  for (std::size_t v = 0; v < lines.size(); ++v) {
    const auto at = [&](int i) { return lines[v].at(lengths[v] * i / kParts); };
    for (int i = 1; i < kParts; ++i) {
      const Vec3 before = at(i) - at(i - 1), after = at(i + 1) - at(i);
      up_to[i] += before.cross(after).norm() / (before.norm() * after.norm());
    }
  }
  std::partial_sum(up_to.begin(), up_to.end(), up_to.begin());
  const double half_turns = std::numbers::pi * static_cast<double>(lines.size());
  for (int i = 0; i <= kParts; ++i)
    up_to[i] = static_cast<double>(i) / kParts + kTurning * up_to[i] / half_turns;
  std::vector<double> shares;
  for (int k = 0, i = 1; k < layers; ++k) {
    const double wanted = up_to.back() * k / (layers - 1);
    while (i < kParts && up_to[i] < wanted) ++i;
    shares.push_back((i - 1 + std::clamp((wanted - up_to[i - 1]) / (up_to[i] - up_to[i - 1]), 0.0, 1.0)) /
                     kParts);
  }
  return shares;
}

// Moves a place on a streamline to the helix about it.
Vec3 curled(const HairExtrusion& e, const ScalpPatch& patch, const Flow& flow, const Vec3& point,
            double share) {
  const Vec3 along = flow.at(point), side = patch.axes.col(0);
  const double angle = 2 * std::numbers::pi * e.curl_turns * share;
  // Less where a streamline goes sideways itself, which keeps the two axes smooth.
  const Vec3 first = side - side.dot(along) * along, second = along.cross(side);
  return point + e.curl_radius * share * (std::cos(angle) * first + std::sin(angle) * second);
}

// Layers along the streamlines, with prisms opened as far as they can be; not checked.
HairMesh extrude_once(const HairExtrusion& extrusion, const ScalpPatch& patch, const SignedDistance& head) {
  const Flow flow(extrusion, patch, head);
  const std::size_t vertices = patch.points.size();
  HairMesh mesh;
  mesh.faces = patch.faces;
  mesh.layers = extrusion.layers;
  mesh.positions.resize(vertices * static_cast<std::size_t>(extrusion.layers));
  std::vector<Streamline> lines(vertices);
  std::vector<double> lengths(vertices);
  tbb::parallel_for(std::size_t{0}, vertices, [&](std::size_t v) {
    lines[v] = follow(flow, patch.points[v], extrusion.length, patch.radius());
    lengths[v] = cut_length(lines[v], extrusion.length, extrusion.level, patch.axes.col(1));
  });
  const std::vector<double> shares = layer_shares(lines, lengths, extrusion.layers);
  for (std::size_t v = 0; v < vertices; ++v) {
    mesh.positions[v] = patch.points[v];
    for (std::size_t k = 1; k < shares.size(); ++k) {
      Vec3& point = mesh.positions[k * vertices + v];
      point = curled(extrusion, patch, flow, lines[v].at(lengths[v] * shares[k]), shares[k]);
      flow.keep_clear(point);
    }
  }
  untangle(mesh, kLeastShape, kRounds, [&](Vec3& x) { flow.keep_clear(x); });
  return mesh;
}

}  // namespace

std::optional<Problem> out_of_range(const HairExtrusion& e) {
  struct Number {
    const char* name;
    double value, low, high;
  };
  const double infinity = std::numeric_limits<double>::max();
  const Number numbers[] = {{"layers", static_cast<double>(e.layers), 2, 1000},
                            {"lift", e.lift, 0, infinity},
                            {"gravity", e.gravity, 0, 100},
                            {"comb", e.comb, 0, 100},
                            {"curl radius", e.curl_radius, 0, infinity},
                            {"level", e.level.value_or(0), -infinity, infinity}};
  for (const Number& n : numbers)
    if (!(n.value >= n.low && n.value <= n.high))
      return Problem{n.name, fmt::format("found {}, expected {:.6g} to {:.6g}", n.value, n.low, n.high), ""};
  if (!(e.length > 0 && e.length <= infinity))
    return Problem{"length", fmt::format("found {}, expected a number above 0", e.length), ""};
  const double most_turns = (e.layers - 1) / 3.0;
  if (std::abs(e.curl_turns) <= most_turns) return std::nullopt;
  return Problem{"curl turns",
                 fmt::format("found {}, expected at most {:.3g}: a third of a turn from layer to layer",
                             e.curl_turns, most_turns),
                 "give more layers"};
}

HairMesh extrude_hair_mesh(const HairExtrusion& extrusion, const ScalpPatch& patch,
                           const SignedDistance& head) {
  if (auto problem = out_of_range(extrusion)) throw Error(ErrorKind::kInput, {std::move(*problem)});
  HairExtrusion lifted = extrusion;
  std::string first_problem;
  for (int attempt = 0; attempt < kAttempts; ++attempt, lifted.lift += kMoreLift * patch.radius()) {
    HairMesh mesh = extrude_once(lifted, patch, head);
    try {
      check(mesh, "hair mesh");
    } catch (const Error& error) {
      if (first_problem.empty()) first_problem = error.problems().front().what;
      continue;
    }
    if (attempt > 0)
      log_info(fmt::format(
          "hair mesh: stands off by a lift of {:.3g} m instead of {:.3g}, so that no prism is inverted",
          lifted.lift, extrusion.lift));
    return mesh;
  }
  throw Error(ErrorKind::kInput, "hair mesh",
              fmt::format("cannot be extruded so, nor with {} more lifts up to {:.3g} m: {}", kAttempts - 1,
                          extrusion.lift + (kAttempts - 1) * kMoreLift * patch.radius(), first_problem),
              "choose a smoother part of the head, more layers or comb, or less gravity, length or curl");
}

// ---- Styles ---------------------------------------------------------------------------------------------

HairMeshSize size_of(HairStyle style, HairResolution resolution) {
  static constexpr HairMeshSize kSizes[3][3] = {
      {{43, 5}, {91, 6}, {217, 7}}, {{19, 19}, {61, 15}, {169, 11}}, {{19, 19}, {91, 15}, {461, 5}}};
  return kSizes[static_cast<int>(style)][static_cast<int>(resolution)];
}

HairExtrusion extrusion_of(HairStyle style, HairResolution resolution, const ScalpPatch& patch) {
  const double radius = patch.radius(), middle = patch.centre.dot(patch.axes.col(1));
  HairExtrusion e;
  e.layers = size_of(style, resolution).layers;
  e.lift = (resolution == HairResolution::kLow ? 0.3 : 0.2) * radius;  // wide faces need more room
  switch (style) {
    case HairStyle::kShort:
      e.length = 0.6 * radius;
      break;
    case HairStyle::kShoulder:
      e.length = 7 * radius;
      e.level = middle - 2.6 * radius;
      break;
    case HairStyle::kLong:
      e.length = 8 * radius;
      e.level = middle - 5 * radius;
      break;
  }
  return e;
}

}  // namespace ringlet::groom
