#include <fmt/format.h>

#include <fstream>

#include "scene/build.h"
#include "scene/checks.h"
#include "scene/overrides.h"
#include "scene/scene.h"
#include "scene/validate.h"

namespace ringlet::scene {
namespace fs = std::filesystem;
namespace {

std::string read_text(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status)) throw Error(ErrorKind::kInput, file.string(), "there is no such file");
  if (fs::is_directory(status))
    throw Error(ErrorKind::kInput, file.string(), "found a folder, expected a scene");
  std::ifstream stream(file, std::ios::binary);
  std::string text;
  char block[1 << 16];
  while (stream.read(block, sizeof block), stream.gcount() > 0) text.append(block, stream.gcount());
  if (!stream.is_open() || stream.bad())
    throw Error(ErrorKind::kInput, file.string(), "the file cannot be read");
  return text;
}

// The scene's text is not to blame for what the command line put in.
void blame_overrides(const fs::path& file, const std::vector<std::string>& overridden,
                     const std::string& option, std::vector<Problem>& problems) {
  for (Problem& problem : problems)
    for (const std::string& pointer : overridden) {
      const std::string where = file.string() + "#" + pointer;
      if (problem.where != where && !problem.where.starts_with(where + "/")) continue;
      problem.hint += (problem.hint.empty() ? "" : "; ") + std::string("given by ") + option;
      break;
    }
}

// Names that follow from the files; a name that does not is the schema's default.
void derive_names(Json& document) {
  const auto derive = [](Json& block, const Json& source) {
    if (!block.contains("name")) block["name"] = fs::path(source.get<std::string>()).stem().string();
  };
  for (const auto& [pointer, ignored] : grooms_of(document)) {
    Json& groom = document[Json::json_pointer(pointer)];
    if (groom.contains("hair_mesh") && !groom.contains("file")) derive(groom, groom["hair_mesh"]["file"]);
    if (!groom.contains("file") || groom.contains("grow")) continue;
    derive(groom, groom["file"].is_array() ? groom["file"][0] : groom["file"]);
  }
  if (!document.contains("effects") || !document["effects"].contains("solids")) return;
  for (Json& solid : document["effects"]["solids"]) derive(solid, solid["source"]);
}

// FNV-1a, 64 bits.
std::string hash_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const unsigned char c : text) hash = (hash ^ c) * 0x100000001b3u;
  return fmt::format("{:016x}", hash);
}

}  // namespace

Scene load(const fs::path& file, const LoadOptions& options) {
  const Schema schema;
  Json document = parse_json(read_text(file), file.string());
  std::vector<std::string> overridden;
  for (const std::string& text : options.overrides)
    overridden.push_back(apply_override(text, document, options.option));

  const auto refuse_if = [&](std::vector<Problem> problems) {
    if (problems.empty()) return;
    blame_overrides(file, overridden, options.option, problems);
    throw Error(ErrorKind::kInput, std::move(problems));
  };
  std::vector<Problem> problems = validate(schema, document, file.string());
  std::vector<Problem> missing = check_files(schema, document, file);
  const bool valid = problems.empty();
  problems.insert(problems.end(), missing.begin(), missing.end());
  if (!valid) refuse_if(std::move(problems));

  document.erase("$schema");
  derive_names(document);
  schema.fill_defaults(document);
  std::vector<Problem> contradictions = check_meaning(document, file);
  problems.insert(problems.end(), contradictions.begin(), contradictions.end());
  refuse_if(std::move(problems));

  Scene scene = build(schema.in_metres(document), file);
  scene.resolved = document.dump(2) + "\n";
  scene.hash = hash_of(scene.resolved);
  return scene;
}

}  // namespace ringlet::scene
