// What a subcommand tells, as one JSON value: printed as it is for programs, or as aligned lines for people.
#pragma once
#include <nlohmann/json.hpp>

namespace ringlet::app {

using Report = nlohmann::ordered_json;

// To stdout. As text: a line for each member, objects indented below their name, arrays in a line where they
// are of scalars and a line each otherwise; null members are left out.
void print_report(const Report& report, bool json);

}  // namespace ringlet::app
