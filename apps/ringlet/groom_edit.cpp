// ringlet groom trim|lengthen|comb|resample: operations on whole groom files.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "core/error.h"
#include "groom/edit.h"
#include "groom/groom.h"
#include "groom_files.h"
#include "solids/mesh_distance.h"

namespace ringlet::app {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& what, const std::string& hint = {}) {
  throw Error(ErrorKind::kUsage, option, what, hint);
}

// Options of which one is to be given, and whether each is.
using Choices = std::vector<std::pair<std::string, bool>>;

void check_one_of(const Choices& choices) {
  std::vector<std::string> all, given;
  for (const auto& [name, is_given] : choices) {
    all.push_back(name);
    if (is_given) given.push_back(name);
  }
  if (given.size() == 1) return;
  refuse(given.empty() ? all.front() : given.front(),
         given.empty()
             ? "is missing, and so is what may stand for it"
             : fmt::format("is given together with {}", fmt::join(given.begin() + 1, given.end(), ", ")),
         fmt::format("give one of {}", fmt::join(all, ", ")));
}

void check_positive(const std::string& option, double value) {
  if (!(value > 0 && std::isfinite(value)))
    refuse(option, fmt::format("found {}, expected a number above 0", value));
}

Vec3 point_at(const std::string& option, const std::vector<double>& numbers, std::size_t first) {
  const Vec3 point(numbers[first], numbers[first + 1], numbers[first + 2]);
  if (!point.allFinite()) refuse(option, "found a number that is not finite");
  return point;
}

// ---- What an operation is, in metres -----------------------------------------------------------------

scene::Plane plane_of(const std::vector<double>& numbers, double metres) {
  const Vec3 normal = point_at("--plane", numbers, 3);
  if (!(normal.norm() > 0)) refuse("--plane", "the normal is 0 0 0, expected a direction");
  return {metres * point_at("--plane", numbers, 0), normal.normalized()};
}

