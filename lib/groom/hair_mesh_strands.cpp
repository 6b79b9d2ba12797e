#include "groom/hair_mesh_strands.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/random.h"

namespace ringlet::groom {

namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr double kMostStrands = 1e8;
constexpr int kOctaves = 3;  // of noise, each of half the size and half the wave length of the one before

void check_desc(const HairMeshStrandsDesc& desc, const std::string& where) {
  const auto require = [&](const char* name, bool fits, double found, const char* expected) {
    if (!fits)
      throw Error(ErrorKind::kInput, where, fmt::format("{}: found {}, expected {}", name, found, expected));
  };
  const auto not_negative = [](double x) { return x >= 0 && std::isfinite(x); };
  require("strands", desc.strands >= 0 && desc.strands <= kMostStrands, desc.strands, "0 to 100000000");
  require("density", not_negative(desc.density), desc.density, "a number of at least 0");
  require("points", desc.points >= 2 && desc.points <= 10000, desc.points, "2 to 10000");
  require("width", desc.width > 0 && std::isfinite(desc.width), desc.width, "a number above 0");
  require("curl radius", not_negative(desc.curl_radius), desc.curl_radius, "a number of at least 0");
  require("curl turns", std::abs(desc.curl_turns) <= 1000, desc.curl_turns, "-1000 to 1000");
  require("noise", not_negative(desc.noise), desc.noise, "a number of at least 0");
  require("noise waves", desc.noise_waves >= 0 && desc.noise_waves <= 1000, desc.noise_waves, "0 to 1000");
}

std::vector<double> summed_areas(const HairMesh& rest) {
  std::vector<double> up_to;
  double total = 0;
  for (std::size_t f = 0; f < rest.faces.size(); ++f) up_to.push_back(total += scalp_area(rest, f));
  return up_to;
}

std::size_t strand_count(const HairMeshStrandsDesc& desc, double area, const std::string& where) {
  if (desc.strands > 0) return static_cast<std::size_t>(desc.strands);
  const double count = std::floor(desc.density * area + 0.5);
  if (count >= 1 && count <= kMostStrands) return static_cast<std::size_t>(count);
  throw Error(ErrorKind::kInput, where,
              fmt::format("{} strands for each m^2 on a scalp of {:.4g} m^2 are {}, expected 1 to 100000000",
                          desc.density, area, count),
              "give a number of strands, or check the unit");
}

// Uniform by area in a face, as (u, v).
std::array<double, 2> uniform_in(const HairMesh& rest, const HairMesh::Face& face, Random& random) {
  if (HairMesh::corners(face) == 3) {  // the square root makes strips of equal width of equal area
    const double across = std::sqrt(random.uniform()), along = random.uniform();
    return {across * (1 - along), across * along};
  }
  const auto layer = rest.layer(0);
  const Vec3 &a = layer[face[0]], &b = layer[face[1]], &c = layer[face[2]], &d = layer[face[3]];
  const auto element = [&](double u, double v) {
    return ((1 - v) * (b - a) + v * (c - d)).cross((1 - u) * (d - a) + u * (c - b)).norm();
  };
  // Linear inside the norm, so that it is largest at a corner.
  const double most = std::max({element(0, 0), element(1, 0), element(0, 1), element(1, 1)});
  while (true) {
    const double u = random.uniform(), v = random.uniform();
    if (random.uniform() * most <= element(u, v)) return {u, v};
  }
}

// Share of the offsets that a place of the mesh has room for, by the volume that the directions of the
// gradient's columns span. Where that is small a small deformation would throw offsets far; where curves
// fold, which check() does not exclude between layers, points stay on their curves.
double room_for_offsets(const Mat3& gradient) {
  constexpr double kNone = 0.1, kAll = 0.4;
  const double spanned =
      gradient.determinant() / (gradient.col(0).norm() * gradient.col(1).norm() * gradient.col(2).norm());
  const double x = std::clamp((spanned - kNone) / (kAll - kNone), 0.0, 1.0);
  return x > 0 ? x * x * (3 - 2 * x) : 0;  // 0 also for what is not a number
}

// The slopes of the spline at its knots as weights of all layers: that of the parabola through a layer and
// its neighbours, at the ends of the one next to it.
std::vector<std::vector<double>> slopes(std::span<const double> knots) {
  const std::size_t n = knots.size();
  const auto chord = [&](std::size_t k) {  // from layer k to the next
    std::vector<double> weights(n, 0.0);
    weights[k + 1] = 1 / (knots[k + 1] - knots[k]);
    weights[k] = -weights[k + 1];
    return weights;
  };
  if (n == 2) return {chord(0), chord(0)};
  const auto mix = [n](double p, const std::vector<double>& a, double q, const std::vector<double>& b) {
    std::vector<double> sum(n);
    for (std::size_t i = 0; i < n; ++i) sum[i] = p * a[i] + q * b[i];
    return sum;
  };
  std::vector<std::vector<double>> slope(n);
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const double share = (knots[k + 1] - knots[k]) / (knots[k + 1] - knots[k - 1]);
    slope[k] = mix(share, chord(k - 1), 1 - share, chord(k));
  }
  slope[0] = mix(2, chord(0), -1, slope[1]);
  slope[n - 1] = mix(2, chord(n - 2), -1, slope[n - 2]);
  return slope;
}

