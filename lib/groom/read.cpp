#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "core/error.h"
#include "core/log.h"
#include "groom/file_units.h"
#include "groom/formats.h"
#include "groom/groom.h"
#include "groom/up_axis.h"

namespace ringlet::groom {

namespace {
enum class Format { kHair, kHairSalon, kTressFx, kH5 };
constexpr float kThickestHair =
    1e-3f;  // [m] beyond it a stored thickness is a modelling factor, not a diameter

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

// Content first: two of the formats have magic bytes. The other two have none and go by their extension.
Format format_of(const InputFile& file) {
  const std::string extension = extension_of(file.path());
  if (file.starts_with("HAIR")) return Format::kHair;
  if (file.starts_with("\x89HDF\r\n\x1a\n")) return Format::kH5;
  if (extension == ".data") return Format::kHairSalon;
  if (extension == ".tfx") return Format::kTressFx;
  if (file.size() == 0) file.fail(0, "the file is empty", "export the groom again");
  file.fail(
      0,
      fmt::format("is no groom that is known: extension \"{}\", no magic bytes of .hair or .h5", extension),
      "expected .hair, .data, .tfx or Ringlet's .h5");
}

FileGroom read_file(const std::filesystem::path& path) {
  const InputFile file(path);
  switch (format_of(file)) {
    case Format::kHair:
      return read_hair(file);
    case Format::kHairSalon:
      return read_hairsalon(file);
    case Format::kTressFx:
      return read_tressfx(file);
    case Format::kH5:
      break;
  }
  return read_h5(path);
}

// The skin that goes with a groom: the named one, or for a .tfx one of the same name beside it.
std::optional<std::filesystem::path> skin_of(const std::filesystem::path& file,
                                             const std::optional<std::filesystem::path>& skin) {
  if (skin) return skin;
  std::filesystem::path beside = file;
  beside.replace_extension(".tfxskin");
  if (extension_of(file) != ".tfx" || !std::filesystem::exists(beside)) return std::nullopt;
  log_info(fmt::format("{}: roots taken from {} beside it", file.string(), beside.filename().string()));
  return beside;
}

void convert(Strands& strands, const scene::Units& from, scene::Axis up, const std::string& file) {
  const Mat3 turn = up_rotation(from.up, up);
  for (Vec3& point : strands.points) point = turn * (point * from.metres_per_unit);
  for (float& width : strands.widths) width = static_cast<float>(width * from.metres_per_unit);
  const auto widest = std::max_element(strands.widths.begin(), strands.widths.end());
  if (widest == strands.widths.end() || *widest <= kThickestHair) return;
  log_warning(
      fmt::format("{}: thickness of {:.3g} m is no hair's; the file's thickness is not used", file, *widest));
  strands.widths.clear();
}
}  // namespace

Strands read(const std::filesystem::path& file, const std::optional<std::filesystem::path>& skin,
             const scene::UnitsOverride& units, const scene::Units& scene_units) {
  FileGroom groom = read_file(file);
  convert(groom.strands, file_units(file.string(), units, groom.declared, scene_units), scene_units.up,
          file.string());
  if (const auto skin_file = skin_of(file, skin)) {
    groom.strands.roots = read_tressfx_skin(InputFile(*skin_file), groom.strands.size());
  }
  if (groom.strands.groups.empty()) {
    groom.strands.groups.assign(groom.strands.size(), 0);
    groom.strands.group_names = {file.stem().string()};
  }
  return std::move(groom.strands);
}

scene::UnitsOverride declared_units(const std::filesystem::path& file) {
  return format_of(InputFile(file)) == Format::kH5 ? read_h5(file).declared : scene::UnitsOverride{};
}

}  // namespace ringlet::groom
