#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/log.h"
#include "groom/edit.h"
#include "groom/groom.h"
#include "groom/hair_mesh_strands.h"

namespace ringlet::groom {

namespace {
// The index of a group of this name, made where there is none.
std::int32_t group_index(std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) names.push_back(name);
  return static_cast<std::int32_t>(std::find(names.begin(), names.end(), name) - names.begin());
}

// Appends `more`; groups of the same name become one. Both have widths.
void append(Strands& strands, const Strands& more) {
  for (std::size_t strand = 0; strand < more.size(); ++strand) {
    strands.offsets.push_back(strands.offsets.back() + more.count(strand));
    strands.groups.push_back(group_index(strands.group_names, more.group_names[more.groups[strand]]));
  }
  strands.points.insert(strands.points.end(), more.points.begin(), more.points.end());
  strands.widths.insert(strands.widths.end(), more.widths.begin(), more.widths.end());
  strands.roots.insert(strands.roots.end(), more.roots.begin(), more.roots.end());
}

Strands grow_scene_groom(const scene::Groom& desc, const scene::Units& scene_units, const Scalp* scalp) {
  if (scalp == nullptr) {
    throw Error(ErrorKind::kInput, desc.pointer + "/grow", "there is no head to grow on",
                "give the scene a head");
  }
  try {
    Strands strands = grow(*desc.grow, *scalp, scene_units.up);
    strands.group_names = {desc.name};
    return strands;
  } catch (const Error& error) {  // growth knows its own keys; the scene's pointer goes before them
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) problem.where = desc.pointer + "/grow" + problem.where;
    throw Error(error.kind(), std::move(problems));
  }
}

HairMeshStrandsDesc strands_desc(const scene::Groom& desc) {
  const scene::HairMeshStrands& from = *desc.hair_mesh;
  return {from.strands,     from.density,    from.particles, from.seed,       desc.width,
          from.curl_radius, from.curl_turns, from.noise,     from.noise_waves};
}
// As files, growth or a hair mesh have them.
Strands made(const scene::Groom& desc, const scene::Units& scene_units, const Scalp* scalp) {
  if (desc.grow) return grow_scene_groom(desc, scene_units, scalp);
  if (desc.hair_mesh) return scene_strands(desc, read_scene_hair_mesh(desc, scene_units)).strands();
  std::vector<std::filesystem::path> files = {desc.file.value()};
  files.insert(files.end(), desc.more.begin(), desc.more.end());
  Strands all;
  for (std::size_t i = 0; i < files.size(); ++i) {
    Strands strands = read(files[i], i == 0 ? desc.skin : std::nullopt, desc.units, scene_units);
    if (strands.widths.empty()) strands.widths.assign(strands.points.size(), static_cast<float>(desc.width));
    if (strands.roots.empty()) strands.roots.resize(strands.size());  // nowhere, unless no file stores any
    append(all, strands);
  }
  if (std::none_of(all.roots.begin(), all.roots.end(),
                   [](const RootSite& root) { return root.triangle >= 0; })) {
    all.roots.clear();
  }
  log_info(fmt::format("groom \"{}\": {} strands, {} particles, {} group(s)", desc.name, all.size(),
                       all.particles(), all.group_names.size()));
  return all;
}
}  // namespace

HairMesh read_scene_hair_mesh(const scene::Groom& desc, const scene::Units& scene_units) {
  return read_hair_mesh(desc.hair_mesh->file, desc.units, scene_units);
}

HairMeshStrands scene_strands(const scene::Groom& desc, const HairMesh& mesh) {
  return {mesh, strands_desc(desc), desc.pointer + "/hair_mesh"};
}

Strands build(const scene::Groom& desc, const scene::Units& scene_units, const Scalp* scalp) {
  Strands strands = made(desc, scene_units, scalp);
  return desc.particles ? resample(strands, desc.particles, std::nullopt) : strands;
}

}  // namespace ringlet::groom
