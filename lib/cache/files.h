// Names of a cache's files, and files that are complete or not there at all.
#pragma once
#include <cstddef>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace ringlet::cache {

// The files of the cache `name` in `directory`.
struct Files {
  std::filesystem::path directory;
  std::string name;

  std::filesystem::path master() const { return directory / (name + ".h5"); }
  std::filesystem::path frame(int number) const { return directory / frame_name(number); }
  std::filesystem::path state() const { return directory / (name + ".state.h5"); }
  std::filesystem::path failed() const { return directory / (name + ".failed.h5"); }
  std::filesystem::path timings() const { return directory / (name + ".timings.jsonl"); }

  std::string frame_name(int number) const;                        // NAME.0007.h5, NAME.-0007.h5
  std::optional<int> frame_number(const std::string& file) const;  // the inverse: nothing for any other name
  std::map<int, std::filesystem::path> frames() const;             // those on disk
  bool exist() const;                                              // a master, a state or a frame is there
  void remove_all() const;                                         // every file of this cache
  void remove_leftovers() const;  // what a run that was killed or diverged left beside them
};

// Writes `bytes` to a hidden file beside `path`, flushes it to the disk and renames it to `path`. Throws
// Error{kIo} naming the path and the reason; then nothing is left behind and an older file at `path` is
// untouched.
void write_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);

// Appends a line to a text file. Throws Error{kIo}.
void append_line(const std::filesystem::path& path, const std::string& line);

// Makes the directory and its parents. Throws Error{kIo}.
void make_directory(const std::filesystem::path& directory);

}  // namespace ringlet::cache
