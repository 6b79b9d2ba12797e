#include "solids/level_set_cache.h"

#include <fmt/format.h>

#include <unistd.h>

#include <array>
#include <cstring>
#include <fstream>
#include <sstream>

#include "core/error.h"
#include "core/log.h"
#include "core/trace.h"

namespace ringlet::solids {
namespace {

constexpr std::uint32_t kFormat = 2;  // raised when level sets of the same surface come out otherwise

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

// A sealed file ends in a hash of what comes before: OpenVDB trusts what it reads, so that a damaged file
// must not get as far as it. Readers of .vdb files ignore what follows the grids.
constexpr std::size_t kSealBytes = 32;

std::string seal_of(std::string_view contents) {
  Hash hash;
  hash.add(contents.data(), contents.size());
  return hash.hex();
}

std::string contents_of(const std::filesystem::path& file) {
  std::ostringstream contents;
  contents << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(contents).str();
}

bool is_sealed(const std::filesystem::path& file) {
  const std::string contents = contents_of(file);
  if (contents.size() < kSealBytes) return false;
  const std::string_view all = contents;
  return all.substr(all.size() - kSealBytes) == seal_of(all.substr(0, all.size() - kSealBytes));
}

LevelSet read(const std::filesystem::path& file, std::size_t triangle_count) {
  if (!is_sealed(file)) throw Error(ErrorKind::kIo, file.string(), "the level set's file is damaged");
  return read_level_set(file, triangle_count);
}

// A file that is removed unless it has been renamed.
struct Aside {
  std::filesystem::path file;
  ~Aside() {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
  }
};

// Aside, then renamed: other runs see a whole file or none.
void write(const std::filesystem::path& file, const LevelSet& level_set) {
  std::error_code problem;
  std::filesystem::create_directories(file.parent_path(), problem);
  const Aside aside{file.string() + fmt::format(".{}.part", ::getpid())};
  write_level_set(aside.file, level_set);
  std::ofstream(aside.file, std::ios::binary | std::ios::app) << seal_of(contents_of(aside.file));
  if (is_sealed(aside.file)) {
    std::filesystem::rename(aside.file, file, problem);
  } else {
    problem = std::make_error_code(std::errc::no_space_on_device);
  }
  if (problem) throw Error(ErrorKind::kIo, file.string(), "cannot write the level set: " + problem.message());
}

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
  trace::Span span("level set", "set-up");
  span.tell("solid", options.name);
  const auto build = [&] {
    return std::make_shared<const LevelSet>(
        build_level_set(surface, vertices, options.voxel_size, options.half_width));
  };
  if (options.directory.empty()) return build();
  const std::filesystem::path file = options.directory / (content_key(surface, vertices, options) + ".vdb");
  std::error_code unreadable;
  if (std::filesystem::exists(file, unreadable)) {
    try {
      return std::make_shared<const LevelSet>(read(file, surface.triangles.size()));
    } catch (const Error& error) {
      log_warning(fmt::format("{}: {}; it is built anew", options.name, error.what()));
    }
  }
  std::shared_ptr<const LevelSet> built = build();
  try {
    write(file, *built);
  } catch (const Error& error) {
    log_warning(fmt::format("{}: {}; the run goes on without it", options.name, error.what()));
  }
  return built;
}

}  // namespace ringlet::solids
