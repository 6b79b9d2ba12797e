#include "scene/schema.h"

#include <fmt/format.h>

#include <cstdlib>
#include <stdexcept>

#include "scene/schema_text.h"

namespace ringlet::scene {
namespace {

bool has_type(const Json& value, const std::string& type) {
  if (type == "object") return value.is_object();
  if (type == "array") return value.is_array();
  if (type == "string") return value.is_string();
  throw std::logic_error("scene schema: a condition on type " + type);
}

// Whether `value` meets an `if` of the schema.
bool matches(const Json& condition, const Json& value) {
  for (const auto& [keyword, operand] : condition.items()) {
    if (keyword == "type") {
      if (!has_type(value, operand)) return false;
    } else if (keyword == "const") {
      if (value != operand) return false;
    } else if (keyword == "required") {
      for (const Json& key : operand)
        if (value.is_object() && !value.contains(key.get<std::string>())) return false;
    } else if (keyword == "properties") {
      for (const auto& [key, inner] : operand.items())
        if (value.is_object() && value.contains(key) && !matches(inner, value[key])) return false;
    } else {
      throw std::logic_error("scene schema: a condition with " + keyword);
    }
  }
  return true;
}

// To 15 significant digits: 8e-5 m is 0.008 cm, not 0.0080000000000000002.
double rounded(double value) { return std::strtod(fmt::format("{:.15g}", value).c_str(), nullptr); }

std::string number(const Json& value) { return fmt::format("{:g}", value.get<double>()); }

std::string describe_number(const Json& node) {
  std::string text;
  if (node.contains("minimum") && node.contains("maximum"))
    text = " from " + number(node["minimum"]) + " to " + number(node["maximum"]);
  else if (node.contains("minimum"))
    text = " of at least " + number(node["minimum"]);
  else if (node.contains("exclusiveMinimum") && node.contains("maximum"))
    text = " above " + number(node["exclusiveMinimum"]) + ", at most " + number(node["maximum"]);
  else if (node.contains("exclusiveMinimum"))
    text = " above " + number(node["exclusiveMinimum"]);
  const std::string unit = node.value("unit", "1");
  if (unit == "1") return text;
  return text + (unit == "length" ? " [units.length]" : " [" + unit + "]");
}

std::string describe_string(const Json& node) {
  const std::string path = node.value("path", "");
  if (path == "file") return "the path of a file";
  if (path == "mesh") return "the path of a mesh file";
  if (path == "folder") return "the path of a folder";
  std::string text = "text";
  if (node.contains("maxLength"))
    text += fmt::format(" of at most {} characters", node["maxLength"].get<int>());
  if (node.contains("pattern")) return text + " that matches " + node["pattern"].get<std::string>();
  return node.contains("minLength") ? text + ", not empty" : text;
}

std::string describe_words(const Json& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i].dump();
  return text;
}

std::string describe_list(const Json& node, const std::string& item) {
  std::string count;
  if (node.contains("maxItems") && node.value("minItems", 0) != node["maxItems"])
    count = fmt::format(" of {} to {}", node.value("minItems", 0), node["maxItems"].get<int>());
  else if (node.contains("maxItems"))
    count = fmt::format(" of {}", node["maxItems"].get<int>());
  else if (node.contains("minItems"))
    count = fmt::format(" of at least {}", node["minItems"].get<int>());
  const std::string different = node.value("uniqueItems", false) ? "different, " : "";
  return "a list" + count + ", " + different + "each " + item;
}

}  // namespace

Schema::Schema() : root_(Json::parse(schema_text())) {}

Json Schema::effective(Json node, const Json& value) const {
  while (node.contains("$ref")) {
    Json target = root_.at(Json::json_pointer(node["$ref"].get<std::string>().substr(1)));
    node.erase("$ref");
    target.merge_patch(node);
    node = std::move(target);
  }
  if (!node.contains("if")) return node;
  const char* branch = matches(node["if"], value) ? "then" : "else";
  const Json chosen = node.contains(branch) ? effective(node[branch], value) : Json::object();
  for (const char* keyword : {"if", "then", "else"}) node.erase(keyword);
  node.merge_patch(chosen);
  return node;
}

