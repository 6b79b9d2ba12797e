#include "groom.h"

#include <fmt/format.h>

#include <cstdlib>

#include "core/error.h"
#include "groom/groom.h"
#include "scene/scene.h"
#include "solids/mesh.h"

namespace ringlet::app {
namespace {

void check_output(const std::filesystem::path& output) {
  if (output.extension() != ".h5")
    throw Error(ErrorKind::kUsage, output.string(), "a groom is written as HDF5",
                "give an output that ends in .h5");
}

void write_groom(const std::filesystem::path& output, const groom::Strands& strands, scene::Axis up) {
  groom::write(output, strands, up);
  fmt::print("wrote {}: {} strands, {} particles\n", output.string(), strands.size(), strands.particles());
}

double metres_in(const std::string& unit) {
  static constexpr std::pair<const char*, double> kUnits[] = {
      {"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}, {"ft", 0.3048}};
  for (const auto& [name, metres] : kUnits)
    if (unit == name) return metres;
  char* end = nullptr;
  const double metres = std::strtod(unit.c_str(), &end);
  if (end == unit.c_str() || *end != '\0' || !(metres > 0) || metres > 1e9)
    throw Error(ErrorKind::kUsage, "--unit", fmt::format("`{}` is no unit of length", unit),
                "give m, cm, mm, in, ft, or the metres in one unit");
  return metres;
}

}  // namespace

int run_groom_grow(const GroomGrowOptions& options) {
  check_output(options.output);
  const scene::Scene scene = scene::load(options.scene, {options.overrides});
  for (const scene::Groom& desc : scene.grooms) {
    if (!desc.grow || (options.groom && *options.groom != desc.name)) continue;
    const solids::AnimatedMesh head(*scene.head, scene.units, scene.frames);
    const groom::Scalp scalp{head.rest_vertices(), head.triangles(), head.mesh_of_triangle(),
                             head.mesh_names()};
    write_groom(options.output, groom::build(desc, scene.units, &scalp), scene.units.up);
    return 0;
  }
  throw Error(ErrorKind::kUsage, options.scene,
              options.groom ? fmt::format("no groom `{}` with a \"grow\" block", *options.groom)
                            : std::string("no groom with a \"grow\" block"),
              "name one that grows");
}

int run_groom_convert(const GroomConvertOptions& options) {
  check_output(options.output);
  if (options.up != "x" && options.up != "y" && options.up != "z")
    throw Error(ErrorKind::kUsage, "--up", fmt::format("`{}` is no axis", options.up), "give x, y or z");
  const scene::Axis up = options.up == "x"   ? scene::Axis::kX
                         : options.up == "y" ? scene::Axis::kY
                                             : scene::Axis::kZ;
  const scene::Units units{metres_in(options.unit), up};
  write_groom(options.output, groom::read(options.input, options.skin, {}, units), up);
  return 0;
}

}  // namespace ringlet::app
