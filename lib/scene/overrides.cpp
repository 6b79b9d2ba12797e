#include "scene/overrides.h"

#include <fmt/format.h>

#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>

namespace ringlet::scene {
namespace {

// `where`: the option and what stands behind it.
[[noreturn]] void refuse(const std::string& where, const std::string& what, const std::string& hint = {}) {
  throw Error(ErrorKind::kUsage, where, what, hint);
}

std::string unescape(const std::string& where, std::string_view token) {
  std::string plain;
  for (std::size_t i = 0; i < token.size(); ++i) {
    if (token[i] != '~') {
      plain += token[i];
      continue;
    }
    const char code = i + 1 < token.size() ? token[++i] : '\0';
    if (code != '0' && code != '1') refuse(where, "'~' in a JSON pointer is written ~0");
    plain += code == '0' ? '~' : '/';
  }
  return plain;
}

std::vector<std::string> split_pointer(const std::string& where, std::string_view pointer) {
  if (!pointer.starts_with('/'))
    refuse(where, "a JSON pointer begins with '/'", "for instance /frames/last=48");
  std::vector<std::string> tokens;
  while (!pointer.empty()) {
    const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
    tokens.push_back(unescape(where, pointer.substr(1, end - 1)));
    pointer.remove_prefix(end);
  }
  return tokens;
}

// The place in `list` that `token` names (`-`: behind its end), if it names one that exists or is the next.
std::optional<std::size_t> list_index(const Json& list, const std::string& token) {
  if (token == "-") return list.size();
  std::size_t index = 0;
  const char* end = token.data() + token.size();
  const auto [parsed, error] = std::from_chars(token.data(), end, index);
  const bool leading_zero = token.size() > 1 && token.front() == '0';
  if (error != std::errc() || parsed != end || leading_zero || index > list.size()) return std::nullopt;
  return index;
}

// The member of `parent` that `token` names, made (null) where it is missing.
Json& member(const std::string& where, Json& parent, const std::string& token) {
  if (parent.is_null()) parent = token == "0" || token == "-" ? Json::array() : Json::object();
  if (parent.is_object()) return parent[token];
  if (!parent.is_array())
    refuse(where, fmt::format("'{}' is no member of {}, which is no object or list", token, brief(parent)));
  const std::optional<std::size_t> index = list_index(parent, token);
  if (!index)
    refuse(where, fmt::format("'{}' is no index of a list of {}", token, parent.size()),
           fmt::format("0 to {}, or - to append", parent.size()));
  if (*index == parent.size()) parent.push_back(nullptr);
  return parent[*index];
}

void remove(Json& document, const std::vector<std::string>& tokens) {
  Json* parent = &document;
  for (std::size_t i = 0;; ++i) {
    const bool last = i + 1 == tokens.size();
    if (parent->is_object() && parent->contains(tokens[i])) {
      if (last) return void(parent->erase(tokens[i]));
      parent = &(*parent)[tokens[i]];
    } else if (parent->is_array()) {
      const std::optional<std::size_t> index = list_index(*parent, tokens[i]);
      if (!index || *index == parent->size()) return;
      if (last) return parent->erase(*index);
      parent = &(*parent)[*index];
    } else {
      return;
    }
  }
}

}  // namespace

std::string apply_override(const std::string& text, Json& document, const std::string& option) {
  const std::string where = option + " " + text;
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) refuse(where, "expected POINTER=JSON", "for instance /frames/last=48");
  const std::string pointer = text.substr(0, equals);
  const std::vector<std::string> tokens = split_pointer(where, pointer);
  Json value;
  try {
    value = parse_json(std::string_view(text).substr(equals + 1), "value");
  } catch (const Error& error) {
    refuse(where, fmt::format("the value is not JSON: {}", error.what()),
           "text needs its double quotes: /name=\"wedge\"");
  }
  if (value.is_null()) {
    remove(document, tokens);
    return pointer;
  }
  Json* target = &document;
  for (const std::string& token : tokens) target = &member(where, *target, token);
  *target = std::move(value);
  return pointer;
}

}  // namespace ringlet::scene
