// ringlet groom hair-mesh: a hair mesh extruded from a head's scalp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "groom/extrude_hair_mesh.h"
#include "groom_files.h"
#include "solids/mesh.h"
#include "solids/mesh_distance.h"

namespace ringlet::app {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

[[noreturn]] void refuse(const std::string& option, const std::string& what, const std::string& hint = {}) {
  throw Error(ErrorKind::kUsage, option, what, hint);
}

Vec3 vector_of(const std::string& option, const std::vector<double>& numbers, std::size_t first = 0) {
  const Vec3 vector(numbers[first], numbers[first + 1], numbers[first + 2]);
  if (!vector.allFinite()) refuse(option, "found a number that is not finite");
  return vector;
}

std::optional<Vec3> direction_of(const std::string& option, const std::vector<double>& numbers) {
  if (numbers.empty()) return std::nullopt;
  const Vec3 direction = vector_of(option, numbers);
  if (!(direction.norm() > 0)) refuse(option, "found 0 0 0, expected a direction");
  return direction;
}

double angle_of(const std::string& option, double degrees) {
  if (!(degrees > 0 && degrees <= 180))
    refuse(option, fmt::format("found {}, expected above 0 to 180", degrees));
  return degrees * kDegree;
}

scene::Axis axis_of(const std::string& name) {
  if (name == "x") return scene::Axis::kX;
  if (name == "y") return scene::Axis::kY;
  if (name == "z") return scene::Axis::kZ;
  refuse("--up", fmt::format("`{}` is no axis", name), "give x, y or z");
}

groom::ScalpRegion region_of(const GroomHairMeshOptions& options, double metres) {
  groom::ScalpRegion region{};
  region.selection.max_angle = std::numbers::pi;
  region.selection.mesh = options.mesh;
  if (!options.box.empty()) {
    const Vec3 a = metres * vector_of("--box", options.box), b = metres * vector_of("--box", options.box, 3);
    if (!((a - b).cwiseAbs().minCoeff() > 0))
      refuse("--box", "has no inside", "give two corners that differ in x, y and z");
    region.selection.box = {{a.cwiseMin(b), a.cwiseMax(b)}};
  }
  if (!options.centre.empty()) region.centre = metres * vector_of("--center", options.centre);
  region.pole = direction_of("--pole", options.pole);
  region.forward = direction_of("--forward", options.forward);
  if (options.angle) region.angle = angle_of("--angle", *options.angle);
  if (!region.selection.mesh && !region.selection.box && !region.centre)
    refuse("--mesh", "is missing, and so is what may stand for it",
           "say where the scalp is: --mesh, --box, or --center with --angle");
  return region;
}

// The style's figures where there is one, with what the options say in their place.
groom::HairExtrusion extrusion_of(const GroomHairMeshOptions& options, const groom::ScalpPatch& patch,
                                  double metres) {
  groom::HairExtrusion extrusion;
  if (options.style) extrusion = groom::extrusion_of(*options.style, options.resolution, patch);
  const auto set = [](auto& value, const auto& option, auto unit) {
    if (option) value = *option * unit;
  };
  set(extrusion.layers, options.layers, 1);
  set(extrusion.length, options.length, metres);
  set(extrusion.lift, options.lift, metres);
  set(extrusion.level, options.level, metres);
  set(extrusion.curl_radius, options.curl_radius, metres);
  set(extrusion.curl_turns, options.curl_turns, 1.0);
  set(extrusion.gravity, options.gravity, 1.0);
  set(extrusion.comb, options.comb, 1.0);
  if (const auto problem = groom::out_of_range(extrusion)) {
    std::string option = "--" + problem->where;
    std::replace(option.begin(), option.end(), ' ', '-');
    refuse(option, problem->what, problem->hint);
  }
  return extrusion;
}

}  // namespace

int run_groom_hair_mesh(const GroomHairMeshOptions& options) {
  const std::string extension = options.output.extension().string();
  if (extension != ".json" && extension != ".obj")
    throw Error(ErrorKind::kUsage, options.output.string(), "a hair mesh is written as JSON or OBJ",
                "give an output that ends in .json or .obj");
  if (!options.style && !options.length) refuse("--length", "is missing", "give it, or a --style");
  const double metres = options.unit ? metres_in("--unit", *options.unit) : 1;
  const scene::Units units{metres, axis_of(options.up)};
  const groom::ScalpRegion region = region_of(options, metres);
  const int vertices = options.vertices.value_or(
      options.style ? groom::size_of(*options.style, options.resolution).scalp_vertices : 91);
  if (vertices < 7 || vertices > 100000)
    refuse("--vertices", fmt::format("found {}, expected 7 to 100000", vertices));

  scene::MeshDesc desc{};
  desc.file = options.head;
  if (options.unit) desc.units.metres_per_unit = metres;
  const solids::AnimatedMesh head(desc, units, scene::Frames{1, 1, 24, 0});
  const groom::Scalp scalp{head.rest_vertices(), head.triangles(), head.mesh_of_triangle(),
                           head.mesh_names()};
  const groom::ScalpPatch patch = groom::lay_scalp_patch(region, vertices, scalp, units.up);
  const groom::HairExtrusion extrusion = extrusion_of(options, patch, metres);
  const groom::HairMesh mesh = groom::extrude_hair_mesh(extrusion, patch, solids::distance_to(desc, units));
  if (extension == ".json")
    groom::write_hair_mesh_json(options.output, mesh, units.up);
  else
    groom::write_hair_mesh_obj(options.output, mesh);
  fmt::print("wrote {}: {} scalp faces, {} layers, {} vertices, {} prisms\n", options.output.string(),
             mesh.faces.size(), mesh.layers, mesh.positions.size(), mesh.prisms());
  return 0;
}

}  // namespace ringlet::app
