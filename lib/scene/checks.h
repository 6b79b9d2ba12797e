// What a scene means beyond its schema: files that exist, values that must fit each other.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/error.h"
#include "scene/schema.h"

namespace ringlet::scene {

// Files that `document` names and that cannot be opened (relative to the folder of `file`, the scene). The
// document may be invalid: what the schema does not know is passed over.
std::vector<Problem> check_files(const Schema& schema, Json& document, const std::filesystem::path& file);

// Values that contradict each other in `document`, which is valid and filled in.
std::vector<Problem> check_meaning(const Json& document, const std::filesystem::path& file);

// The grooms of a scene with their JSON pointers: `groom` is one of them or a list.
std::vector<std::pair<std::string, const Json*>> grooms_of(const Json& document);

}  // namespace ringlet::scene
