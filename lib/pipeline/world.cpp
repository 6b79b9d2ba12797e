#include "pipeline/world.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "core/error.h"
#include "core/log.h"
#include "core/trace.h"
#include "effects/solids/penetration.h"
#include "groom/closest_triangle.h"
#include "groom/edit.h"
#include "kernels/solid/response.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::pipeline {

double first_time(const scene::Frames& frames) { return -frames.preroll / frames.fps; }

double time_of(const scene::Frames& frames, int frame, int substep, int substeps) {
  if (substep % substeps == 0) return (frame - frames.first + substep / substeps) / frames.fps;
  return (static_cast<double>(frame - frames.first) * substeps + substep) / (frames.fps * substeps);
}

double mean_length(const World& world) {
  const groom::Strands& strands = world.simulated.strands;
  double sum = 0;
  for (std::size_t s = 0; s < strands.size(); ++s)
    for (auto i = strands.offsets[s] + 1; i < strands.offsets[s + 1]; ++i)
      sum += (strands.points[i] - strands.points[i - 1]).norm();
  return sum / static_cast<double>(strands.size());
}

groom::Scalp scalp_of(const solids::AnimatedMesh& head) {
  return {head.rest_vertices(), head.triangles(), head.mesh_of_triangle(), head.mesh_names()};
}

namespace {

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

std::optional<groom::Attachment> attach(const World& world, const scene::Groom& desc,
                                        groom::Strands& strands) {
  if (desc.attach == scene::Attach::kFixed) return std::nullopt;
  std::optional<groom::Attachment> attachment =
      groom::Attachment::to_head(strands, scalp_of(*world.head), desc);
  attachment->place(strands);
  return attachment;
}

// One groom's strands, as they are held.
struct Held {
  groom::Strands strands;
  std::optional<groom::Attachment> attachment;  // empty: fixed
  std::vector<std::int32_t> skin;               // [strands] as Skin::triangles
  std::vector<unsigned char> guides;            // [strands] 1: simulated

