#include <fmt/format.h>

#include <fstream>

#include "core/error.h"
#include "groom/file_units.h"
#include "groom/hair_mesh_formats.h"
#include "groom/input_file.h"
#include "groom/up_axis.h"

namespace ringlet::groom {

namespace {

// JSON begins with a brace, OBJ never does.
bool begins_with_brace(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && text[first] == '{';
}

FileHairMesh parse(const std::filesystem::path& path) {
  const InputFile file(path);
  if (file.size() == 0) file.fail(0, "the file is empty", "export the hair mesh again");
  if (file.text().find('\0') != std::string_view::npos)
    file.fail(file.text().find('\0'), "is no text, expected a hair mesh in JSON or as OBJ", "");
  return begins_with_brace(file.text()) ? parse_hair_mesh_json(file.text(), path.string())
                                        : parse_hair_mesh_obj(file.text(), path.string());
}

// Written aside and renamed, so that a file of this name is always whole.
void write_text(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path aside = file.string() + ".part";
  std::error_code status;
  {
    std::ofstream stream(aside, std::ios::binary);
    stream.write(text.data(), static_cast<std::streamsize>(text.size()));
    stream.close();
    if (!stream) {
      std::filesystem::remove(aside, status);
      throw Error(ErrorKind::kIo, file.string(), "cannot be written",
                  "check the disk's room and your permissions");
    }
  }
  std::filesystem::rename(aside, file, status);
  if (status) throw Error(ErrorKind::kIo, file.string(), "cannot be written: " + status.message());
}

}  // namespace

bool is_hair_mesh(const std::filesystem::path& file) {
  try {
    const InputFile input(file);
    if (begins_with_brace(input.text())) return says_hair_mesh(input.text());
    const HairMesh mesh = parse_hair_mesh_obj(input.text(), file.string()).mesh;
    check(mesh, file.string());
    return true;
  } catch (const Error&) {
    return false;
  }
}

HairMesh read_hair_mesh(const std::filesystem::path& file, const scene::UnitsOverride& units,
                        const scene::Units& scene_units) {
  FileHairMesh read = parse(file);
  const scene::Units from = file_units(file.string(), units, read.declared, scene_units);
  const Mat3 turn = up_rotation(from.up, scene_units.up);
  for (Vec3& point : read.mesh.positions) point = turn * (point * from.metres_per_unit);
  orient_outward(read.mesh, file.string());
  check(read.mesh, file.string());
  return std::move(read.mesh);
}

scene::UnitsOverride declared_hair_mesh_units(const std::filesystem::path& file) {
  return parse(file).declared;
}

void write_hair_mesh_json(const std::filesystem::path& file, const HairMesh& mesh, scene::Axis up) {
  write_text(file, hair_mesh_json(mesh, up));
}

void write_hair_mesh_obj(const std::filesystem::path& file, const HairMesh& mesh) {
  write_text(file, hair_mesh_obj(mesh));
}

}  // namespace ringlet::groom
