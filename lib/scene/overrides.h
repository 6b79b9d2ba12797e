// `--set POINTER=JSON`: changes to a scene before it is validated.
#pragma once
#include <string>

#include "core/json_text.h"

namespace ringlet::scene {

// Applies one override to `document` and returns its JSON pointer. null removes the value (no error where
// there is none); missing parents are made, as lists where the pointer says `0` or `-`, as objects otherwise;
// `-` and the index after the last append to a list. `option` is what gave it, for
// messages. Throws Error{kUsage}: no `=`, no JSON pointer, a value
// that is not JSON, an index beyond the list, a member of what has none.
std::string apply_override(const std::string& text, Json& document, const std::string& option = "--set");

}  // namespace ringlet::scene