std::array<Vec3, 2> box_of(const std::vector<double>& numbers, double metres) {
  const Vec3 a = metres * point_at("--box", numbers, 0), b = metres * point_at("--box", numbers, 3);
  if (!((a - b).cwiseAbs().minCoeff() > 0))
    refuse("--box", "has no inside", "give two corners that differ in x, y and z");
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

scene::Sphere sphere_of(const std::vector<double>& numbers, double metres) {
  check_positive("--sphere", numbers[3]);
  return {metres * point_at("--sphere", numbers, 0), metres * numbers[3]};
}

scene::Trim trim_of(const GroomTrimOptions& options, double metres) {
  check_one_of({{"--plane", !options.plane.empty()},
                {"--box", !options.box.empty()},
                {"--sphere", !options.sphere.empty()},
                {"--mesh", options.mesh.has_value()},
                {"--length", options.length.has_value()}});
  if (options.length && options.keep_inside) refuse("--keep", "is given together with --length");
  if (options.mesh_unit && !options.mesh) refuse("--mesh-unit", "is given without --mesh");
  scene::Trim trim{};
  trim.keep_inside = options.keep_inside;
  if (!options.plane.empty()) trim.plane = plane_of(options.plane, metres);
  if (!options.box.empty()) trim.box = box_of(options.box, metres);
  if (!options.sphere.empty()) trim.sphere = sphere_of(options.sphere, metres);
  if (options.length) {
    check_positive("--length", *options.length);
    trim.length = metres * *options.length;
  }
  if (options.mesh) {
    trim.mesh.emplace().file = *options.mesh;
    if (options.mesh_unit) trim.mesh->units.metres_per_unit = metres_in("--mesh-unit", *options.mesh_unit);
  }
  return trim;
}

scene::Lengthen lengthen_of(const GroomLengthenOptions& options, double metres) {
  check_one_of({{"--by", options.by.has_value()},
                {"--to", options.to.has_value()},
                {"--factor", options.factor.has_value()}});
  scene::Lengthen lengthen{};
  lengthen.mode = options.scale ? scene::Lengthening::kScale : scene::Lengthening::kExtend;
  if (options.by) check_positive("--by", *options.by), lengthen.by = metres * *options.by;
  if (options.to) check_positive("--to", *options.to), lengthen.to = metres * *options.to;
  if (options.factor) {
    if (!(*options.factor >= 1 && *options.factor <= 1000))
      refuse("--factor", fmt::format("found {}, expected 1 to 1000", *options.factor));
    lengthen.factor = options.factor;
  }
  return lengthen;
}

std::vector<Vec3> curve_of(const GroomCombOptions& options, const scene::Units& units) {
  check_one_of({{"--curve", !options.curve.empty()}, {"--curve-file", options.curve_file.has_value()}});
  std::vector<Vec3> curve;
  if (options.curve_file) {
    const groom::Strands strands = groom::read(*options.curve_file, {}, {}, units);
    if (options.curve_strand >= strands.size())
      refuse("--curve-strand",
             fmt::format("{} has no strand {}, they are numbered from 0 to {}", options.curve_file->string(),
                         options.curve_strand, strands.size() - 1));
    curve.assign(strands.points.begin() + strands.offsets[options.curve_strand],
                 strands.points.begin() + strands.offsets[options.curve_strand + 1]);
  } else {
    if (options.curve.size() % 3 != 0)
      refuse("--curve", fmt::format("found {} numbers, expected three for each point", options.curve.size()));
    for (std::size_t i = 0; i < options.curve.size(); i += 3)
      curve.push_back(units.metres_per_unit * point_at("--curve", options.curve, i));
  }
  const bool leads_somewhere =
      std::any_of(curve.begin(), curve.end(), [&](const Vec3& point) { return point != curve.front(); });
  if (!leads_somewhere)
    refuse(options.curve_file ? "--curve-file" : "--curve", "leads nowhere",
           "give two different points or more");
  return curve;
}

// ---- The commands -------------------------------------------------------------------------------------

// Reads, does it, writes.
int edit_file(const GroomFileOptions& files, const scene::Units& units, const std::string& name,
              decltype(scene::GroomingOperation::what) what, const groom::SignedDistance& cutter = {}) {
  groom::Strands strands = groom::read(files.input, files.skin, {}, units);
  const scene::GroomingOperation operation{0, {}, std::move(what), name + " of " + files.input.string()};
  groom::edit(strands, operation, cutter);
  write_groom(files.output, strands, units.up);
  return 0;
}

}  // namespace

int run_groom_trim(const GroomTrimOptions& options) {
  check_output(options.files.output);
  const scene::Trim trim = trim_of(options, metres_in("--unit", options.files.unit));
  const scene::Units units = units_of(options.files);
  const auto cutter = trim.mesh ? solids::distance_to(*trim.mesh, units) : groom::SignedDistance();
  return edit_file(options.files, units, "trim", trim, cutter);
}

int run_groom_lengthen(const GroomLengthenOptions& options) {
  check_output(options.files.output);
  const scene::Lengthen lengthen = lengthen_of(options, metres_in("--unit", options.files.unit));
  return edit_file(options.files, units_of(options.files), "lengthen", lengthen);
}

int run_groom_comb(const GroomCombOptions& options) {
  check_output(options.files.output);
  check_positive("--radius", options.radius);
  if (!(options.strength >= 0 && options.strength <= 1))
    refuse("--strength", fmt::format("found {}, expected 0 to 1", options.strength));
  const scene::Units units = units_of(options.files);
  const scene::Comb comb{curve_of(options, units), units.metres_per_unit * options.radius, options.strength};
  return edit_file(options.files, units, "comb", comb);
}

int run_groom_resample(const GroomResampleOptions& options) {
  check_output(options.files.output);
  check_one_of({{"--particles", options.particles.has_value()}, {"--step", options.step.has_value()}});
  if (options.particles && *options.particles < 2)
    refuse("--particles", fmt::format("found {}, expected 2 or more", *options.particles));
  const scene::Units units = units_of(options.files);
  std::optional<double> step;
  if (options.step) check_positive("--step", *options.step), step = units.metres_per_unit * *options.step;
  const groom::Strands strands = groom::read(options.files.input, options.files.skin, {}, units);
  write_groom(options.files.output, groom::resample(strands, options.particles, step), units.up);
  return 0;
}

}  // namespace ringlet::app
