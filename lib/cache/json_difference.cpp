#include "cache/json_difference.h"

#include <map>
#include <nlohmann/json.hpp>

namespace ringlet::cache {

std::vector<Difference> json_differences(const std::string& a, const std::string& b) {
  if (a == b) return {};
  const auto parsed_a = nlohmann::json::parse(a, nullptr, false),
             parsed_b = nlohmann::json::parse(b, nullptr, false);
  if (parsed_a.is_discarded() || parsed_b.is_discarded()) return {{"", a, b}};

  const auto flat_a = parsed_a.flatten(), flat_b = parsed_b.flatten();
  std::map<std::string, Difference> leaves;
  for (const auto& [pointer, value] : flat_a.items()) leaves[pointer] = {pointer, value.dump(), ""};
  for (const auto& [pointer, value] : flat_b.items()) {
    leaves[pointer].where = pointer;
    leaves[pointer].b = value.dump();
  }
  std::vector<Difference> differences;
  for (const auto& [pointer, leaf] : leaves)
    if (leaf.a != leaf.b) differences.push_back(leaf);
  return differences;
}

}  // namespace ringlet::cache
