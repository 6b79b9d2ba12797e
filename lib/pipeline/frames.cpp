#include "pipeline/frames.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace ringlet::pipeline {

bool asks_for(const scene::Scene& scene, const char* field) {
  const auto& fields = scene.cache.fields;
  return std::find(fields.begin(), fields.end(), field) != fields.end();
}

namespace {

const StrandSet& strands_of_cache(const World& world) {
  return world.interpolated ? world.interpolated->all : world.simulated;
}

const char* axis_name(scene::Axis axis) {
  return axis == scene::Axis::kX ? "x" : axis == scene::Axis::kY ? "y" : "z";
}

std::string unit_name(double metres) {
  return metres == 1 ? "m" : metres == 0.01 ? "cm" : metres == 0.001 ? "mm" : fmt::format("{} m", metres);
}

std::vector<float> in_units(std::span<const Vec3> points, double unit) {
  std::vector<float> out;
  out.reserve(3 * points.size());
  for (const Vec3& p : points)
    for (int c = 0; c < 3; ++c) out.push_back(static_cast<float>(p[c] / unit));
  return out;
}

state::Interpolation interpolation_of(const scene::Scene& scene, const groom::Interpolation& from) {
  state::Interpolation to;
  to.neighbours = from.neighbours();
  to.guides.assign(from.guides().begin(), from.guides().end());
  to.guide.assign(from.guide().begin(), from.guide().end());
  to.weight.assign(from.weight().begin(), from.weight().end());
  to.guides_apart = scene.cache.strands == scene::StoredStrands::kBoth;
  return to;
}

// The simulated strands at a time.
template <class T>
struct Simulated {
  const state::StrandModel<T>& model;
  const state::StrandState<T>& state;
  const std::vector<std::int64_t>& offsets;

  // Calls visit(particle, strand, i): particle `particle` of all is at the i-th of its strand.
  template <class Visit>
  void each(const Visit& visit) const {
    tbb::parallel_for(std::size_t{0}, model.layout.strands(), [&](std::size_t s) {
      const int tip = model.living(s) - 1;
      for (int i = 0; i < model.layout.count(s); ++i) visit(offsets[s] + i, s, std::min(i, tip));
    });
  }
  Vec3 vector(const state::AlignedVector<T>& array, std::size_t strand, int i) const {
    const auto at = [&](int c) { return static_cast<double>(array[model.layout.at(strand, i, 3, c)]); };
    return {at(0), at(1), at(2)};
  }
  Vec3 root(std::size_t strand) const {
    const auto at = [&](int c) { return state.root_points[model.layout.at_strand(strand, 3, c)]; };
    return {at(0), at(1), at(2)};
  }

  std::vector<Vec3> positions() const {
    std::vector<Vec3> out(offsets.back());
    each(
        [&](auto particle, std::size_t s, int i) { out[particle] = root(s) + vector(state.position, s, i); });
    return out;
  }
  std::vector<Vec3> velocities() const {
    std::vector<Vec3> out(offsets.back());
    each([&](auto particle, std::size_t s, int i) { out[particle] = vector(state.velocity, s, i); });
    return out;
  }
  std::vector<float> elongations() const {
    std::vector<float> out(offsets.back());
    each([&](auto particle, std::size_t s, int i) {
      out[particle] = static_cast<float>(state.elongation[model.layout.at(s, i, 1, 0)]);
    });
    return out;
  }
};

std::vector<Vec3> follow(const World& world, const std::vector<Vec3>& guides, double time) {
  std::vector<Pose> poses(world.simulated.strands.size());
  world.simulated.roots->pose(time, poses);
  std::vector<Mat3> rotations;
  for (const Pose& pose : poses) rotations.push_back(pose.rotation);
  const StrandSet& all = world.interpolated->all;
  poses.resize(all.strands.size());
  all.roots->pose(time, poses);
  std::vector<Vec3> roots;
  for (const Pose& pose : poses) roots.push_back(pose.position);
  std::vector<Vec3> out(all.strands.points.size());
  world.interpolation().follow({guides, rotations}, roots, out);
  return out;
}

// The change of what follows over the last substep h, the guides going straight: as the solver has the
// velocity of a root, so that a follower of a guide that moves rigidly has that guide's.
std::vector<Vec3> follow_velocities(const scene::Scene& scene, const World& world,
                                    const std::vector<Vec3>& guides, const std::vector<Vec3>& velocities,
                                    const std::vector<Vec3>& now, double time, double step) {
  std::vector<Vec3> out(now.size(), Vec3::Zero());
  const double first = first_time(scene.frames);
  if (time < first + 0.5 * step) return out;  // nothing has moved yet
  std::vector<Vec3> before = guides;
  for (std::size_t i = 0; i < before.size(); ++i) before[i] -= step * velocities[i];
  const std::vector<Vec3> followed = follow(world, before, std::max(time - step, first));
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = (now[i] - followed[i]) / step;
  return out;
}

// How much longer than at rest the segments of followers are: guides keep their lengths, what follows them
// need not.
state::Figures follower_figures(const World& world, const std::vector<Vec3>& now) {
  const groom::Strands& all = world.interpolated->all.strands;
  std::vector<double> strains;
  for (std::size_t s = 0; s < all.size(); ++s)
    for (auto i = all.offsets[s]; i + 1 < all.offsets[s + 1]; ++i)
      if (const double rest = (all.points[i + 1] - all.points[i]).norm(); rest > 0)
        strains.push_back(std::abs((now[i + 1] - now[i]).norm() / rest - 1));
  if (strains.empty()) return {};
  const auto high =
      strains.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(strains.size() - 1));
  std::nth_element(strains.begin(), high, strains.end());
  const double p99 = *high;
  return {{"edge_strain_all", *std::max_element(strains.begin(), strains.end())},
          {"edge_strain_all_p99", p99}};
}

