#include "pipeline/world.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/log.h"
#include "effects/solids/penetration.h"
#include "groom/closest_triangle.h"
#include "kernels/solid/response.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::pipeline {

double first_time(const scene::Frames& frames) { return -frames.preroll / frames.fps; }

namespace {

groom::Scalp scalp_of(const solids::AnimatedMesh& head) {
  return {head.rest_vertices(), head.triangles(), head.mesh_of_triangle(), head.mesh_names()};
}

void build_solids(const scene::Scene& scene, World& world) {
  if (world.head) world.shown.push_back(world.head.get()), world.shown_names.push_back("head");
  for (const scene::Solid& desc : scene.effects.solids) {
    const solids::AnimatedMesh* mesh = world.head.get();
    if (!desc.is_head) {
      mesh = &world.solid_meshes.emplace_back(*desc.mesh, scene.units, scene.frames);
      world.shown.push_back(mesh), world.shown_names.push_back(desc.name);
    }
    if (desc.proxy) mesh = &world.solid_meshes.emplace_back(*desc.proxy, scene.units, scene.frames);
    if (desc.is_head)
      world.skin.home = static_cast<std::int32_t>(world.solids.size()), world.home_mesh = mesh;
    world.solids.emplace_back(desc, *mesh, scene.frames, first_time(scene.frames),
                              desc.level_set_cache.value_or(std::filesystem::path{}));
  }
}

// One groom's root poses at the run's first time.
std::vector<Pose> first_poses(const World& world, const scene::Scene& scene, const scene::Groom& desc,
                              const std::optional<groom::Attachment>& attachment,
                              const std::vector<Vec3>& rest) {
  Roots roots(world.head.get(), scene.frames);
  if (attachment)
    roots.add_attached(*attachment, rest);
  else
    roots.add_fixed(desc.animation, rest);
  std::vector<Pose> poses(rest.size());
  roots.pose(first_time(scene.frames), poses);
  return poses;
}

std::vector<Vec3> root_points(const groom::Strands& strands) {
  std::vector<Vec3> points(strands.size());
  for (std::size_t s = 0; s < points.size(); ++s) points[s] = strands.points[strands.offsets[s]];
  return points;
}

groom::Strands without(const groom::Strands& strands, const std::vector<unsigned char>& prune) {
  groom::Strands kept;
  kept.group_names = strands.group_names;
  for (std::size_t s = 0; s < strands.size(); ++s) {
    if (prune[s]) continue;
    const auto begin = strands.offsets[s], end = strands.offsets[s + 1];
    kept.points.insert(kept.points.end(), strands.points.begin() + begin, strands.points.begin() + end);
    if (!strands.widths.empty())
      kept.widths.insert(kept.widths.end(), strands.widths.begin() + begin, strands.widths.begin() + end);
    if (!strands.roots.empty()) kept.roots.push_back(strands.roots[s]);
    if (!strands.groups.empty()) kept.groups.push_back(strands.groups[s]);
    kept.offsets.push_back(static_cast<std::int64_t>(kept.points.size()));
  }
  return kept;
}

std::optional<groom::Attachment> attach(const World& world, const scene::Groom& desc,
                                        groom::Strands& strands) {
  if (desc.attach == scene::Attach::kFixed) return std::nullopt;
  std::optional<groom::Attachment> attachment =
      groom::Attachment::to_head(strands, scalp_of(*world.head), desc);
  attachment->place(strands);
  return attachment;
}

// The triangles of the home solid that strands grow on. Its surface begins with the head's triangles; on a
// proxy it is the one nearest in the rest pose.
std::vector<std::int32_t> find_skin(const scene::Scene& scene, const World& world,
                                    const groom::Attachment* attachment, const groom::Strands& strands) {
  std::vector<std::int32_t> skin(strands.size(), kernels::kNoSkin);
  if (!attachment) return skin;
  std::optional<groom::ClosestTriangle> proxy;
  if (scene.effects.solids[static_cast<std::size_t>(world.skin.home)].proxy)
    proxy.emplace(world.home_mesh->rest_vertices(), world.home_mesh->triangles());
  for (std::size_t s = 0; s < skin.size(); ++s)
    skin[s] =
        proxy ? proxy->find(strands.points[strands.offsets[s]]).triangle : attachment->sites()[s].triangle;
  return skin;
}

// Moves what starts inside the head out of it, in the rest shape; says how much that was.
void clear_head(const scene::Scene& scene, const scene::Groom& desc, World& world, groom::Strands& strands,
                std::optional<groom::Attachment>& attachment, std::vector<std::int32_t>& skin) {
  if (world.skin.home < 0) return;
  skin = find_skin(scene, world, attachment ? &*attachment : nullptr, strands);

  const std::vector<Vec3> rest = root_points(strands);
  const std::vector<Pose> poses = first_poses(world, scene, desc, attachment, rest);
  std::vector<Vec3> points = strands.points;
  for (std::size_t s = 0; s < strands.size(); ++s)
    for (auto i = strands.offsets[s]; i < strands.offsets[s + 1]; ++i)
      points[i] = poses[s].rotation * (strands.points[i] - rest[s]) + poses[s].position;
  const std::vector<Vec3> posed = points;
  std::vector<unsigned char> prune(strands.size(), 0);
  const double time = first_time(scene.frames);
  const effects::PenetrationReport report = effects::resolve_penetration(
      desc.penetration, world.solids[static_cast<std::size_t>(world.skin.home)].at(time, time),
      strands.offsets, points, skin, prune);
  for (std::size_t s = 0; s < strands.size(); ++s)
    for (auto i = strands.offsets[s]; i < strands.offsets[s + 1]; ++i)
      if (points[i] != posed[i])
        strands.points[i] = poses[s].rotation.transpose() * (points[i] - poses[s].position) + rest[s];
  if (report.inside > 0) {
    const char* done = desc.penetration == scene::Penetration::kPushOut ? "moved out in the rest shape"
                       : desc.penetration == scene::Penetration::kPrune ? "their strands left out"
                                                                        : "kept";
    log_info(
        fmt::format("groom `{}`: {} particles of {} strands start inside the head, the deepest {:.3g} mm: {}",
                    desc.name, report.inside, report.strands, 1e3 * report.deepest, done));
  }
  if (report.buried > 0)
    log_warning(
        fmt::format("groom `{}`: {} strands have roots deeper in the head than they are long; they do not "
                    "collide with it",
                    desc.name, report.buried));
  if (std::find(prune.begin(), prune.end(), 1) == prune.end()) return;
  strands = without(strands, prune);
  std::vector<std::int32_t> kept;
  for (std::size_t s = 0; s < prune.size(); ++s)
    if (!prune[s]) kept.push_back(skin[s]);
  skin = std::move(kept);
  if (strands.size() == 0)
    throw Error(ErrorKind::kInput, desc.pointer, "every strand starts inside the head and was pruned",
                "use \"penetration\": \"push_out\", or check units and up axis");
  attachment = attach(world, desc, strands);
}

double sample_curve(const scene::Curve& curve, double x) {
  if (x <= curve.front()[0]) return curve.front()[1];
  for (std::size_t k = 1; k < curve.size(); ++k) {
    if (x > curve[k][0]) continue;
    const double span = curve[k][0] - curve[k - 1][0];
    const double t = span > 0 ? (x - curve[k - 1][0]) / span : 1.0;
    return curve[k - 1][1] + t * (curve[k][1] - curve[k - 1][1]);
  }
  return curve.back()[1];
}

// The model's stiffness along each strand, scaled root to tip by the groom's curves.
void append_stiffness(const scene::Scene& scene, const scene::Groom& desc, const groom::Strands& strands,
                      std::vector<float>& out) {
  static const char* const kNames[kernels::kCouplings] = {"edge", "bend", "twist", "integrity", "angular"};
  const scene::Stiffness& base = scene.model.stiffness;
  const double values[kernels::kCouplings] = {base.edge, base.bend, base.twist, base.integrity, base.angular};
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const int n = strands.count(s);
    for (int i = 0; i < n; ++i) {
      for (int c = 0; c < kernels::kCouplings; ++c) {
        double value = values[c];
        for (const scene::StiffnessScale& scale : desc.stiffness) {
          const bool group = scale.group.empty() || (!strands.groups.empty() &&
                                                     strands.group_names[strands.groups[s]] == scale.group);
          if (group && (scale.coupling == "all" || scale.coupling == kNames[c]))
            value *= sample_curve(scale.curve, n > 1 ? i / (n - 1.0) : 0.0);
        }
        out.push_back(static_cast<float>(value));
      }
    }
  }
}

