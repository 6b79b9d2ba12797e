// Hair meshes in JSON (schemas/hair_mesh.md).
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/json_text.h"
#include "groom/hair_mesh_formats.h"

namespace ringlet::groom {

namespace {
constexpr const char* kFormat = "ringlet-hair-mesh";
constexpr int kVersion = 1;
constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr std::pair<const char*, double> kUnits[] = {
    {"m", 1}, {"cm", 0.01}, {"mm", 0.001}, {"in", 0.0254}, {"ft", 0.3048}};
constexpr std::size_t kMostProblems = 8;  // of a file's contents

class Reader {
 public:
  Reader(const Json& document, const std::string& name) : document_(document), name_(name) {}

  FileHairMesh read() {
    read_header();
    stop_if_any();  // of another format nothing else is worth a word
    refuse_unknown("", document_, {"format", "version", "units", "faces", "layers", "groups", "group_names"});
    read_units();
    read_faces();
    read_groups();
    read_layers();
    stop_if_any();
    return std::move(result_);
  }

 private:
  void add(const std::string& pointer, std::string what, std::string hint = {}) {
    if (problems_.size() < kMostProblems)
      problems_.push_back({name_ + "#" + pointer, std::move(what), std::move(hint)});
  }

  void stop_if_any() {
    if (!problems_.empty()) throw Error(ErrorKind::kInput, std::move(problems_));
  }

  // The member of the document, null with a problem told where it is missing and required.
  const Json* member(const char* key, bool required) {
    const auto found = document_.find(key);
    if (found != document_.end()) return &*found;
    if (required) add("", fmt::format("\"{}\" is missing", key), "see schemas/hair_mesh.md");
    return nullptr;
  }

  const Json* list(const char* key, bool required) {
    const Json* value = member(key, required);
    if (value == nullptr || value->is_array()) return value;
    add(fmt::format("/{}", key), fmt::format("found {}, expected a list", brief(*value)));
    return nullptr;
  }

  void read_header() {
    if (!document_.is_object()) return add("", fmt::format("found {}, expected an object", brief(document_)));
    if (const Json* format = member("format", true); format && *format != kFormat)
      add("/format", fmt::format("found {}, expected \"{}\"", brief(*format), kFormat),
          "this is no hair mesh");
    if (const Json* version = member("version", true); version && *version != kVersion)
      add("/version", fmt::format("found {}, this program reads {}", brief(*version), kVersion),
          "use the program that wrote it");
  }

  void refuse_unknown(const std::string& pointer, const Json& object, const std::set<std::string>& known) {
    for (const auto& [key, value] : object.items())
      if (!known.contains(key))
        add(pointer, fmt::format("unknown key {}", brief(key)),
            fmt::format("known are {}", fmt::join(known, ", ")));
  }

  void read_units() {
    const Json* units = member("units", false);
    if (units == nullptr) return;
    if (!units->is_object()) return add("/units", fmt::format("found {}, expected an object", brief(*units)));
    refuse_unknown("/units", *units, {"length", "up"});
    if (const auto found = units->find("length"); found != units->end()) {
      const auto* unit = std::find_if(std::begin(kUnits), std::end(kUnits),
                                      [&](const auto& candidate) { return *found == candidate.first; });
      if (unit != std::end(kUnits))
        result_.declared.metres_per_unit = unit->second;
      else if (found->is_number() && found->get<double>() >= 1e-6 && found->get<double>() <= 1e6)
        result_.declared.metres_per_unit = found->get<double>();
      else
        add("/units/length",
            fmt::format("found {}, expected m, cm, mm, in, ft or the metres in one unit", brief(*found)));
    }
    if (const auto found = units->find("up"); found != units->end()) {
      const auto* axis = std::find_if(std::begin(kAxes), std::end(kAxes),
                                      [&](const char* candidate) { return *found == candidate; });
      if (axis != std::end(kAxes))
        result_.declared.up = static_cast<scene::Axis>(axis - std::begin(kAxes));
      else
        add("/units/up", fmt::format("found {}, expected \"x\", \"y\" or \"z\"", brief(*found)));
    }
  }

  static bool is_index(const Json& value) {
    return value.is_number_integer() && value >= 0 && value <= INT32_MAX;
  }

  void read_faces() {
    const Json* faces = list("faces", true);
    if (faces == nullptr) return;
    for (std::size_t f = 0; f < faces->size(); ++f) {
      const Json& face = (*faces)[f];
      const bool fits = face.is_array() && (face.size() == 3 || face.size() == 4) &&
                        std::all_of(face.begin(), face.end(), is_index);
      if (!fits) {
        add(fmt::format("/faces/{}", f),
            fmt::format("found {}, expected three or four vertex numbers", brief(face)));
        continue;
      }
      HairMesh::Face& corners = result_.mesh.faces.emplace_back(HairMesh::Face{-1, -1, -1, -1});
      for (std::size_t c = 0; c < face.size(); ++c) corners[c] = face[c].get<std::int32_t>();
    }
  }

