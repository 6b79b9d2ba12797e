// Reads caches.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "cache/cache.h"

namespace ringlet::cache {

// A cache: a directory, its master file, or a failed state (a cache of one frame). Everything is checked as
// it is read; every error is an Error{kInput} that names the file.
class CacheReader {
 public:
  explicit CacheReader(const std::filesystem::path& path);

  const state::RunHeader& header() const { return header_; }
  const std::filesystem::path& file() const { return file_; }  // the master or the failed state
  std::size_t strands() const { return header_.offsets.size() - 1; }
  std::size_t particles() const { return header_.rest_position.size() / 3; }

  // The frames whose files are there now, ascending; of a run that was killed, all that it completed.
  const std::vector<int>& frames() const { return frames_; }
  state::Frame read(int frame) const;

  Compression compression() const { return compression_; }
  double error_bound() const { return error_bound_; }  // of positions, scene units; 0 unless quantised
  const std::optional<Failure>& failure() const { return failure_; }

 private:
  std::filesystem::path file_;
  state::RunHeader header_;
  std::vector<int> frames_;
  std::map<int, std::filesystem::path> frame_files_;
  Compression compression_ = Compression::kDefault;
  double error_bound_ = 0;
  std::optional<Failure> failure_;
};

// What a file of a cache is; nothing if it is no HDF5 file or its `format` is another's. Throws Error{kInput}
// for a newer or damaged one.
std::optional<Content> content_of(const std::filesystem::path& file);

// The `format` attribute of an HDF5 file ("ringlet-cache", ...); empty: none, or no HDF5 file.
std::string format_of(const std::filesystem::path& file);

// One file by itself.
state::Frame read_frame_file(const std::filesystem::path& file);
state::Snapshot read_state_file(const std::filesystem::path& file);

}  // namespace ringlet::cache
