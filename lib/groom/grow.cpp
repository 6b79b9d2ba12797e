// Procedural growth: supplement D of the AMS paper, as physics.md section 9 reads it.
//
// Roots uniform in the selected triangles; first direction the interpolated normal plus noise; then for
// particle i
//   p'    = d_{i-1} + g_{i-1} max(p_Gamma, 1 - |d_{i-1} . up|),   g_i = -i p_gamma up
//   d_i   = normalised(p' + p_Omega (p' - H_i)),                  H_i = p_h cos(i p_freq) X + up + p_h sin(i
//   p_freq) Z x_i   = x_{i-1} + p_tau d_i                                   [m]
// with X and Z the horizontal axes. Directions are dimensionless. Nothing here depends on the machine: one
// stream of random numbers a strand, sums in a spelled-out order, circular functions of our own.
#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "groom/groom.h"
#include "groom/scalp.h"
#include "groom/up_axis.h"

namespace ringlet::groom {

namespace {
struct Root {
  RootSite site;
  Vec3 position, normal;
};

// The direction of `v`, or `fallback` where `v` has none.
Vec3 unit(const Vec3& v, const Vec3& fallback) {
  const double size = length(v);
  return size > 0 ? Vec3(v / size) : fallback;
}

// Uniform over a triangle: the square root makes the strips of equal barycentric of equal area.
Vec3 uniform_barycentric(Random& random) {
  const double across = std::sqrt(random.uniform());
  const double along = random.uniform();
  return {1 - across, across * (1 - along), across * along};
}

// The triangle of each strand. By count: so many on each. By area: one random number in each of `strands`
// equal parts of the summed area, which gives exactly that many and spreads them more evenly than independent
// draws.
std::vector<std::int32_t> triangles_of_strands(const scene::Grow& p, const Scalp& scalp,
                                               const std::vector<std::int32_t>& selected) {
  std::vector<std::int32_t> chosen;
  if (p.strands_per_triangle > 0) {
    for (const std::int32_t triangle : selected)
      chosen.insert(chosen.end(), p.strands_per_triangle, triangle);
    return chosen;
  }
  std::vector<double> area_up_to;
  double total = 0;
  for (const std::int32_t triangle : selected) {
    area_up_to.push_back(total += length(area_vector(scalp, scalp.triangles[triangle])));
  }
  Random random(static_cast<std::uint64_t>(p.seed), ~std::uint64_t{0});
  for (int strand = 0; strand < p.strands; ++strand) {
    const double at = total * ((strand + random.uniform()) / p.strands);
    const auto found = std::upper_bound(area_up_to.begin(), area_up_to.end(), at) - area_up_to.begin();
    chosen.push_back(selected[std::min<std::size_t>(found, selected.size() - 1)]);
  }
  return chosen;
}

Root make_root(const Scalp& scalp, const std::vector<Vec3>& normals, std::int32_t index, Random& random) {
  const Triangle& triangle = scalp.triangles[index];
  const Vec3 weights = uniform_barycentric(random);
  Root root{{index, weights}, Vec3::Zero(), Vec3::Zero()};
  for (int k = 0; k < 3; ++k) {
    root.position += weights[k] * scalp.vertices[triangle[k]];
    root.normal += weights[k] * normals[triangle[k]];
  }
  const Vec3 area = area_vector(scalp, triangle);
  root.normal = unit(root.normal, area / length(area));
  return root;
}

void grow_strand(const scene::Grow& p, const Mat3& axes, const Root& root, Random& random, Strands& out) {
  const Vec3 up = axes.col(1);
  Vec3 noise;
  for (int k = 0; k < 3; ++k) noise[k] = random.symmetric();
  Vec3 direction = unit(root.normal + p.direction_noise * noise, root.normal);
  const double step = p.step * (1 + p.length_variation * random.symmetric());
  Vec3 point = root.position;
  out.points.push_back(point);
  for (int i = 1; i < p.particles; ++i) {
    const double droop = (i - 1) * p.gravity_influence;
    const Vec3 bent = direction - droop * std::max(p.max_deviation, 1 - std::abs(dot(direction, up))) * up;
    const auto [cosine, sine] = cos_sin(i * p.helix_frequency);
    const Vec3 helix = p.helix_radius * cosine * axes.col(0) + up + p.helix_radius * sine * axes.col(2);
    direction = unit(bent + p.helix_impact * (bent - helix), direction);
    point += step * direction;
    out.points.push_back(point);
  }
  out.offsets.push_back(static_cast<std::int64_t>(out.points.size()));
}
}  // namespace

Strands grow(const scene::Grow& p, const Scalp& scalp, scene::Axis up) {
  const std::vector<std::int32_t> triangles =
      triangles_of_strands(p, scalp, select_triangles(scalp, p.scalp));
  const std::vector<Vec3> normals = vertex_normals(scalp);
  const Mat3 axes = up_rotation(scene::Axis::kY, up);
  Strands strands;
  strands.points.reserve(triangles.size() * static_cast<std::size_t>(p.particles));
  for (std::size_t strand = 0; strand < triangles.size(); ++strand) {
    Random random(static_cast<std::uint64_t>(p.seed), strand);
    const Root root = make_root(scalp, normals, triangles[strand], random);
    strands.roots.push_back(root.site);
    grow_strand(p, axes, root, random, strands);
  }
  strands.widths.assign(strands.points.size(), static_cast<float>(p.width));
  strands.groups.assign(strands.size(), 0);
  strands.group_names = {"grown"};
  return strands;
}

}  // namespace ringlet::groom