void append(const groom::Strands& from, std::int32_t groom, World& world) {
  groom::Strands& to = world.strands;
  const std::int64_t base = to.offsets.back();
  for (std::size_t s = 0; s < from.size(); ++s) {
    to.offsets.push_back(base + from.offsets[s + 1]);
    world.groom_of_strand.push_back(groom);
  }
  to.points.insert(to.points.end(), from.points.begin(), from.points.end());
  to.widths.insert(to.widths.end(), from.widths.begin(), from.widths.end());
}

void build_groom(const scene::Scene& scene, std::size_t index, bool scales_stiffness, World& world) {
  const scene::Groom& desc = scene.grooms[index];
  const std::optional<groom::Scalp> scalp =
      world.head ? std::optional<groom::Scalp>(scalp_of(*world.head)) : std::nullopt;
  groom::Strands strands = groom::build(desc, scene.units, scalp ? &*scalp : nullptr);
  if (strands.widths.empty()) strands.widths.assign(strands.points.size(), static_cast<float>(desc.width));
  std::optional<groom::Attachment> attachment = attach(world, desc, strands);
  std::vector<std::int32_t> skin;
  clear_head(scene, desc, world, strands, attachment, skin);
  world.skin.triangles.insert(world.skin.triangles.end(), skin.begin(), skin.end());
  if (scales_stiffness) append_stiffness(scene, desc, strands, world.stiffness);
  append(strands, static_cast<std::int32_t>(index), world);
  if (attachment) {
    world.sites.insert(world.sites.end(), attachment->sites().begin(), attachment->sites().end());
    world.roots->add_attached(std::move(*attachment), root_points(strands));
  } else {
    world.sites.resize(world.sites.size() + strands.size());
    world.roots->add_fixed(desc.animation, root_points(strands));
  }
}

}  // namespace

World build_world(const scene::Scene& scene) {
  World world;
  if (scene.head) world.head = std::make_unique<solids::AnimatedMesh>(*scene.head, scene.units, scene.frames);
  build_solids(scene, world);
  world.roots = std::make_unique<Roots>(world.head.get(), scene.frames);
  const bool scales = std::any_of(scene.grooms.begin(), scene.grooms.end(),
                                  [](const scene::Groom& groom) { return !groom.stiffness.empty(); });
  for (std::size_t k = 0; k < scene.grooms.size(); ++k) build_groom(scene, k, scales, world);
  return world;
}

}  // namespace ringlet::pipeline