// Two unit vectors that with `tangent` make a right-handed frame, turned as little as can be from `before`.
std::array<Vec3, 2> frame_along(const Vec3& tangent, const Vec3& before) {
  Vec3 first = before - before.dot(tangent) * tangent;
  if (!(first.norm() > 1e-9 * before.norm())) first = tangent.unitOrthogonal();
  first.normalize();
  return {first, tangent.cross(first)};
}

// Curl and noise of one strand at a share of its length, along the two axes across it.
class Offset {
 public:
  Offset(const HairMeshStrandsDesc& desc, std::size_t strand)
      : desc_(desc), random_(static_cast<std::uint64_t>(desc.seed), ~static_cast<std::uint64_t>(strand)) {
    phase_ = random_.uniform();
    for (auto& octave : noise_phase_)
      for (double& phase : octave) phase = random_.uniform();
  }

  Eigen::Vector2d at(double share) const {
    const auto [cosine, sine] = cos_sin(kTwoPi * (desc_.curl_turns * share + phase_));
    Eigen::Vector2d sum = desc_.curl_radius * Eigen::Vector2d(cosine, sine);
    // Each of the two axes has half the mean square, and so has a sine: amplitudes' squares sum to the whole.
    double amplitude = desc_.noise / std::sqrt(1 + 1.0 / 4 + 1.0 / 16), waves = desc_.noise_waves;
    for (int octave = 0; octave < kOctaves; ++octave, amplitude /= 2, waves *= 2)
      for (int axis = 0; axis < 2; ++axis)
        sum[axis] += amplitude * cos_sin(kTwoPi * (waves * share + noise_phase_[octave][axis]))[1];
    return share * sum;
  }

 private:
  const HairMeshStrandsDesc& desc_;
  Random random_;
  double phase_;
  std::array<std::array<double, 2>, kOctaves> noise_phase_;
};

}  // namespace

// ---- Building -------------------------------------------------------------------------------------------

HairMeshStrands::HairMeshStrands(const HairMesh& rest, const HairMeshStrandsDesc& desc,
                                 const std::string& where)
    : layers_(rest.layers),
      points_(desc.points),
      vertices_(rest.vertices()),
      width_(desc.width),
      rest_(rest.positions),
      group_names_(rest.group_names) {
  check_desc(desc, where);
  if (rest.groups.empty()) group_names_ = {"hair_mesh"};
  choose_sites(rest, desc, where);
  std::vector<double> knots = {0};
  for (int k = 1; k < layers_; ++k) {
    double sum = 0;
    for (std::size_t v = 0; v < vertices_; ++v) sum += (rest.layer(k)[v] - rest.layer(k - 1)[v]).norm();
    knots.push_back(knots.back() + std::sqrt(sum / static_cast<double>(vertices_)));
  }
  choose_knots(knots);
  if ((desc.curl_radius > 0 && desc.curl_turns != 0) || desc.noise > 0) add_offsets(desc);
}

