#include "solids/units.h"

#include <fmt/format.h>

#include "core/log.h"

namespace ringlet::solids {
namespace {

// Columns are where x, y and z of a file with this up axis go in y-up axes.
Mat3 to_y_up(scene::Axis up) {
  switch (up) {
    case scene::Axis::kX:
      return (Mat3() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished();
    case scene::Axis::kZ:
      return (Mat3() << 1, 0, 0, 0, 0, 1, 0, -1, 0).finished();
    case scene::Axis::kY:
      break;
  }
  return Mat3::Identity();
}

const char* source(bool overridden, bool declared) {
  return overridden ? "the scene's block" : declared ? "the file" : "the scene";
}

char letter(scene::Axis axis) { return "xyz"[static_cast<int>(axis)]; }

std::string contradiction(const DeclaredUnits& declared, double metres, scene::Axis up) {
  std::string text;
  if (declared.metres_per_unit && *declared.metres_per_unit != metres)
    text += fmt::format("; the file says {:g} m", *declared.metres_per_unit);
  if (declared.up && *declared.up != up) text += fmt::format("; the file says {} up", letter(*declared.up));
  return text;
}

}  // namespace

Mat3 axis_rotation(scene::Axis from, scene::Axis to) { return to_y_up(to).transpose() * to_y_up(from); }

Mat3 file_to_scene(const std::filesystem::path& file, const DeclaredUnits& declared,
                   const scene::UnitsOverride& wanted, const scene::Units& scene_units) {
  const double metres =
      wanted.metres_per_unit.value_or(declared.metres_per_unit.value_or(scene_units.metres_per_unit));
  const scene::Axis up = wanted.up.value_or(declared.up.value_or(scene_units.up));
  log_info(fmt::format("{}: one unit is {:g} m (from {}), {} up (from {}){}", file.string(), metres,
                       source(wanted.metres_per_unit.has_value(), declared.metres_per_unit.has_value()),
                       letter(up), source(wanted.up.has_value(), declared.up.has_value()),
                       contradiction(declared, metres, up)));
  return metres * axis_rotation(up, scene_units.up);
}

}  // namespace ringlet::solids
