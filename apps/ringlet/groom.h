// ringlet groom grow|convert
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace ringlet::app {

struct GroomGrowOptions {
  std::string scene;                   // whose head and `grow` blocks are used
  std::vector<std::string> overrides;  // --set
  std::optional<std::string> groom;    // by name; empty: the first that grows
  std::filesystem::path output;        // .h5
};

struct GroomConvertOptions {
  std::filesystem::path input, output;
  std::optional<std::filesystem::path> skin;  // .tfxskin
  std::string unit = "m";                     // of the input: a name, or metres in one unit
  std::string up = "y";                       // of the input
};

// Each writes a Ringlet groom (.h5) and says what it holds. Returns 0. Throws Error.
int run_groom_grow(const GroomGrowOptions& options);
int run_groom_convert(const GroomConvertOptions& options);

}  // namespace ringlet::app
