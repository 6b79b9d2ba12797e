// JSON text to and from values, for people: broken text is reported with line and column.
#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"

namespace ringlet {

using Json = nlohmann::json;

// Parses `text`, called `name` in messages. Throws Error{kInput}: broken syntax and numbers beyond double
// (with NAME:LINE:COLUMN), keys given twice in an object, and nesting deeper than 64 levels (with
// NAME#POINTER).
Json parse_json(std::string_view text, const std::string& name);

// A value as a message shows it: one line, at most 60 characters.
std::string brief(const Json& value);

// One reference token of a JSON pointer, with its leading slash: `/` + token, `~` and `/` escaped.
std::string pointer_token(std::string_view token);
std::string pointer_token(std::size_t index);

}  // namespace ringlet
