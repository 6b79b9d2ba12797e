// Validates a scene against its schema.
#pragma once
#include <string>
#include <vector>

#include "core/error.h"
#include "scene/schema.h"

namespace ringlet::scene {

// Every place where `document` departs from `schema`: `FILE#POINTER: found VALUE, expected ...`, in order of
// the pointers. valijson finds the places; what was expected there is read from the schema.
std::vector<Problem> validate(const Schema& schema, const Json& document, const std::string& file);

}  // namespace ringlet::scene
