#include "scene/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>

namespace ringlet::scene {
namespace fs = std::filesystem;
namespace {

// Whether `name` is `pattern` with its run of n `#` replaced by n digits, or by more without a leading zero.
bool in_sequence(const std::string& name, const std::string& pattern) {
  const std::size_t first = pattern.find('#');
  const std::size_t count = pattern.find_last_of('#') + 1 - first;
  const std::string_view tail = std::string_view(pattern).substr(first + count);
  if (name.size() < pattern.size() || !name.starts_with(pattern.substr(0, first)) || !name.ends_with(tail))
    return false;
  const std::string digits = name.substr(first, name.size() - first - tail.size());
  if (digits.size() > count && digits.front() == '0') return false;
  return std::all_of(digits.begin(), digits.end(), [](unsigned char c) { return std::isdigit(c) != 0; });
}

// Why no frame of the sequence `pattern` can be read; empty if one can.
std::string sequence_fault(const fs::path& pattern) {
  const std::string name = pattern.filename().string();
  const std::string_view run =
      std::string_view(name).substr(name.find('#'), name.find_last_of('#') + 1 - name.find('#'));
  if (run.find_first_not_of('#') != run.npos) return "the # of a sequence stand together";
  const fs::path folder = pattern.has_parent_path() ? pattern.parent_path() : fs::path(".");
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (in_sequence(entry->path().filename().string(), name)) return {};
  return "no file matches " + pattern.string();
}

// Why the file cannot be read; empty if it can.
std::string file_fault(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (status.type() == fs::file_type::not_found) return "there is no " + file.string();
  if (fs::is_directory(status)) return file.string() + " is a folder";
  if (error || !std::ifstream(file)) return file.string() + " cannot be opened";
  return {};
}

bool is_zero(const Json& vector) {
  return std::all_of(vector.begin(), vector.end(),
                     [](const Json& x) { return std::abs(x.get<double>()) < 1e-9; });
}

class Checks {
 public:
  Checks(const Json& document, std::string file) : document_(document), file_(std::move(file)) {}

  std::vector<Problem> run() {
    frames();
    keys("/motion", document_["motion"]);
    if (has_head()) keys("/head/animation", document_["head"]["animation"]);
    for (const auto& [pointer, groom] : grooms_of(document_)) check_groom(pointer, *groom);
    substeps();
    hair_mesh_model();
    non_hookean();
    wind();
    hair_hair();
    grooming();
    const Json& solids = document_["effects"]["solids"];
    for (std::size_t i = 0; i < solids.size(); ++i) solid("/effects/solids" + pointer_token(i), solids[i]);
    cache();
    unique_names();
    return std::move(problems_);
  }

 private:
  bool has_head() const { return document_.contains("head"); }

  void add(const std::string& pointer, const std::string& found, const std::string& expected,
           const std::string& hint = {}) {
    problems_.push_back({file_ + "#" + pointer, "found " + found + ", expected " + expected, hint});
  }

  void frames() {
    const int first = document_["frames"]["first"], last = document_["frames"]["last"];
    if (last < first) add("/frames/last", brief(last), fmt::format("a frame from first, {}, on", first));
  }

  void keys(const std::string& pointer, const Json& animation) {
    const Json& keys = animation["keys"];
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const std::string here = pointer + "/keys" + pointer_token(i);
      if (i > 0 && keys[i]["frame"] <= keys[i - 1]["frame"])
        add(here + "/frame", brief(keys[i]["frame"]),
            "a frame after the previous key's " + brief(keys[i - 1]["frame"]));
      if (is_zero(keys[i]["rotate"]))
        add(here + "/rotate", brief(keys[i]["rotate"]), "a quaternion that is not zero");
    }
  }

  void check_groom(const std::string& pointer, const Json& groom) {
    const bool file = groom.contains("file"), grow = groom.contains("grow");
    one_of(pointer, groom, {"file", "grow", "hair_mesh"});
    if (groom.contains("hair_mesh")) hair_mesh_groom(pointer, groom);
    if (grow && !file) grown_groom(pointer, groom);
    if (file && groom["file"].is_array() && groom["file"].size() > 1 && groom.contains("skin"))
      add(pointer + "/skin", brief(groom["skin"]), "none with several files",
          "each finds the one of its own name");
    const std::string attach = groom["attach"];
    if (!has_head() && !grow && attach != "fixed")
      add(pointer + "/attach", brief(attach) + " without a head", "a head in the scene, or \"fixed\"");
    if (attach == "fixed" && groom["root_offset"] == "snap")
      add(pointer + "/root_offset", "\"snap\" of a fixed groom", "\"keep\", or roots held by the head");
    if (attach != "fixed" && !groom["animation"]["keys"].empty())
      add(pointer + "/animation", "keys", "none with attach " + brief(attach),
          "only a fixed groom has its own motion");
    keys(pointer + "/animation", groom["animation"]);
    if (groom.contains("interpolate"))
      one_of(pointer + "/interpolate", groom["interpolate"], {"count", "group", "strands"});
    const Json& scales = groom["stiffness"];
    for (std::size_t i = 0; i < scales.size(); ++i)
      curve(pointer + "/stiffness" + pointer_token(i) + "/curve", scales[i]["curve"]);
  }

