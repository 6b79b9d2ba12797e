#include "study/variants.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/json_text.h"
#include "scene/overrides.h"

namespace ringlet::study {
namespace {

constexpr const char* kModel = "/model/type";

// As a shell takes it for one word.
std::string quoted(const std::string& word) {
  const bool plain =
      word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/=._,:+-") ==
      std::string::npos;
  if (plain) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// The value at a pointer of the scene as run: the text of a number, word or truth value; null where there is
// none; of a list or an object only that the scene has one.
std::string column_of(const Json& document, const std::string& pointer) {
  const Json::json_pointer place(pointer);
  if (!document.contains(place)) return "null";
  const Json& value = document.at(place);
  if (value.is_structured()) return "as given";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

// Pointers into the scene as given that a model does not take (scene/checks.cpp refuses them there).
std::vector<std::string> foreign_parts(const Json& document, const std::string& model) {
  std::vector<std::string> parts;
  const auto leave = [&](const std::string& pointer) {
    const Json::json_pointer place(pointer);
    if (!document.contains(place)) return;
    const Json& value = document.at(place);
    if (!value.is_structured() || !value.empty()) parts.push_back(pointer);
  };
  if (model != "ams") leave("/effects/non_hookean"), leave("/effects/grooming");
  if (model != "hair_mesh") {
    if (document.contains(Json::json_pointer("/model/hair_mesh"))) parts.emplace_back("/model/hair_mesh");
    return parts;
  }
  for (const char* pointer : {"/effects/inextensible", "/effects/hair_hair", "/effects/wind/shelter"})
    if (document.contains(Json::json_pointer(pointer))) parts.emplace_back(pointer);
  if (!document.contains("groom")) return parts;
  const Json& groom = document["groom"];
  for (std::size_t g = 0; g < (groom.is_array() ? groom.size() : 1); ++g)
    for (const char* key : {"interpolate", "stiffness", "particles"})
      leave((groom.is_array() ? fmt::format("/groom/{}/", g) : std::string("/groom/")) + key);
  return parts;
}

// Makes runs of choices: for each axis the index of a value, or -1 for the scene's own.
class Maker {
 public:
  Maker(const Base& base, const std::vector<Axis>& axes)
      : base_(base),
        axes_(axes),
        names_(short_names(axes)),
        scene_(scene::load(base.file, {base.overrides})),
        document_(Json::parse(scene_.resolved)) {}

  Variant make(const std::vector<int>& choice) const {
    Variant variant;
    variant.overrides = base_.overrides;
    variant.machine = base_.machine;
    variant.left_out = left_out(choice);
    int changed = 0;
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      if (choice[a] < 0) {
        variant.columns.push_back(axes_[a].of_scene() ? column_of(document_, axes_[a].name)
                                                      : machine_value(axes_[a].name, base_.machine));
        continue;
      }
      const Value& value = axes_[a].values[static_cast<std::size_t>(choice[a])];
      if (is_within(axes_[a].name, variant.left_out)) {
        variant.columns.emplace_back("null");
        continue;
      }
      variant.columns.push_back(value.text);
      variant.label += (variant.label.empty() ? "" : ", ") + names_[a] + "=" + value.text;
      variant.axis = ++changed == 1 ? static_cast<int>(a) : -1;
      change(axes_[a], value, variant);
    }
    for (const std::string& part : variant.left_out) set(part + "=null", variant);
    if (changed == 0) variant.label = kAsGiven;
    scene::LoadOptions options{variant.overrides, "--vary"};
    variant.scene = changed == 0 ? scene_ : scene::load(base_.file, options);
    variant.key = key_of(variant);
    return variant;
  }

 private:
  // What the model that is chosen does not take of the scene with the chosen values; nothing where none is.
  std::vector<std::string> left_out(const std::vector<int>& choice) const {
    Json document = document_;
    std::string model;
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      if (choice[a] < 0 || !axes_[a].of_scene()) continue;
      const Value& value = axes_[a].values[static_cast<std::size_t>(choice[a])];
      scene::apply_override(axes_[a].name + "=" + value.json, document, "--vary");
      if (axes_[a].name == kModel) model = value.text;
    }
    return model.empty() ? std::vector<std::string>() : foreign_parts(document, model);
  }

  static bool is_within(const std::string& pointer, const std::vector<std::string>& parts) {
    return std::any_of(parts.begin(), parts.end(), [&](const std::string& part) {
      return pointer == part || pointer.starts_with(part + "/");
    });
  }

  static void set(const std::string& text, Variant& variant) {
    variant.overrides.push_back(text), variant.changes.push_back(text);
    variant.options.push_back("--set " + quoted(text));
  }

  static void change(const Axis& axis, const Value& value, Variant& variant) {
    if (!axis.of_scene()) {
      set_machine(axis.name, value.text, variant.machine);
      variant.options.push_back("--" + axis.name + " " + value.text);
      return;
    }
    set(axis.name + "=" + value.json, variant);
  }

  static std::string key_of(const Variant& variant) {
    std::string key = variant.scene.hash;
    for (const char* setting : {"precision", "backend", "threads", "instruction-set"})
      key += " " + machine_value(setting, variant.machine);
    return key;
  }

  const Base& base_;
  const std::vector<Axis>& axes_;
  std::vector<std::string> names_;
  scene::Scene scene_;
  Json document_;
};

std::vector<std::vector<int>> choices(const std::vector<Axis>& axes, bool product) {
  std::vector<std::vector<int>> all = {std::vector<int>(axes.size(), -1)};
  if (!product) {
    for (std::size_t a = 0; a < axes.size(); ++a)
      for (std::size_t v = 0; v < axes[a].values.size(); ++v) {
        all.emplace_back(axes.size(), -1);
        all.back()[a] = static_cast<int>(v);
      }
    return all;
  }
  for (std::size_t a = 0; a < axes.size(); ++a) {
    std::vector<std::vector<int>> longer;
    for (const std::vector<int>& choice : all)
      for (std::size_t v = 0; v < axes[a].values.size(); ++v) {
        longer.push_back(choice);
        longer.back()[a] = static_cast<int>(v);
      }
    all = std::move(longer);
  }
  return all;
}

}  // namespace

std::vector<Variant> make_variants(const Base& base, const std::vector<Axis>& axes, bool product) {
  const Maker maker(base, axes);
  std::vector<Variant> variants;
  std::vector<Problem> problems;
  for (const std::vector<int>& choice : choices(axes, product)) {
    try {
      Variant variant = maker.make(choice);
      const bool seen = std::any_of(variants.begin(), variants.end(),
                                    [&](const Variant& other) { return other.key == variant.key; });
      if (!seen) variants.push_back(std::move(variant));
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::kInput) throw;
      for (const Problem& problem : error.problems())
        if (std::none_of(problems.begin(), problems.end(),
                         [&](const Problem& other) { return to_string(other) == to_string(problem); }))
          problems.push_back(problem);
    }
  }
  if (!problems.empty()) throw Error(ErrorKind::kInput, std::move(problems));
  return variants;
}

int most_substeps(const scene::Scene& scene) {
  const Json substeps = Json::parse(scene.resolved)["model"]["substeps"];
  return substeps.is_object() ? substeps["max"].get<int>() : substeps.get<int>();
}

}  // namespace ringlet::study