  std::size_t size() const { return strands.size(); }
};

// The strands that are marked.
Held select(const Held& held, const std::vector<unsigned char>& marks) {
  Held chosen{groom::select(held.strands, marks), std::nullopt, {}, {}};
  if (held.attachment) chosen.attachment = held.attachment->select(marks);
  for (std::size_t s = 0; s < marks.size(); ++s)
    if (marks[s]) chosen.skin.push_back(held.skin[s]), chosen.guides.push_back(held.guides[s]);
  return chosen;
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
void clear_head(const scene::Scene& scene, const scene::Groom& desc, World& world, Held& held) {
  auto& [strands, attachment, skin, guides] = held;
  // A hair mesh's strands are where the mesh puts them.
  if (world.skin.home < 0 || scene.model.type == scene::ModelType::kHairMesh) {
    skin.assign(strands.size(), kernels::kNoSkin);
    return;
  }
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
  const auto lost = std::inner_product(prune.begin(), prune.end(), guides.begin(), std::int64_t{0});
  if (desc.interpolate && lost > 0)
    log_warning(
        fmt::format("{}: {} guides start inside the head and are pruned", desc.interpolate->pointer, lost));
  for (unsigned char& mark : prune) mark = !mark;
  held = select(held, prune);
  if (strands.size() == 0)
    throw Error(ErrorKind::kInput, desc.pointer, "every strand starts inside the head and was pruned",
                "use \"penetration\": \"push_out\", or check units and up axis");
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
// `counts`: the strands' particles at the start; where there is room for more, these have the tip's.
void append_stiffness(const scene::Scene& scene, const scene::Groom& desc, const groom::Strands& strands,
                      std::span<const std::int32_t> counts, std::vector<float>& out) {
  static const char* const kNames[kernels::kCouplings] = {"edge", "bend", "twist", "integrity", "angular"};
  const scene::Stiffness& base = scene.model.stiffness;
  const double values[kernels::kCouplings] = {base.edge, base.bend, base.twist, base.integrity, base.angular};
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const double last = counts[s] - 1;
    for (int i = 0; i < strands.count(s); ++i) {
      const double position = last > 0 ? std::min(i / last, 1.0) : 0;
      for (int c = 0; c < kernels::kCouplings; ++c) {
        double value = values[c];
        for (const scene::StiffnessScale& scale : desc.stiffness) {
          const bool group = scale.group.empty() || (!strands.groups.empty() &&
                                                     strands.group_names[strands.groups[s]] == scale.group);
          if (group && (scale.coupling == "all" || scale.coupling == kNames[c]))
            value *= sample_curve(scale.curve, position);
        }
        out.push_back(static_cast<float>(value));
      }
    }
  }
}

void append(const Held& held, std::int32_t groom, const scene::Groom& desc, StrandSet& to) {
  const groom::Strands& from = held.strands;
  const std::int64_t base = to.strands.offsets.back();
  for (std::size_t s = 0; s < from.size(); ++s) {
    to.strands.offsets.push_back(base + from.offsets[s + 1]);
    to.groom_of_strand.push_back(groom);
  }
  to.strands.points.insert(to.strands.points.end(), from.points.begin(), from.points.end());
  to.strands.widths.insert(to.strands.widths.end(), from.widths.begin(), from.widths.end());
  if (held.attachment) {
    const auto& sites = held.attachment->sites();
    to.sites.insert(to.sites.end(), sites.begin(), sites.end());
    to.roots->add_attached(*held.attachment, root_points(from));
  } else {
    to.sites.resize(to.sites.size() + from.size());
    to.roots->add_fixed(desc.animation, root_points(from));
  }
}

std::vector<std::int32_t> counts_of(const groom::Strands& strands) {
  std::vector<std::int32_t> counts;
  for (std::size_t s = 0; s < strands.size(); ++s) counts.push_back(strands.count(s));
  return counts;
}

// Of the scene's grooming what is done to this groom.
std::vector<scene::GroomingOperation> operations_on(const scene::Scene& scene, const scene::Groom& desc) {
  std::vector<scene::GroomingOperation> operations;
  for (const scene::GroomingOperation& operation : scene.effects.grooming)
    if (operation.groom.empty() || operation.groom == desc.name) operations.push_back(operation);
  return operations;
}

// Room at the tips for what grooming may add, filled with the tip itself.
groom::Strands with_room(const scene::Scene& scene, const scene::Groom& desc, const groom::Strands& strands) {
  constexpr std::size_t kMost = 16384;  // particles of a strand: beyond, a length is a mistake of units
  const std::vector<scene::GroomingOperation> operations = operations_on(scene, desc);
  if (operations.empty()) return strands;
  groom::Strands roomy = strands;
  roomy.points.clear(), roomy.widths.clear(), roomy.offsets = {0};
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const std::size_t first = strands.offsets[s], count = strands.count(s);
    const std::size_t room =
        std::max(count, groom::most_particles(std::span(strands.points).subspan(first, count), operations));
    if (room > std::max(count, kMost))
      throw Error(ErrorKind::kInput, "/effects/grooming",
                  fmt::format("lengthens strand {} of groom `{}` to {} particles, expected at most {}", s,
                              desc.name, room, kMost),
                  "lengthen by less, or with \"mode\": \"scale\"; a groom of fewer particles a metre has "
                  "room for more");
    for (std::size_t i = 0; i < room; ++i) {
      roomy.points.push_back(strands.points[first + std::min(i, count - 1)]);
      roomy.widths.push_back(strands.widths[first + std::min(i, count - 1)]);
    }
    roomy.offsets.push_back(static_cast<std::int64_t>(roomy.points.size()));
  }
  return roomy;
}

groom::Strands strands_of(const scene::Scene& scene, const scene::Groom& desc, const groom::Scalp* scalp,
                          World& world) {
  if (scene.model.type != scene::ModelType::kHairMesh) return groom::build(desc, scene.units, scalp);
  groom::HairMesh mesh = groom::read_scene_hair_mesh(desc, scene.units);
  groom::HairMeshStrands strands = groom::scene_strands(desc, mesh);
  world.hair_meshes.push_back({std::move(mesh), std::move(strands)});
  return world.hair_meshes.back().strands.strands();
}

void build_groom(const scene::Scene& scene, std::size_t index, bool scales_stiffness, World& world) {
  const scene::Groom& desc = scene.grooms[index];
  trace::Span span("groom", "set-up");
  span.tell("name", desc.name);
  const std::optional<groom::Scalp> scalp =
      world.head ? std::optional<groom::Scalp>(scalp_of(*world.head)) : std::nullopt;
  Held held{strands_of(scene, desc, scalp ? &*scalp : nullptr, world), std::nullopt, {}, {}};
  groom::Strands& strands = held.strands;
  if (strands.widths.empty()) strands.widths.assign(strands.points.size(), static_cast<float>(desc.width));
  held.guides.assign(strands.size(), 1);
  if (desc.interpolate) held.guides = groom::choose_guides(strands, *desc.interpolate);
  held.attachment = attach(world, desc, strands);
  clear_head(scene, desc, world, held);
  if (std::find(held.guides.begin(), held.guides.end(), 1) == held.guides.end())
    throw Error(ErrorKind::kInput, desc.interpolate->pointer,
                "every guide starts inside the head and was pruned",
                "choose other guides, or use \"penetration\": \"push_out\"");
  const auto groom = static_cast<std::int32_t>(index);
  std::vector<std::int32_t> counts = counts_of(strands);
  strands = with_room(scene, desc, strands);  // one that interpolates is not groomed, and stays as it is
  if (world.interpolated) {
    append(held, groom, desc, world.interpolated->all);
    world.interpolated->interpolation.add(strands, held.guides,
                                          desc.interpolate ? desc.interpolate->neighbours : 1);
  }
  if (desc.interpolate) {
    held = select(held, held.guides);
    counts = counts_of(strands);
  }
  world.living.insert(world.living.end(), counts.begin(), counts.end());
  world.skin.triangles.insert(world.skin.triangles.end(), held.skin.begin(), held.skin.end());
  if (scales_stiffness) append_stiffness(scene, desc, strands, counts, world.stiffness);
  append(held, groom, desc, world.simulated);
}

// The most guides that a strand follows; 0 where none is to follow any.
int most_neighbours(const scene::Scene& scene) {
  int most = 0;
  if (scene.cache.strands == scene::StoredStrands::kGuides) return most;
  for (const scene::Groom& groom : scene.grooms)
    if (groom.interpolate) most = std::max(most, groom.interpolate->neighbours);
  return most;
}

}  // namespace

World build_world(const scene::Scene& scene) {
  const trace::Span span("world", "set-up");
  World world;
  if (scene.head) world.head = std::make_unique<solids::AnimatedMesh>(*scene.head, scene.units, scene.frames);
  build_solids(scene, world);
  world.simulated.roots = std::make_unique<Roots>(world.head.get(), scene.frames);
  if (const int neighbours = most_neighbours(scene)) {
    world.interpolated = std::make_unique<Interpolated>(Interpolated{{}, groom::Interpolation(neighbours)});
    world.interpolated->all.roots = std::make_unique<Roots>(world.head.get(), scene.frames);
  }
  const bool scales = std::any_of(scene.grooms.begin(), scene.grooms.end(),
                                  [](const scene::Groom& groom) { return !groom.stiffness.empty(); });
  for (std::size_t k = 0; k < scene.grooms.size(); ++k) build_groom(scene, k, scales, world);
  return world;
}

}  // namespace ringlet::pipeline