HairMeshStrands::Site HairMeshStrands::site_in(const HairMesh& rest, std::int32_t face, double u, double v) {
  const HairMesh::Face& f = rest.faces[face];
  if (HairMesh::corners(f) == 3)
    return {{f[0], f[1], f[2], f[2]}, {1 - u - v, u, v, 0}, {-1, 1, 0, 0}, {-1, 0, 1, 0}, face};
  return {f,
          {(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v},
          {v - 1, 1 - v, v, -v},
          {u - 1, -u, u, 1 - u},
          face};
}

void HairMeshStrands::choose_sites(const HairMesh& rest, const HairMeshStrandsDesc& desc,
                                   const std::string& where) {
  const std::vector<double> area_up_to = summed_areas(rest);
  const std::size_t count = strand_count(desc, area_up_to.back(), where);
  Random random(static_cast<std::uint64_t>(desc.seed), ~std::uint64_t{0});
  sites_.reserve(count);
  for (std::size_t s = 0; s < count; ++s) {
    const double at =
        area_up_to.back() * ((static_cast<double>(s) + random.uniform()) / static_cast<double>(count));
    const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end(), at) - area_up_to.begin();
    const auto face = static_cast<std::int32_t>(std::min<std::size_t>(found, rest.faces.size() - 1));
    const auto [u, v] = uniform_in(rest, rest.faces[face], random);
    sites_.push_back(site_in(rest, face, u, v));
    groups_.push_back(rest.groups.empty() ? 0 : rest.groups[face]);
  }
}

// The place of parameter `t` among the layers: Hermite's cubics with the slopes above.
HairMeshStrands::Knot HairMeshStrands::knot_at(std::span<const double> layer_knots, double t) {
  const int n = static_cast<int>(layer_knots.size());
  int k = 0;
  while (k + 2 < n && layer_knots[k + 1] <= t) ++k;
  const double span = layer_knots[k + 1] - layer_knots[k], s = (t - layer_knots[k]) / span;
  const std::vector<std::vector<double>> slope = slopes(layer_knots);
  std::vector<double> weight(n), by_t(n);
  const double low = (1 + 2 * s) * (1 - s) * (1 - s), high = s * s * (3 - 2 * s),
               d_high = 6 * s * (1 - s) / span;
  const double low_slope = span * s * (1 - s) * (1 - s), high_slope = span * s * s * (s - 1);
  const double d_low_slope = (1 - s) * (1 - 3 * s), d_high_slope = s * (3 * s - 2);
  for (int i = 0; i < n; ++i) {
    weight[i] =
        low_slope * slope[k][i] + high_slope * slope[k + 1][i] + (i == k ? low : 0) + (i == k + 1 ? high : 0);
    by_t[i] = d_low_slope * slope[k][i] + d_high_slope * slope[k + 1][i] + (i == k + 1 ? d_high : 0) -
              (i == k ? d_high : 0);
  }
  Knot knot{std::clamp(k - 1, 0, std::max(0, n - 4)), {}, {}};
  for (int i = 0; i < std::min(n, 4); ++i) {
    knot.weight[i] = weight[knot.first_layer + i];
    knot.by_t[i] = by_t[knot.first_layer + i];
  }
  return knot;
}

// Even in the mean length along the curves of some of the strands.
void HairMeshStrands::choose_knots(std::span<const double> layer_knots) {
  constexpr int kFine = 32;  // steps from layer to layer
  constexpr std::size_t kSome = 64;
  const int steps = kFine * (layers_ - 1);
  std::vector<double> t(steps + 1), length(steps + 1, 0.0);
  for (int i = 0; i <= steps; ++i) {
    const int k = std::min(i / kFine, layers_ - 2);
    t[i] = layer_knots[k] + (layer_knots[k + 1] - layer_knots[k]) * (i - k * kFine) / kFine;
    knots_.push_back(knot_at(layer_knots, t[i]));
  }
  const std::size_t stride = std::max<std::size_t>(1, sites_.size() / kSome);
  std::vector<Vec3> curve(knots_.size());
  Layers layers;
  for (std::size_t s = 0; s < sites_.size(); s += stride) {
    place_strand(s, rest_, layers, curve);
    double along = 0;
    for (int i = 1; i <= steps; ++i) length[i] += along += (curve[i] - curve[i - 1]).norm();
  }
  knots_.clear();
  for (int j = 0, i = 1; j < points_; ++j) {
    const double wanted = length.back() * j / (points_ - 1);
    while (i < steps && length[i] < wanted) ++i;
    const double step = length[i] - length[i - 1], share = step > 0 ? (wanted - length[i - 1]) / step : 0;
    knots_.push_back(knot_at(layer_knots, t[i - 1] + std::clamp(share, 0.0, 1.0) * (t[i] - t[i - 1])));
  }
}