  void hair_mesh_groom(const std::string& pointer, const Json& groom) {
    for (const char* key : {"skin", "attach"})
      if (groom.contains(key) && (std::string(key) == "skin" || groom[key] == "stored"))
        add(pointer + pointer_token(key), brief(groom[key]), "none with hair_mesh",
            "its strands are made anew: no file stores where they grow");
    const Json& block = groom["hair_mesh"];
    const bool count = block["strands"] != 0, density = block["density"] != 0;
    if (count == density)
      add(pointer + "/hair_mesh", count ? "both strands and density" : "neither strands nor density above 0",
          "one of them");
  }

  void substeps() {
    const Json& substeps = document_["model"]["substeps"];
    if (substeps.is_object() && substeps["min"] > substeps["max"])
      add("/model/substeps/min", brief(substeps["min"]), "at most max, " + brief(substeps["max"]));
  }

  // What the model hair_mesh cannot do is told, not passed over.
  void hair_mesh_model() {
    const Json& model = document_["model"];
    if (model["type"] != "hair_mesh") {
      if (model.contains("hair_mesh"))
        add("/model/hair_mesh", "hair_mesh with model " + brief(model["type"]),
            "none, or type \"hair_mesh\"");
      return;
    }
    for (const auto& [pointer, groom] : grooms_of(document_)) {
      if (!groom->contains("hair_mesh"))
        add(pointer, "strands without a hair mesh", "hair_mesh, for the model \"hair_mesh\"",
            "ringlet groom hair-mesh makes one for a head");
      for (const char* key : {"interpolate", "stiffness", "particles"})
        if (groom->contains(key) && !(*groom)[key].empty())
          add(pointer + pointer_token(key), "a key of simulated strands", "none with model \"hair_mesh\"");
    }
    for (const char* key : {"inextensible", "hair_hair"})
      if (document_["effects"].contains(key))
        add("/effects" + pointer_token(key), "an effect of simulated strands",
            "none with model \"hair_mesh\"", "--set /effects/" + std::string(key) + "=null leaves it out");
    const Json wind = document_["effects"].value("wind", Json::object());
    if (wind.contains("shelter"))
      add("/effects/wind/shelter", brief(wind["shelter"]), "none with model \"hair_mesh\"",
          "shelter is reckoned strand by strand");
    const Json& ellipsoids = model["hair_mesh"]["ellipsoids"];
    for (std::size_t i = 0; i < ellipsoids.size(); ++i)
      if (is_zero(ellipsoids[i]["rotate"]))
        add("/model/hair_mesh/ellipsoids" + pointer_token(i) + "/rotate", brief(ellipsoids[i]["rotate"]),
            "a quaternion that is not zero");
  }

  void grown_groom(const std::string& pointer, const Json& groom) {
    for (const char* key : {"skin", "units", "width"})
      if (groom.contains(key))
        add(pointer + pointer_token(key), brief(groom[key]), "none with grow",
            "it belongs to a groom from a file");
    if (!has_head()) add(pointer + "/grow", "growth without a head", "a head in the scene");
    const Json& grow = groom["grow"];
    const bool each = grow["strands_per_triangle"] != 0, total = grow["strands"] != 0;
    if (each == total)
      add(pointer + "/grow",
          each ? "both strands and strands_per_triangle" : "neither strands nor strands_per_triangle above 0",
          "one of them");
    const Json& scalp = grow["scalp"];
    if (scalp.contains("box")) box(pointer + "/grow/scalp/box", scalp["box"]);
    if (scalp.contains("direction") && is_zero(scalp["direction"]))
      add(pointer + "/grow/scalp/direction", brief(scalp["direction"]), "a direction that is not zero");
  }

  void curve(const std::string& pointer, const Json& curve) {
    for (std::size_t i = 0; i < curve.size(); ++i) {
      const double position = curve[i][0];
      const std::string here = pointer + pointer_token(i) + "/0";
      if (position > 1)
        add(here, brief(curve[i][0]), "a position from 0 (root) to 1 (tip)");
      else if (i > 0 && position <= curve[i - 1][0])
        add(here, brief(curve[i][0]), "a position after the previous point's " + brief(curve[i - 1][0]));
    }
  }

