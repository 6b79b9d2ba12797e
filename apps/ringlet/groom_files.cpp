#include "groom_files.h"

#include <fmt/format.h>

#include <cstdlib>

#include "core/error.h"
#include "groom/groom.h"

namespace ringlet::app {

void check_output(const std::filesystem::path& output) {
  if (output.extension() != ".h5")
    throw Error(ErrorKind::kUsage, output.string(), "a groom is written as HDF5",
                "give an output that ends in .h5");
}

void write_groom(const std::filesystem::path& output, const groom::Strands& strands, scene::Axis up) {
  groom::write(output, strands, up);
  fmt::print("wrote {}: {} strands, {} particles\n", output.string(), strands.size(), strands.particles());
}

double metres_in(const std::string& option, const std::string& unit) {
  static constexpr std::pair<const char*, double> kUnits[] = {
      {"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}, {"ft", 0.3048}};
  for (const auto& [name, metres] : kUnits)
    if (unit == name) return metres;
  char* end = nullptr;
  const double metres = std::strtod(unit.c_str(), &end);
  if (end == unit.c_str() || *end != '\0' || !(metres > 0) || metres > 1e9)
    throw Error(ErrorKind::kUsage, option, fmt::format("`{}` is no unit of length", unit),
                "give m, cm, mm, in, ft, or the metres in one unit");
  return metres;
}

scene::Units units_of(const GroomFileOptions& options) {
  const double metres = metres_in("--unit", options.unit);
  if (!options.up) return {metres, groom::declared_units(options.input).up.value_or(scene::Axis::kY)};
  if (options.up == "x") return {metres, scene::Axis::kX};
  if (options.up == "y") return {metres, scene::Axis::kY};
  if (options.up == "z") return {metres, scene::Axis::kZ};
  throw Error(ErrorKind::kUsage, "--up", fmt::format("`{}` is no axis", *options.up), "give x, y or z");
}

groom::Strands read_groom(const GroomFileOptions& options) {
  return groom::read(options.input, options.skin, {}, units_of(options));
}

}  // namespace ringlet::app
