#include "groom.h"

#include <fmt/format.h>

#include "cache/reader.h"
#include "core/error.h"
#include "groom/groom.h"
#include "groom_files.h"
#include "scene/scene.h"
#include "solids/mesh.h"

namespace ringlet::app {

int run_groom_grow(const GroomGrowOptions& options) {
  check_output(options.output);
  const scene::Scene scene = scene::load(options.scene, {options.overrides});
  std::vector<const scene::Groom*> growing;
  std::string names;
  for (const scene::Groom& desc : scene.grooms) {
    if (!desc.grow || (options.groom && *options.groom != desc.name)) continue;
    growing.push_back(&desc);
    names += (names.empty() ? "" : ", ") + desc.name;
  }
  if (growing.empty())
    throw Error(ErrorKind::kUsage, options.scene,
                options.groom ? fmt::format("no groom `{}` with a \"grow\" block", *options.groom)
                              : std::string("no groom with a \"grow\" block"),
                "name one that grows");
  if (growing.size() > 1)
    throw Error(ErrorKind::kUsage, options.scene, fmt::format("{} grooms grow: {}", growing.size(), names),
                "choose one with --groom");
  const solids::AnimatedMesh head(*scene.head, scene.units, scene.frames);
  const groom::Scalp scalp{head.rest_vertices(), head.triangles(), head.mesh_of_triangle(),
                           head.mesh_names()};
  write_groom(options.output, groom::build(*growing[0], scene.units, &scalp), scene.units.up);
  return 0;
}

int run_groom_convert(const GroomFileOptions& options) {
  check_output(options.output);
  write_groom(options.output, read_groom(options), units_of(options).up);
  return 0;
}

// ---- A frame of a cache --------------------------------------------------------------------------------

namespace {

state::Frame read_frame(const cache::CacheReader& reader, int number) {
  const std::vector<int>& frames = reader.frames();
  if (std::find(frames.begin(), frames.end(), number) != frames.end()) return reader.read(number);
  const std::string there = frames.empty() ? "none" : fmt::format("{} to {}", frames.front(), frames.back());
  throw Error(ErrorKind::kUsage, "--frame",
              fmt::format("{} has no frame {}, there are {}", reader.file().string(), number, there));
}

// The strands as the frame has them, in metres; what grooming has cut off is gone.
groom::Strands strands_of(const state::RunHeader& header, const state::Frame& frame) {
  groom::Strands strands;
  strands.group_names = header.groom_names;
  strands.groups = header.groom_of_strand;
  for (std::size_t s = 0; s + 1 < header.offsets.size(); ++s) {
    const auto first = static_cast<std::size_t>(header.offsets[s]);
    const auto end = frame.living.empty() ? static_cast<std::size_t>(header.offsets[s + 1])
                                          : first + static_cast<std::size_t>(frame.living[s]);
    for (std::size_t i = first; i < end; ++i) {
      strands.points.push_back(header.metres_per_unit *
                               Eigen::Map<const Eigen::Vector3f>(&frame.position[3 * i]).cast<double>());
      strands.widths.push_back(static_cast<float>(header.metres_per_unit * header.width[i]));
    }
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
    strands.roots.push_back(
        {header.root_triangle[s],
         Eigen::Map<const Eigen::Vector3f>(&header.root_barycentric[3 * s]).cast<double>()});
  }
  const auto nowhere = [](const groom::RootSite& root) { return root.triangle < 0; };
  if (std::all_of(strands.roots.begin(), strands.roots.end(), nowhere)) strands.roots.clear();
  return strands;
}

}  // namespace

int run_groom_rest(const GroomRestOptions& options) {
  check_output(options.output);
  const cache::CacheReader reader(options.cache);
  const std::string& up = reader.header().up;
  write_groom(options.output, strands_of(reader.header(), read_frame(reader, options.frame)),
              up == "x"   ? scene::Axis::kX
              : up == "y" ? scene::Axis::kY
                          : scene::Axis::kZ);
  return 0;
}

}  // namespace ringlet::app