  void non_hookean() {
    if (!document_["effects"].contains("non_hookean")) return;
    if (document_["model"]["type"] != "ams")
      add("/effects/non_hookean", "softening with model " + brief(document_["model"]["type"]),
          "model \"ams\"", "only its integrity coupling softens");
    const Json& curve = document_["effects"]["non_hookean"]["curve"];
    const auto at = [](std::size_t i, int axis) {
      return fmt::format("/effects/non_hookean/curve/{}/{}", i, axis);
    };
    if (curve[0][0] != curve[0][1])
      add(at(0, 1), brief(curve[0][1]), "the first point on Hooke's line, " + brief(curve[0][0]));
    for (std::size_t i = 1; i < curve.size(); ++i) {
      if (curve[i][0] <= curve[i - 1][0])
        add(at(i, 0), brief(curve[i][0]),
            "an elongation after the previous point's " + brief(curve[i - 1][0]));
      if (curve[i][1] < curve[i - 1][1])
        add(at(i, 1), brief(curve[i][1]),
            "a tension not under the previous point's " + brief(curve[i - 1][1]), "the curve must not fall");
    }
  }

  void wind() {
    if (!document_["effects"].contains("wind")) return;
    const Json& wind = document_["effects"]["wind"];
    const bool keyed = wind.contains("keys");
    if (!keyed && !wind.contains("velocity"))
      add("/effects/wind", "neither velocity nor keys", "one of them, or both");
    if (keyed)
      for (std::size_t i = 1; i < wind["keys"].size(); ++i)
        if (wind["keys"][i]["frame"] <= wind["keys"][i - 1]["frame"])
          add("/effects/wind/keys" + pointer_token(i) + "/frame", brief(wind["keys"][i]["frame"]),
              "a frame after the previous key's " + brief(wind["keys"][i - 1]["frame"]));
    if (wind.contains("shelter") && !has_head())
      add("/effects/wind/shelter", "shelter without a head", "a head in the scene");
  }

  void hair_hair() {
    const Json& effects = document_["effects"];
    if (!effects.contains("hair_hair")) return;
    const Json& block = effects["hair_hair"];
    if (!block.contains("grid") && !block.contains("contacts"))
      add("/effects/hair_hair", "neither grid nor contacts", "one of them, or both",
          "{} takes the defaults of either");
    if (block.contains("grid") && block["grid"].contains("shelter") && !effects.contains("wind"))
      add("/effects/hair_hair/grid/shelter", "shelter without a wind", "effects.wind in the scene");
  }

  // Exactly one of `keys` stands in the block.
  void one_of(const std::string& pointer, const Json& block, std::initializer_list<const char*> keys) {
    std::string found, all;
    for (const char* key : keys) {
      all += (all.empty() ? "" : ", ") + std::string(key);
      if (block.contains(key)) found += (found.empty() ? "" : " and ") + std::string(key);
    }
    if (found.empty() || found.find(" and ") != found.npos)
      add(pointer, found.empty() ? "none of " + all : found, "one of " + all);
  }

  bool interpolates() const {
    const auto grooms = grooms_of(document_);
    return std::any_of(grooms.begin(), grooms.end(),
                       [](const auto& groom) { return groom.second->contains("interpolate"); });
  }

  void grooming() {
    if (!document_["effects"].contains("grooming")) return;
    const std::string pointer = "/effects/grooming";
    if (document_["model"]["type"] != "ams")
      add(pointer, "grooming of strands of the model " + brief(document_["model"]["type"]),
          "the model \"ams\"", "ringlet groom edits a groom before the run");
    const Json& list = document_["effects"]["grooming"];
    for (std::size_t i = 0; i < list.size(); ++i) grooming_operation(pointer + pointer_token(i), list[i]);
  }

  void grooming_operation(const std::string& pointer, const Json& operation) {
    one_of(pointer, operation, {"trim", "lengthen", "comb", "rest"});
    const Json& frames = document_["frames"];
    if (operation["frame"] < frames["first"] || operation["frame"] > frames["last"])
      add(pointer + "/frame", brief(operation["frame"]),
          "a frame from first to last, " + brief(frames["first"]) + " to " + brief(frames["last"]));
    groomed(pointer, operation);
    if (operation.contains("trim")) trim(pointer + "/trim", operation["trim"]);
    if (operation.contains("lengthen"))
      one_of(pointer + "/lengthen", operation["lengthen"], {"by", "to", "factor"});
    if (operation.contains("comb")) comb(pointer + "/comb/curve", operation["comb"]["curve"]);
  }

  // The grooms that an operation is for: there are some, and all their strands are simulated.
  void groomed(const std::string& pointer, const Json& operation) {
    bool found = false;
    for (const auto& [groom_pointer, groom] : grooms_of(document_)) {
      if (operation.contains("groom") && groom->value("name", "") != operation["groom"]) continue;
      found = true;
      if (groom->contains("interpolate"))
        add(pointer, "an operation on interpolated strands",
            "a groom without " + groom_pointer + "/interpolate",
            "ringlet groom edits a groom before the run");
    }
    if (!found) add(pointer + "/groom", brief(operation["groom"]), "the name of a groom of the scene");
  }

