#include "info.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "cache/reader.h"
#include "core/error.h"
#include "groom/groom.h"
#include "groom/hair_mesh.h"
#include "groom/measure.h"
#include "report.h"
#include "scene/scene.h"
#include "solids/mesh.h"

namespace ringlet::app {
namespace fs = std::filesystem;
namespace {

// JSON knows no infinity and no NaN: null.
Report number(double value) { return std::isfinite(value) ? Report(value) : Report(); }

// Bounds and lengths work on points of any kind: `at(i)` is the i-th as Vec3.
template <class At>
Report bounds(std::size_t count, At at) {
  if (count == 0) return {};
  Vec3 lower = Vec3::Constant(INFINITY), upper = -lower;
  for (std::size_t i = 0; i < count; ++i) {
    lower = lower.cwiseMin(at(i));
    upper = upper.cwiseMax(at(i));
  }
  return {{"lower", {number(lower.x()), number(lower.y()), number(lower.z())}},
          {"upper", {number(upper.x()), number(upper.y()), number(upper.z())}}};
}

auto points_of(const std::vector<float>& coordinates) {
  return [&coordinates](std::size_t i) {
    return Vec3(coordinates[3 * i], coordinates[3 * i + 1], coordinates[3 * i + 2]);
  };
}

Report particles_per_strand(const std::vector<std::int64_t>& offsets) {
  if (offsets.size() < 2) return {};
  std::int64_t least = offsets[1] - offsets[0], most = least;
  for (std::size_t strand = 1; strand + 1 < offsets.size(); ++strand) {
    least = std::min(least, offsets[strand + 1] - offsets[strand]);
    most = std::max(most, offsets[strand + 1] - offsets[strand]);
  }
  return {least, most};
}

// The points and the length of the strand asked for.
template <class At>
Report strand_points(const InfoOptions& options, const std::vector<std::int64_t>& offsets, At at) {
  const auto strands = static_cast<std::int64_t>(offsets.size()) - 1;
  if (*options.strand < 0 || *options.strand >= strands) {
    throw Error(ErrorKind::kUsage, options.file.string(),
                "has no strand " + std::to_string(*options.strand) + ", they are numbered from 0 to " +
                    std::to_string(strands - 1));
  }
  const auto strand = static_cast<std::size_t>(*options.strand);
  Report points = Report::array();
  double length = 0;
  for (auto i = static_cast<std::size_t>(offsets[strand]); i < static_cast<std::size_t>(offsets[strand + 1]);
       ++i) {
    const Vec3 point = at(i);
    points.push_back({number(point.x()), number(point.y()), number(point.z())});
    if (points.size() > 1) length += (point - at(i - 1)).norm();
  }
  return {{"number", strand}, {"length", number(length)}, {"points", std::move(points)}};
}

Report strand_counts(const std::vector<std::int32_t>& group_of_strand,
                     const std::vector<std::string>& names) {
  std::vector<std::int64_t> counts(names.size(), 0);
  for (const std::int32_t group : group_of_strand)
    if (group >= 0 && static_cast<std::size_t>(group) < counts.size())
      ++counts[static_cast<std::size_t>(group)];
  Report report = Report::object();
  for (std::size_t i = 0; i < names.size(); ++i) report[names[i]] = counts[i];
  return report;
}

Report json_of(const state::Figures& figures) {
  Report report = Report::object();
  for (const auto& [name, value] : figures) report[name] = number(value);
  return report;
}

void refuse_strand(const InfoOptions& options) {
  if (options.strand)
    throw Error(ErrorKind::kUsage, options.file.string(), "has no strands of its own to print");
}

// ---- Caches ----------------------------------------------------------------------------------------

Report frames_of(const cache::CacheReader& reader) {
  const auto& header = reader.header();
  const auto& frames = reader.frames();
  const std::set<int> present(frames.begin(), frames.end());
  Report missing = Report::array();
  for (int frame = header.first_frame; frame <= header.last_frame && !reader.failure(); ++frame)
    if (!present.contains(frame)) missing.push_back(frame);
  Report report = {{"count", frames.size()}, {"fps", header.fps}};
  report["range"] = {header.first_frame, header.last_frame};
  if (!frames.empty()) report["present"] = {frames.front(), frames.back()};
  if (!missing.empty()) report["missing"] = std::move(missing);
  return report;
}

Report last_frame_of(const cache::CacheReader& reader, const InfoOptions& options) {
  if (reader.frames().empty()) return {};
  const state::Frame frame = reader.read(reader.frames().back());
  Report report = {{"frame", frame.number}, {"time", frame.time}};
  report["bounds"] = bounds(frame.position.size() / 3, points_of(frame.position));
  report["fields"] = {"position"};
  if (!frame.velocity.empty()) report["fields"].push_back("velocity");
  if (!frame.elongation.empty()) report["fields"].push_back("elongation");
  if (!frame.surface_vertices.empty()) report["fields"].push_back("solids");
  if (!frame.living.empty()) {
    const auto is_hair = [](std::int32_t particles) { return particles > 1; };
    report["living"] = {
        {"strands", std::count_if(frame.living.begin(), frame.living.end(), is_hair)},
        {"particles", std::accumulate(frame.living.begin(), frame.living.end(), std::int64_t{0})}};
  }
  report["figures"] = json_of(frame.figures);
  if (options.strand)
    report["strand"] = strand_points(options, reader.header().offsets, points_of(frame.position));
  return report;
}

Report describe_cache(const InfoOptions& options) {
  const cache::CacheReader reader(options.file);
  const auto& header = reader.header();
  Report report = {{"kind", reader.failure() ? "failed state" : "cache"}, {"name", header.name}};
  if (const auto& failure = reader.failure()) {
    report["failure"] = {{"message", failure->message},
                         {"stage", failure->stage},
                         {"frame", reader.frames()[0]},
                         {"strand", failure->strand},
                         {"particle", failure->particle}};
  }
  report["strands"] = reader.strands();
  report["particles"] = reader.particles();
  report["particles_per_strand"] = particles_per_strand(header.offsets);
  report["grooms"] = strand_counts(header.groom_of_strand, header.groom_names);
  if (const auto& followed = header.interpolation; !followed.guides.empty())
    report["interpolation"] = {{"guides", followed.guides.size()}, {"neighbours", followed.neighbours}};
  report["surfaces"] = Report::object();
  for (const auto& surface : header.surfaces) report["surfaces"][surface.name] = surface.triangles.size() / 3;
  report["frames"] = frames_of(reader);
  report["units"] = {{"length", header.length_unit}, {"metres", header.metres_per_unit}, {"up", header.up}};
  report["compression"] = cache::to_string(reader.compression());
  if (reader.error_bound() > 0) report["error_bound"] = reader.error_bound();
  report["provenance"] = {{"program", header.program_version},
                          {"backend", header.backend},
                          {"instruction_set", header.instruction_set},
                          {"precision", header.precision},
                          {"scene_hash", header.scene_hash}};
  const auto rest = points_of(header.rest_position);
  report["rest"] = {{"bounds", bounds(reader.particles(), rest)}};
  if (options.strand) report["rest"]["strand"] = strand_points(options, header.offsets, rest);
  report["last_frame"] = last_frame_of(reader, options);
  if (options.json) report["scene"] = Report::parse(header.scene_json, nullptr, false);
  return report;
}

Report describe_frame_file(const InfoOptions& options) {
  refuse_strand(options);
  const state::Frame frame = cache::read_frame_file(options.file);
  Report report = {{"kind", "frame of a cache"}, {"frame", frame.number}, {"time", frame.time}};
  report["particles"] = frame.position.size() / 3;
  report["bounds"] = bounds(frame.position.size() / 3, points_of(frame.position));
  report["figures"] = json_of(frame.figures);
  return report;
}

Report describe_state(const InfoOptions& options) {
  refuse_strand(options);
  const state::Snapshot snapshot = cache::read_state_file(options.file);
  Report report = {{"kind", "state to resume from"}, {"frame", snapshot.frame}, {"bytes", Report::object()}};
  for (const auto& [name, bytes] : snapshot.arrays) report["bytes"][name] = bytes.size();
  return report;
}

Report describe_cache_file(const InfoOptions& options) {
  switch (cache::content_of(options.file).value()) {
    case cache::Content::kFrame:
      return describe_frame_file(options);
    case cache::Content::kState:
      return describe_state(options);
    case cache::Content::kMaster:
    case cache::Content::kFailed:
      break;
  }
  return describe_cache(options);
}

// ---- Assets and scenes -----------------------------------------------------------------------------

constexpr scene::Units kMetres{1, scene::Axis::kY};

const char* axis_name(scene::Axis axis) {
  return axis == scene::Axis::kX ? "x" : axis == scene::Axis::kY ? "y" : "z";
}

// Those of a summary's figures that are asked for; null where there was nothing to measure.
Report figures_of(const std::optional<groom::Summary>& summary,
                  const std::vector<std::pair<const char*, double groom::Summary::*>>& figures) {
  if (!summary) return {};
  Report report = Report::object();
  for (const auto& [name, figure] : figures) report[name] = number((*summary).*figure);
  return report;
}

Report measures_of(const groom::Strands& strands) {
  using groom::Summary;
  const groom::Measures measures = groom::measure(strands);
  Report report = Report::object();
  report["length"] = figures_of(measures.length, {{"min", &Summary::min},
                                                  {"mean", &Summary::mean},
                                                  {"median", &Summary::median},
                                                  {"max", &Summary::max}});
  report["segment_length"] = figures_of(
      measures.segment, {{"min", &Summary::min}, {"mean", &Summary::mean}, {"max", &Summary::max}});
  report["curvature"] = figures_of(
      measures.curvature,
      {{"mean", &Summary::mean}, {"percentile_99", &Summary::percentile_99}, {"max", &Summary::max}});
  report["root_density"] = measures.root_density ? number(*measures.root_density) : Report();
  return report;
}

Report describe_groom(const InfoOptions& options) {
  scene::Units units = kMetres;
  units.up = groom::declared_units(options.file).up.value_or(units.up);
  const groom::Strands strands = groom::read(options.file, {}, {}, units);
  const auto at = [&](std::size_t i) { return strands.points[i]; };
  Report report = {{"kind", "groom"}, {"strands", strands.size()}, {"particles", strands.particles()}};
  report["particles_per_strand"] = particles_per_strand(strands.offsets);
  report["groups"] = strand_counts(strands.groups, strands.group_names);
  const bool declares = options.file.extension() == ".h5";
  const std::string unit = declares ? "m" : "unit";
  report["units"] = {{"length", declares ? "m" : "the file's own: its format declares none"},
                     {"curvature", "1/" + unit},
                     {"root_density", "roots/" + unit + "^2"}};
  if (declares) report["units"]["up"] = axis_name(units.up);
  report.update(measures_of(strands));
  report["widths"] = !strands.widths.empty();
  report["stored_roots"] = !strands.roots.empty();
  report["bounds"] = bounds(strands.points.size(), at);
  if (options.strand) report["strand"] = strand_points(options, strands.offsets, at);
  return report;
}

Report describe_hair_mesh(const InfoOptions& options) {
  refuse_strand(options);
  scene::Units units = kMetres;
  units.up = groom::declared_hair_mesh_units(options.file).up.value_or(units.up);
  const groom::HairMesh mesh = groom::read_hair_mesh(options.file, {}, units);
  const auto is_triangle = [](const groom::HairMesh::Face& face) {
    return groom::HairMesh::corners(face) == 3;
  };
  const auto triangles = std::count_if(mesh.faces.begin(), mesh.faces.end(), is_triangle);
  double area = 0;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) area += groom::scalp_area(mesh, f);
  Report report = {{"kind", "hair mesh"}};
  report["scalp_faces"] = {{"count", mesh.faces.size()},
                           {"triangles", triangles},
                           {"quads", static_cast<std::int64_t>(mesh.faces.size()) - triangles}};
  report["layers"] = mesh.layers;
  report["vertices"] = mesh.positions.size();
  report["vertices_per_layer"] = mesh.vertices();
  report["prisms"] = mesh.prisms();
  report["groups"] = strand_counts(mesh.groups, mesh.group_names);
  report["units"] = {{"length", "m"}, {"up", axis_name(units.up)}};
  report["scalp_area"] = number(area);
  report["volume"] = number(groom::volume(mesh));
  report["bounds"] = bounds(mesh.positions.size(), [&](std::size_t i) { return mesh.positions[i]; });
  return report;
}

// With the file's first clip where it has one; whether it moves is looked at over its first four seconds.
solids::AnimatedMesh open_mesh(const fs::path& file) {
  const scene::Frames frames{1, 97, 24, 0};
  scene::MeshDesc mesh{};
  mesh.file = file;
  mesh.animation.clip = "";
  try {
    return {mesh, kMetres, frames};
  } catch (const Error&) {
    mesh.animation.clip.reset();
    return {mesh, kMetres, frames};
  }
}

Report describe_mesh(const InfoOptions& options) {
  refuse_strand(options);
  const solids::AnimatedMesh mesh = open_mesh(options.file);
  static constexpr const char* kMotions[] = {"still", "rigid", "deforming"};
  Report report = {
      {"kind", "mesh"}, {"vertices", mesh.vertex_count()}, {"triangles", mesh.triangles().size()}};
  report["meshes"] = strand_counts(mesh.mesh_of_triangle(), mesh.mesh_names());
  report["motion"] = kMotions[static_cast<int>(mesh.motion())];
  report["units"] = {{"length", "m"}, {"up", "y"}};
  report["bounds"] =
      bounds(mesh.rest_vertices().size(), [&](std::size_t i) { return mesh.rest_vertices()[i]; });
  return report;
}

Report describe_scene(const InfoOptions& options) {
  refuse_strand(options);
  const scene::Scene scene = scene::load(options.file);
  Report report = {{"kind", "scene"}, {"name", scene.name}, {"hash", scene.hash}};
  report["frames"] = {{"range", {scene.frames.first, scene.frames.last}},
                      {"fps", scene.frames.fps},
                      {"preroll", scene.frames.preroll}};
  if (scene.head) report["head"] = scene.head->file.string();
  report["grooms"] = Report::object();
  for (const scene::Groom& groom : scene.grooms)
    report["grooms"][groom.name] = groom.file ? groom.file->string() : "grown";
  report["substeps"] = scene.model.substeps;
  if (const auto& choice = scene.model.substep_choice)
    report["substeps"] = {{"tolerance", choice->tolerance}, {"min", choice->min}, {"max", choice->max}};
  report["solids"] = Report::array();
  for (const scene::Solid& solid : scene.effects.solids) report["solids"].push_back(solid.name);
  report["cache_fields"] = scene.cache.fields;
  if (options.json) report["resolved"] = Report::parse(scene.resolved, nullptr, false);
  return report;
}

bool is_groom(const fs::path& file, const std::string& format) {
  static const std::set<std::string> kExtensions = {".hair", ".data", ".tfx"};
  return format == "ringlet-groom" || kExtensions.contains(file.extension().string());
}

// Only files that may be one are read for it.
bool is_hair_mesh(const fs::path& file) {
  return (file.extension() == ".json" || file.extension() == ".obj") && groom::is_hair_mesh(file);
}

Report describe(const InfoOptions& options) {
  const fs::path& file = options.file;
  std::error_code error;
  if (!fs::exists(file, error)) throw Error(ErrorKind::kInput, file.string(), "no such file");
  if (fs::is_directory(file, error)) return describe_cache(options);
  const std::string format = cache::format_of(file);
  if (format == "ringlet-cache") return describe_cache_file(options);
  if (is_groom(file, format)) return describe_groom(options);
  if (file.extension() == ".h5") return describe_cache(options);  // which says what is wrong with it
  if (is_hair_mesh(file)) return describe_hair_mesh(options);
  return file.extension() == ".json" ? describe_scene(options) : describe_mesh(options);
}

}  // namespace

int run_info(const InfoOptions& options) {
  Report report = {{"file", options.file.string()}};
  report.update(describe(options));
  print_report(report, options.json);
  return 0;
}

}  // namespace ringlet::app