  void read_groups() {
    const Json *groups = list("groups", false), *names = list("group_names", groups != nullptr);
    if (names != nullptr && groups == nullptr) add("", "\"groups\" is missing beside \"group_names\"");
    if (names == nullptr || groups == nullptr) return;
    for (std::size_t i = 0; i < names->size(); ++i) {
      const Json& name = (*names)[i];
      if (!name.is_string() || std::count(names->begin(), names->end(), name) > 1)
        add(fmt::format("/group_names/{}", i),
            fmt::format("found {}, expected a name given once", brief(name)));
      else
        result_.mesh.group_names.push_back(name.get<std::string>());
    }
    for (std::size_t i = 0; i < groups->size(); ++i) {
      const Json& group = (*groups)[i];
      if (!is_index(group) || group.get<std::size_t>() >= names->size())
        add(fmt::format("/groups/{}", i),
            fmt::format("found {}, expected a number below the {} of group_names", brief(group),
                        names->size()));
      else
        result_.mesh.groups.push_back(group.get<std::int32_t>());
    }
  }

  void read_layers() {
    const Json* layers = list("layers", true);
    if (layers == nullptr) return;
    for (std::size_t k = 0; k < layers->size(); ++k) {
      const Json& layer = (*layers)[k];
      const std::string pointer = fmt::format("/layers/{}", k);
      if (!layer.is_array())
        add(pointer, fmt::format("found {}, expected a list of positions", brief(layer)));
      else if (layer.size() != (*layers)[0].size())
        add(pointer,
            fmt::format("layer {} has {} vertices, layer 0 has {}", k, layer.size(), (*layers)[0].size()),
            "each layer has the same vertices");
      else
        for (std::size_t v = 0; v < layer.size(); ++v) read_point(fmt::format("{}/{}", pointer, v), layer[v]);
    }
    result_.mesh.layers = static_cast<int>(layers->size());
  }

  void read_point(const std::string& pointer, const Json& value) {
    const bool fits = value.is_array() && value.size() == 3 &&
                      std::all_of(value.begin(), value.end(), [](const Json& x) { return x.is_number(); });
    if (!fits) return add(pointer, fmt::format("found {}, expected three numbers", brief(value)));
    result_.mesh.positions.emplace_back(value[0].get<double>(), value[1].get<double>(),
                                        value[2].get<double>());
  }

  const Json& document_;
  const std::string& name_;
  FileHairMesh result_;
  std::vector<Problem> problems_;
};

}  // namespace

FileHairMesh parse_hair_mesh_json(std::string_view text, const std::string& name) {
  const Json document = parse_json(text, name);
  return Reader(document, name).read();
}

bool says_hair_mesh(std::string_view text) {
  const Json document = Json::parse(text, nullptr, false);
  return document.is_object() && document.value("format", Json()) == kFormat;
}

// A line to a face and to a position, so that people and line tools can read it.
std::string hair_mesh_json(const HairMesh& mesh, scene::Axis up) {
  fmt::memory_buffer out;
  const auto put = [&]<class... A>(fmt::format_string<A...> text, A&&... values) {
    fmt::format_to(std::back_inserter(out), text, std::forward<A>(values)...);
  };
  put("{{\n  \"format\": \"{}\",\n  \"version\": {},\n", kFormat, kVersion);
  put("  \"units\": {{\"length\": \"m\", \"up\": \"{}\"}},\n  \"faces\": [", kAxes[static_cast<int>(up)]);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    put("{}\n    [{}]", f > 0 ? "," : "",
        fmt::join(mesh.faces[f].begin(), mesh.faces[f].begin() + HairMesh::corners(mesh.faces[f]), ", "));
  put("\n  ],\n");
  if (!mesh.groups.empty()) {
    put("  \"group_names\": {},\n", Json(mesh.group_names).dump());
    put("  \"groups\": [{}],\n", fmt::join(mesh.groups, ", "));
  }
  put("  \"layers\": [");
  for (int k = 0; k < mesh.layers; ++k) {
    put("{}\n    [", k > 0 ? "," : "");
    for (std::size_t v = 0; v < mesh.vertices(); ++v) {
      const Vec3& point = mesh.layer(k)[v];
      put("{}\n      [{}, {}, {}]", v > 0 ? "," : "", point.x(), point.y(), point.z());
    }
    put("\n    ]");
  }
  put("\n  ]\n}}\n");
  return fmt::to_string(out);
}

}  // namespace ringlet::groom