Json Schema::node_at(const std::vector<std::string>& path, const Json& document) const {
  Json node = root_;
  const Json* value = &document;
  for (const std::string& token : path) {
    const Json here = effective(node, *value);
    if (value->is_array() && here.contains("items")) {
      node = here["items"];
      value = &value->at(std::stoul(token));
    } else if (value->is_object() && here.contains("properties") && here["properties"].contains(token)) {
      node = here["properties"][token];
      value = &value->at(token);
    } else {
      return nullptr;
    }
  }
  return node;
}

std::string Schema::describe(Json node) const {
  while (node.contains("$ref"))
    node = root_.at(Json::json_pointer(node["$ref"].get<std::string>().substr(1)));
  if (node.contains("enum")) return describe_words(node["enum"]);
  if (node.contains("const")) return node["const"].dump();
  const std::string type = node.value("type", "");
  if (type == "integer") return "an integer" + describe_number(node);
  if (type == "number") return "a number" + describe_number(node);
  if (type == "string") return describe_string(node);
  if (type == "boolean") return "true or false";
  if (type == "array") return describe_list(node, describe(node["items"]));
  if (type == "object") return "an object";
  // A union: the condition tells its two forms apart.
  return describe(node["else"]) + ", or " + describe(node.contains("then") ? node["then"] : node["if"]);
}

void Schema::walk(const Json& raw, Json& value, const std::string& pointer, const Visit& visit) const {
  const Json node = effective(raw, value);
  visit(node, value, pointer);
  if (value.is_object() && node.contains("properties")) {
    for (const auto& [key, inner] : node["properties"].items())
      if (value.contains(key)) walk(inner, value[key], pointer + pointer_token(key), visit);
  } else if (value.is_array() && node.contains("items")) {
    for (std::size_t i = 0; i < value.size(); ++i)
      walk(node["items"], value[i], pointer + pointer_token(i), visit);
  }
}

void Schema::scale_lengths(const Json& node, Json& value, const std::function<double(double)>& scale) const {
  walk(node, value, "", [&](const Json& at, Json& here, const std::string&) {
    if (here.is_number() && at.value("unit", "") == "length") here = scale(here.get<double>());
  });
}

Json Schema::default_of(const Json& node, double metres_per_unit) const {
  Json value = effective(node, nullptr)["default"];
  scale_lengths(node, value, [&](double length) { return rounded(length / metres_per_unit); });
  return value;
}

void Schema::fill(const Json& raw, Json& value, double metres_per_unit) const {
  const Json node = effective(raw, value);
  if (value.is_number_integer() && node.value("type", "") == "number") value = value.get<double>();
  if (value.is_object()) {
    for (const auto& [key, inner] : node["properties"].items()) {
      if (!value.contains(key)) {
        if (!effective(inner, nullptr).contains("default")) continue;
        value[key] = default_of(inner, metres_per_unit);
      }
      fill(inner, value[key], metres_per_unit);
    }
  } else if (value.is_array()) {
    for (Json& item : value) fill(node["items"], item, metres_per_unit);
  }
}

void Schema::fill_defaults(Json& document) const { fill(root_, document, metres_per_unit(document)); }

double Schema::metres_per_unit(const Json& document) const {
  Json units = document.value("units", Json::object());
  fill(root_["properties"]["units"], units, 1.0);
  return metres(units["length"]);
}

Json Schema::in_metres(Json document) const {
  const double unit = metres_per_unit(document);
  scale_lengths(root_, document, [unit](double length) { return length * unit; });
  return document;
}

double metres(const Json& length_unit) {
  if (length_unit.is_number()) return length_unit.get<double>();
  if (length_unit == "m") return 1.0;
  if (length_unit == "cm") return 0.01;
  if (length_unit == "mm") return 0.001;
  if (length_unit == "in") return 0.0254;
  if (length_unit == "ft") return 0.3048;
  throw std::logic_error("scene schema: length unit " + length_unit.dump());
}

}  // namespace ringlet::scene
