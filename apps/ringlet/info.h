// ringlet info FILE
#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>

namespace ringlet::app {

struct InfoOptions {
  std::filesystem::path file;  // a cache or one of its files, a groom, a mesh or a scene
  bool json = false;
  std::optional<std::int64_t> strand;  // print its points and length
};

// Prints what the file holds. Returns 0. Throws Error: unreadable, or a strand that is not there.
int run_info(const InfoOptions& options);

}  // namespace ringlet::app
