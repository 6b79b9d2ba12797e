// Small caches for the tests of the cache.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "cache/reader.h"
#include "cache/writer.h"
#include "core/error.h"

namespace ringlet::cache {

// A directory of its own for each test, removed at its end.
class CacheTest : public testing::Test {
 protected:
  CacheTest() {
    std::string pattern = testing::TempDir() + "ringlet_cache_XXXXXX";
    directory_ = ::mkdtemp(pattern.data());
  }
  ~CacheTest() override { std::filesystem::remove_all(directory_); }

  std::filesystem::path directory_;
};

// Three strands of 2, 4 and 3 particles on two grooms, and a head of one triangle.
inline state::RunHeader small_header() {
  state::RunHeader header;
  header.name = "small";
  header.scene_json = R"({"frames": {"first": 1, "last": 3}, "model": {"drag": 0.25, "substeps": 8}})";
  header.scene_hash = "0123abcd";
  header.program_version = "0.1.0";
  header.backend = "cpu";
  header.instruction_set = "avx2";
  header.precision = "float";
  header.length_unit = "cm";
  header.metres_per_unit = 0.01;
  header.up = "y";
  header.fps = 25;
  header.first_frame = 1;
  header.last_frame = 3;
  header.offsets = {0, 2, 6, 9};
  header.root_triangle = {0, 0, -1};
  header.root_barycentric = {1, 0, 0, 0.5f, 0.25f, 0.25f, 0, 0, 0};
  for (int i = 0; i < 27; ++i) header.rest_position.push_back(0.37f * static_cast<float>(i) - 3);
  header.width.assign(9, 0.008f);
  header.groom_of_strand = {0, 0, 1};
  header.groom_names = {"hair", "beard"};
  header.surfaces = {{"head", {0, 1, 2}}};
  return header;
}

inline state::Frame small_frame(int number) {
  state::Frame frame;
  frame.number = number;
  frame.time = (number - 1) / 25.0;
  for (int i = 0; i < 27; ++i) {
    frame.position.push_back(std::sin(1.7f * static_cast<float>(i) + static_cast<float>(number)));
    frame.velocity.push_back(std::cos(0.9f * static_cast<float>(i * number)));
  }
  frame.surface_vertices = {{0, 0, 0, 1, 0, 0, 0, static_cast<float>(number), 0}};
  frame.figures = {{"iterations", 2.0 + number}, {"edge_strain", 1e-4 * number}};
  return frame;
}

inline state::Snapshot small_snapshot(int number) {
  state::Snapshot snapshot;
  snapshot.frame = number;
  snapshot.arrays["position"] = std::vector<std::byte>(37, static_cast<std::byte>(number));
  snapshot.arrays["empty"] = {};
  return snapshot;
}

// Writes frames `first` to `last` of the small cache and finishes it.
inline void write_small(const std::filesystem::path& directory, int first, int last,
                        const WriterOptions& options = {}, const state::RunHeader& header = small_header()) {
  CacheWriter writer(directory, header, options);
  for (int number = first; number <= last; ++number)
    writer.write(small_frame(number), small_snapshot(number), 0.5);
  writer.finish();
}

inline std::string bytes_of_file(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::vector<std::string> files_in(const std::filesystem::path& directory) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(directory))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

// The error that `action` throws; fails the test when it throws none.
template <class Action>
Error error_of(Action action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error was thrown";
  return {ErrorKind::kUsage, "", ""};
}

}  // namespace ringlet::cache
