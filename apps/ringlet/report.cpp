#include "report.h"

#include <algorithm>
#include <cstdio>
#include <string>

namespace ringlet::app {
namespace {

std::string text(const Report& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (!value.is_number_float()) return value.dump();
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.7g", value.get<double>());
  return buffer;
}

std::string line(const Report& array) {
  std::string joined;
  for (const Report& value : array) joined += (joined.empty() ? "" : ", ") + text(value);
  return joined;
}

bool is_flat(const Report& array) {
  return std::none_of(array.begin(), array.end(), [](const Report& value) { return value.is_structured(); });
}

void print_members(const Report& report, int indent);

void print_value(const std::string& label, const Report& value, int indent) {
  if (value.is_object()) {
    std::printf("%s\n", label.c_str());
    print_members(value, indent + 2);
  } else if (value.is_array() && !is_flat(value)) {
    std::printf("%s\n", label.c_str());
    for (const Report& element : value)
      print_value(std::string(static_cast<std::size_t>(indent) + 1, ' '), element, indent + 2);
  } else {
    std::printf("%s %s\n", label.c_str(), (value.is_array() ? line(value) : text(value)).c_str());
  }
}

void print_members(const Report& report, int indent) {
  std::size_t width = 0;
  for (const auto& [name, value] : report.items()) width = std::max(width, name.size());
  for (const auto& [name, value] : report.items()) {
    if (value.is_null() || (value.is_structured() && value.empty())) continue;
    std::string label = std::string(static_cast<std::size_t>(indent), ' ') + name;
    std::replace(label.begin(), label.end(), '_', ' ');
    if (!value.is_structured() || (value.is_array() && is_flat(value)))
      label.resize(static_cast<std::size_t>(indent) + width + 1, ' ');
    print_value(label, value, indent);
  }
}

}  // namespace

void print_report(const Report& report, bool json) {
  if (json) {
    std::printf("%s\n", report.dump(2).c_str());
  } else {
    print_members(report, 0);
  }
}

}  // namespace ringlet::app