  void trim(const std::string& pointer, const Json& trim) {
    one_of(pointer, trim, {"plane", "box", "sphere", "mesh", "length"});
    if (trim.contains("plane") && is_zero(trim["plane"]["normal"]))
      add(pointer + "/plane/normal", brief(trim["plane"]["normal"]), "a direction that is not zero");
    if (trim.contains("box")) box(pointer + "/box", trim["box"]);
    if (trim.contains("length") && trim["keep"] == "inside")
      add(pointer + "/keep", "\"inside\" with length", "none: a length keeps what is next to the root");
    if (trim.contains("units") && !trim.contains("mesh"))
      add(pointer + "/units", brief(trim["units"]), "none without mesh", "they are the mesh file's");
  }

  void comb(const std::string& pointer, const Json& curve) {
    for (std::size_t i = 1; i < curve.size(); ++i)
      if (curve[i] == curve[i - 1])
        add(pointer + pointer_token(i), brief(curve[i]), "a point other than the one before");
  }

  void box(const std::string& pointer, const Json& box) {
    for (int axis = 0; axis < 3; ++axis)
      if (box[0][axis] > box[1][axis])
        return add(pointer, brief(box), "the lower corner, then the upper one");
  }

  void solid(const std::string& pointer, const Json& solid) {
    if (solid["source"] != "head") return keys(pointer + "/animation", solid["animation"]);
    if (!has_head())
      add(pointer + "/source", "\"head\" without a head", "a head in the scene, or a mesh file");
    for (const char* key : {"units", "animation"})
      if (solid.contains(key))
        add(pointer + pointer_token(key), brief(solid[key]), "none with source \"head\"",
            fmt::format("the head's own is /head/{}", key));
  }

  void cache() {
    const Json& fields = document_["cache"]["fields"];
    if (std::find(fields.begin(), fields.end(), "position") == fields.end())
      add("/cache/fields", brief(fields), "a list with \"position\"");
    if (std::find(fields.begin(), fields.end(), "elongation") != fields.end() &&
        !document_["effects"].contains("non_hookean"))
      add("/cache/fields", "\"elongation\"", "none without effects.non_hookean");
    const Json& strands = document_["cache"]["strands"];
    if (strands != "all" && !interpolates())
      add("/cache/strands", brief(strands), "\"all\" without a groom that interpolates");
  }

  void unique_names() {
    std::map<std::string, std::string> grooms, solids;  // name -> pointer of its first bearer
    for (const auto& [pointer, groom] : grooms_of(document_)) unique_name(pointer, *groom, grooms);
    const Json& list = document_["effects"]["solids"];
    for (std::size_t i = 0; i < list.size(); ++i)
      unique_name("/effects/solids" + pointer_token(i), list[i], solids);
  }

  void unique_name(const std::string& pointer, const Json& block, std::map<std::string, std::string>& names) {
    if (!block.contains("name")) return;  // a groom of neither file nor growth
    const auto [first, is_new] = names.emplace(block["name"], pointer);
    if (!is_new) add(pointer + "/name", brief(block["name"]), "a name other than that of " + first->second);
  }

  const Json& document_;
  std::string file_;
  std::vector<Problem> problems_;
};

}  // namespace

std::vector<Problem> check_files(const Schema& schema, Json& document, const fs::path& file) {
  std::vector<Problem> problems;
  schema.walk(document, [&](const Json& node, Json& value, const std::string& pointer) {
    const std::string kind = node.value("path", "");
    if ((kind != "file" && kind != "mesh") || !value.is_string() || value == "") return;
    const fs::path path = file.parent_path() / value.get<std::string>();
    const bool sequence = kind == "mesh" && path.filename().string().find('#') != std::string::npos;
    const std::string fault = sequence ? sequence_fault(path) : file_fault(path);
    if (!fault.empty())
      problems.push_back({file.string() + "#" + pointer,
                          "found " + brief(value) + ", expected " + schema.describe(node), fault});
  });
  return problems;
}

std::vector<Problem> check_meaning(const Json& document, const fs::path& file) {
  return Checks(document, file.string()).run();
}

std::vector<std::pair<std::string, const Json*>> grooms_of(const Json& document) {
  const Json& groom = document.at("groom");
  if (groom.is_object()) return {{"/groom", &groom}};
  std::vector<std::pair<std::string, const Json*>> grooms;
  for (std::size_t i = 0; i < groom.size(); ++i) grooms.emplace_back("/groom" + pointer_token(i), &groom[i]);
  return grooms;
}

}  // namespace ringlet::scene
