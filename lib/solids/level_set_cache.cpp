#include "solids/level_set_cache.h"

#include <fmt/format.h>

#include <cstring>

#include "core/error.h"
#include "core/log.h"

namespace ringlet::solids {
namespace {

constexpr std::uint32_t kFormat = 1;  // raised when level sets of the same surface come out otherwise

// Two 64-bit multiplicative hashes side by side. Not against malice: a directory of one's own files.
class Hash {
 public:
  void add(const void* data, std::size_t bytes) {
    const auto* next = static_cast<const unsigned char*>(data);
    for (; bytes > 0; next += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      const std::size_t taken = std::min(bytes, sizeof word);
      std::memcpy(&word, next, taken);
      mix(word);
      bytes -= taken;
      if (taken < sizeof word) break;
    }
  }
  template <class T>
  void add(const T& value) {
    add(&value, sizeof value);
  }
  std::string hex() const { return fmt::format("{:016x}{:016x}", a_, b_); }

 private:
  void mix(std::uint64_t word) {
    a_ = (a_ ^ word) * 0x9e3779b97f4a7c15u;
    a_ ^= a_ >> 32;
    b_ = (b_ + word) * 0xc2b2ae3d27d4eb4fu;
    b_ ^= b_ >> 29;
  }
  std::uint64_t a_ = 0x243f6a8885a308d3u, b_ = 0x13198a2e03707344u;  // digits of pi
};

}  // namespace

std::string content_key(const ClosedSurface& surface, std::span<const Eigen::Vector3f> vertices,
                        const LevelSetOptions& options) {
  Hash hash;
  hash.add(kFormat);
  hash.add(options.voxel_size);
  hash.add(options.half_width);
  hash.add(vertices.size());
  hash.add(vertices.data(), vertices.size_bytes());
  hash.add(surface.triangles.size());
  hash.add(surface.triangles.data(), surface.triangles.size() * sizeof(Triangle));
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    if (surface.bounds_cavity[t]) hash.add(t);
  return hash.hex();
}

std::shared_ptr<const LevelSet> cached_level_set(const ClosedSurface& surface,
                                                 std::span<const Eigen::Vector3f> vertices,
                                                 const LevelSetOptions& options) {
  const auto build = [&] {
    return std::make_shared<const LevelSet>(
        build_level_set(surface, vertices, options.voxel_size, options.half_width));
  };
  if (options.directory.empty()) return build();
  const std::filesystem::path file = options.directory / (content_key(surface, vertices, options) + ".vdb");
  std::error_code unreadable;
  if (std::filesystem::exists(file, unreadable)) {
    try {
      return std::make_shared<const LevelSet>(read_level_set(file, surface.triangles.size()));
    } catch (const Error& error) {
      log_warning(fmt::format("{}: {}; it is built anew", options.name, error.what()));
    }
  }
  std::shared_ptr<const LevelSet> built = build();
  try {
    write_level_set(file, *built);
  } catch (const Error& error) {
    log_warning(fmt::format("{}: {}; the run goes on without it", options.name, error.what()));
  }
  return built;
}

}  // namespace ringlet::solids