void HairMeshStrands::add_offsets(const HairMeshStrandsDesc& desc) {
  std::vector<Coefficients> offsets(sites_.size() * knots_.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size(), 64), [&](const auto& range) {
    Layers layers;
    for (std::size_t s = range.begin(); s < range.end(); ++s) {
      const Offset offset(desc, s);
      gather(sites_[s], rest_, layers, true);
      Vec3 across = layers.by_u[0];
      for (std::size_t j = 0; j < knots_.size(); ++j) {
        const Mat3 gradient = gradient_at(knots_[j], layers);
        const auto [first, second] = frame_along(gradient.col(2).normalized(), across);
        across = first;
        const Eigen::Vector2d at = offset.at(static_cast<double>(j) / (points_ - 1));
        const Vec3 coefficients =
            room_for_offsets(gradient) * (gradient.inverse() * (at[0] * first + at[1] * second));
        if (coefficients.allFinite()) offsets[s * knots_.size() + j] = coefficients.cast<float>();
      }
    }
  });
  offsets_ = std::move(offsets);
}

// ---- Placing --------------------------------------------------------------------------------------------

// The control points of a strand, and with `gradients` their derivatives by u and v.
void HairMeshStrands::gather(const Site& site, std::span<const Vec3> vertices, Layers& out,
                             bool gradients) const {
  const auto combine = [&](const std::array<double, 4>& weight, std::vector<Vec3>& at) {
    at.resize(layers_);
    const Vec3* layer = vertices.data();
    for (int k = 0; k < layers_; ++k, layer += vertices_)
      at[k] = weight[0] * layer[site.vertex[0]] + weight[1] * layer[site.vertex[1]] +
              weight[2] * layer[site.vertex[2]] + weight[3] * layer[site.vertex[3]];
  };
  combine(site.weight, out.point);
  if (!gradients) return;
  combine(site.by_u, out.by_u);
  combine(site.by_v, out.by_v);
}

Vec3 HairMeshStrands::mix(const Knot& knot, const std::array<double, 4>& weight,
                          const std::vector<Vec3>& of_layers) const {
  const Vec3* at = of_layers.data() + knot.first_layer;
  Vec3 sum = weight[0] * at[0] + weight[1] * at[1];
  if (layers_ > 2) sum += weight[2] * at[2];
  if (layers_ > 3) sum += weight[3] * at[3];
  return sum;
}

Mat3 HairMeshStrands::gradient_at(const Knot& knot, const Layers& layers) const {
  Mat3 gradient;
  gradient << mix(knot, knot.weight, layers.by_u), mix(knot, knot.weight, layers.by_v),
      mix(knot, knot.by_t, layers.point);
  return gradient;
}

void HairMeshStrands::place_strand(std::size_t strand, std::span<const Vec3> vertices, Layers& layers,
                                   std::span<Vec3> points) const {
  gather(sites_[strand], vertices, layers, !offsets_.empty());
  for (std::size_t j = 0; j < knots_.size(); ++j) {
    points[j] = mix(knots_[j], knots_[j].weight, layers.point);
    if (offsets_.empty()) continue;
    const Coefficients& offset = offsets_[strand * knots_.size() + j];
    points[j] += gradient_at(knots_[j], layers) * offset.cast<double>();
  }
}

void HairMeshStrands::place(std::span<const Vec3> vertices, std::span<Vec3> points) const {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size(), 256), [&](const auto& range) {
    Layers layers;
    for (std::size_t s = range.begin(); s < range.end(); ++s)
      place_strand(s, vertices, layers, points.subspan(s * knots_.size(), knots_.size()));
  });
}

Strands HairMeshStrands::strands() const {
  Strands strands;
  strands.points.resize(size() * knots_.size());
  place(rest_, strands.points);
  for (std::size_t s = 1; s <= size(); ++s)
    strands.offsets.push_back(static_cast<std::int64_t>(s * knots_.size()));
  strands.widths.assign(strands.points.size(), static_cast<float>(width_));
  strands.groups = groups_;
  strands.group_names = group_names_;
  return strands;
}

std::size_t HairMeshStrands::bytes() const {
  return sites_.size() * sizeof(Site) + knots_.size() * sizeof(Knot) +
         offsets_.size() * sizeof(Coefficients) + rest_.size() * sizeof(Vec3) +
         groups_.size() * sizeof groups_[0];
}

}  // namespace ringlet::groom
