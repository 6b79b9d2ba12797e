#include "study/axis.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/json_text.h"

namespace ringlet::study {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& what, const std::string& hint = {}) {
  throw Error(ErrorKind::kUsage, "--vary " + text, what, hint);
}

// The text parted at its commas, those within brackets, braces and double quotes left alone.
std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '\\' && i + 1 < text.size()) {
      parts.back() += c;
      parts.back() += text[++i];
      continue;
    }
    if (c == '"') quoted = !quoted;
    if (!quoted && (c == '[' || c == '{')) ++depth;
    if (!quoted && (c == ']' || c == '}')) --depth;
    if (c == ',' && depth <= 0 && !quoted)
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

bool is_thread_count(const std::string& text) {
  int threads = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), threads);
  return error == std::errc() && end == text.data() + text.size() && threads >= 1 &&
         threads <= pipeline::kMostThreads;
}

template <class T>
std::string name_of(const std::map<std::string, T>& words, T value) {
  return std::find_if(words.begin(), words.end(), [&](const auto& word) { return word.second == value; })
      ->first;
}

// What the setting takes, and whether it takes this.
struct Taken {
  bool known, fits;
  std::string expected;
};
Taken taken(const std::string& setting, const std::string& value) {
  const auto& sets = pipeline::instruction_set_words();
  if (setting == "precision") return {true, pipeline::precision_words().contains(value), "float or double"};
  if (setting == "backend") return {true, pipeline::backend_words().contains(value), "auto, cpu or cuda"};
  if (setting == "threads")
    return {true, is_thread_count(value), fmt::format("a number from 1 to {}", pipeline::kMostThreads)};
  if (setting == "instruction-set")
    return {true, std::find(sets.begin(), sets.end(), value) != sets.end(), "generic, avx2 or avx512"};
  return {false, false, ""};
}

std::vector<std::string> tokens_of(const std::string& pointer) {
  std::vector<std::string> tokens;
  for (std::size_t at = 0; at < pointer.size();) {
    const std::size_t end = std::min(pointer.find('/', at + 1), pointer.size());
    tokens.push_back(pointer.substr(at + 1, end - at - 1));
    at = end;
  }
  return tokens;
}

// The last `count` tokens of a pointer.
std::string tail(const std::vector<std::string>& tokens, std::size_t count) {
  std::string joined;
  for (std::size_t i = tokens.size() - std::min(count, tokens.size()); i < tokens.size(); ++i)
    joined += (joined.empty() ? "" : "/") + tokens[i];
  return joined;
}

}  // namespace

bool of_frames(const std::string& pointer) { return pointer == "/frames" || pointer.starts_with("/frames/"); }

Axis parse_axis(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos)
    refuse(text, "expected POINTER=V1,V2,...", "for instance /model/substeps=1,2,4,8");
  Axis axis{text.substr(0, equals), {}};
  if (of_frames(axis.name))
    refuse(text, "frames of the same number would be of different times, which are not compared",
           "--frames takes other frames, --set other times for all runs");
  for (const std::string& part : split(text.substr(equals + 1))) {
    if (part.empty()) refuse(text, "an empty value", "null leaves a setting out; \"\" is the empty string");
    const Taken setting = taken(axis.name, part);
    if (!axis.of_scene() && !setting.known)
      refuse(text, fmt::format("`{}` is neither a JSON pointer nor a setting that can be varied", axis.name),
             "pointers begin with '/'; settings are precision, backend, threads, instruction-set");
    if (!axis.of_scene() && !setting.fits)
      refuse(text, fmt::format("found `{}`, expected {}", part, setting.expected));
    axis.values.push_back({part, Json::accept(part) ? part : Json(part).dump()});
  }
  return axis;
}

void set_machine(const std::string& setting, const std::string& value, Machine& machine) {
  if (setting == "precision") machine.options.precision = pipeline::precision_words().at(value);
  if (setting == "backend") machine.options.backend = pipeline::backend_words().at(value);
  if (setting == "threads") machine.threads = std::stoi(value);
  if (setting == "instruction-set") machine.options.instruction_set = value;
}

std::string machine_value(const std::string& setting, const Machine& machine) {
  if (setting == "precision") return name_of(pipeline::precision_words(), machine.options.precision);
  if (setting == "backend") return name_of(pipeline::backend_words(), machine.options.backend);
  if (setting == "threads") return machine.threads > 0 ? std::to_string(machine.threads) : "all";
  return machine.options.instruction_set.empty() ? "widest" : machine.options.instruction_set;
}

std::vector<std::string> short_names(const std::vector<Axis>& axes) {
  std::vector<std::string> names;
  for (const Axis& axis : axes) {
    if (!axis.of_scene()) {
      names.push_back(axis.name);
      continue;
    }
    const std::vector<std::string> tokens = tokens_of(axis.name);
    const auto is_index = [](const std::string& token) {
      return token == "-" || token.find_first_not_of("0123456789") == token.npos;
    };
    std::size_t count = 1;
    while (count < tokens.size() && is_index(tokens[tokens.size() - count])) ++count;
    const auto ambiguous = [&] {
      return std::count_if(axes.begin(), axes.end(), [&](const Axis& other) {
               return tail(tokens_of(other.name), count) == tail(tokens, count);
             }) > 1;
    };
    while (count < tokens.size() && ambiguous()) ++count;
    names.push_back(tail(tokens, count));
  }
  return names;
}

}  // namespace ringlet::study
