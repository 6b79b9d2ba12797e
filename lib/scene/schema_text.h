// The text of schemas/scene.schema.json as it was when the program was built.
#pragma once
#include <string_view>

namespace ringlet::scene {

std::string_view schema_text();

}  // namespace ringlet::scene
