#include "groom/file_units.h"

#include <fmt/format.h>

#include "core/log.h"

namespace ringlet::groom {

scene::Units file_units(const std::string& file, const scene::UnitsOverride& asked,
                        const scene::UnitsOverride& declared, const scene::Units& scene_units) {
  const auto choose = [&](const auto& asked_one, const auto& declared_one, auto fallback, const char* what) {
    if (asked_one && declared_one && *asked_one != *declared_one) {
      log_info(fmt::format("{}: the scene's {} goes before the file's own", file, what));
    } else if (!asked_one && declared_one && *declared_one != fallback) {
      log_info(fmt::format("{}: the file's own {} is obeyed, not the scene's", file, what));
    }
    return asked_one.value_or(declared_one.value_or(fallback));
  };
  return {choose(asked.metres_per_unit, declared.metres_per_unit, scene_units.metres_per_unit, "length unit"),
          choose(asked.up, declared.up, scene_units.up, "up axis")};
}

}  // namespace ringlet::groom