template <class T>
void add_strands(const scene::Scene& scene, const World& world, const Simulated<T>& simulated, double step,
                 state::Frame& frame) {
  const double unit = scene.units.metres_per_unit;
  const bool velocity = asks_for(scene, "velocity"), elongation = asks_for(scene, "elongation");
  const std::vector<Vec3> positions = simulated.positions();
  if (!world.interpolated) {
    frame.position = in_units(positions, unit);
    if (velocity) frame.velocity = in_units(simulated.velocities(), unit);
    if (elongation) frame.elongation = simulated.elongations();
    return;
  }
  const std::vector<Vec3> followed = follow(world, positions, frame.time);
  frame.position = in_units(followed, unit);
  frame.figures = follower_figures(world, followed);
  if (scene.cache.strands == scene::StoredStrands::kBoth) frame.guide_position = in_units(positions, unit);
  if (velocity)
    frame.velocity = in_units(
        follow_velocities(scene, world, positions, simulated.velocities(), followed, frame.time, step), unit);
  if (!elongation) return;
  frame.elongation.resize(frame.position.size() / 3);
  world.interpolation().blend(simulated.elongations(), frame.elongation);
}

void add_surfaces(const scene::Scene& scene, const World& world, state::Frame& frame) {
  if (!asks_for(scene, "solids")) return;
  for (const solids::AnimatedMesh* mesh : world.shown) {
    std::vector<Vec3> vertices(mesh->vertex_count());
    mesh->sample(frame.time, vertices);
    frame.surface_vertices.push_back(in_units(vertices, scene.units.metres_per_unit));
  }
}

}  // namespace

std::int64_t strand_in_cache(const World& world, std::int64_t simulated) {
  return world.interpolated ? world.interpolation().guides()[simulated] : simulated;
}

state::RunHeader make_header(const scene::Scene& scene, const World& world) {
  const double unit = scene.units.metres_per_unit;
  const StrandSet& set = strands_of_cache(world);
  state::RunHeader header;
  header.name = scene.name;
  header.scene_json = scene.resolved;
  header.scene_hash = scene.hash;
  header.metres_per_unit = unit;
  header.length_unit = unit_name(unit);
  header.up = axis_name(scene.units.up);
  header.fps = scene.frames.fps;
  header.offsets = set.strands.offsets;
  for (const groom::RootSite& site : set.sites) {
    header.root_triangle.push_back(site.triangle);
    for (int c = 0; c < 3; ++c) header.root_barycentric.push_back(static_cast<float>(site.barycentric[c]));
  }
  header.rest_position = in_units(set.strands.points, unit);
  for (const float width : set.strands.widths) header.width.push_back(static_cast<float>(width / unit));
  header.groom_of_strand = set.groom_of_strand;
  for (const scene::Groom& groom : scene.grooms) header.groom_names.push_back(groom.name);
  if (world.interpolated) header.interpolation = interpolation_of(scene, world.interpolation());
  if (!asks_for(scene, "solids")) return header;
  for (std::size_t k = 0; k < world.shown.size(); ++k) {
    state::Surface surface{world.shown_names[k], {}};
    for (const Triangle& t : world.shown[k]->triangles())
      surface.triangles.insert(surface.triangles.end(), t.begin(), t.end());
    header.surfaces.push_back(std::move(surface));
  }
  return header;
}

template <class T>
state::Frame make_frame(const scene::Scene& scene, const World& world, const state::StrandModel<T>& model,
                        const state::StrandState<T>& state, int number, double time, double step) {
  state::Frame frame;
  frame.number = number;
  frame.time = time;
  add_strands(scene, world, Simulated<T>{model, state, world.simulated.strands.offsets}, step, frame);
  if (!scene.effects.grooming.empty()) {
    // Grooming is for grooms whose strands are all simulated; of the others every strand keeps its particles.
    const StrandSet& set = strands_of_cache(world);
    for (std::size_t s = 0; s < set.strands.size(); ++s) frame.living.push_back(set.strands.count(s));
    for (std::size_t s = 0; s < model.layout.strands(); ++s)
      frame.living[strand_in_cache(world, static_cast<std::int64_t>(s))] = model.living(s);
  }
  add_surfaces(scene, world, frame);
  return frame;
}

state::Frame make_frame(const scene::Scene& scene, const World& world, std::span<const Vec3> positions,
                        std::span<const Vec3> velocities, int number, double time) {
  state::Frame frame;
  frame.number = number;
  frame.time = time;
  frame.position = in_units(positions, scene.units.metres_per_unit);
  if (asks_for(scene, "velocity")) frame.velocity = in_units(velocities, scene.units.metres_per_unit);
  add_surfaces(scene, world, frame);
  return frame;
}

template state::Frame make_frame(const scene::Scene&, const World&, const state::StrandModel<float>&,
                                 const state::StrandState<float>&, int, double, double);
template state::Frame make_frame(const scene::Scene&, const World&, const state::StrandModel<double>&,
                                 const state::StrandState<double>&, int, double, double);

}  // namespace ringlet::pipeline
