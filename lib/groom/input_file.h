// A binary groom file in memory, read with every offset and count checked against its size.
#pragma once
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "groom/strands.h"

namespace ringlet::groom {

class InputFile {
 public:
  // Reads the whole file. Throws Error{kInput} where it does not exist or cannot be read.
  explicit InputFile(const std::filesystem::path& path);

  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return bytes_.size(); }
  bool starts_with(std::string_view magic) const;
  std::string_view text() const { return {bytes_.data(), bytes_.size()}; }

  // The little-endian value at a byte offset; `what` names it where the file ends before it.
  template <class T>
  T value(std::uint64_t offset, std::string_view what) const {
    require(offset, 1, sizeof(T), what);
    T value;
    std::memcpy(&value, bytes_.data() + offset, sizeof(T));
    return value;
  }

  // Throws unless `count` elements of `element_bytes` fit between `offset` and the end of the file. To be
  // called before anything is allocated for them.
  void require(std::uint64_t offset, std::uint64_t count, std::uint64_t element_bytes,
               std::string_view what) const;

  // Appends the strand that is number `strand` in the file: `count` positions, three float32 each, `stride`
  // bytes apart. `what` was checked by require(). Throws on NaN and infinity, naming strand, particle and
  // byte offset.
  void append_strand(std::uint64_t offset, std::uint64_t count, std::uint64_t stride, std::uint64_t strand,
                     Strands& strands) const;

  // Throws Error{kInput} at a byte offset of this file.
  [[noreturn]] void fail(std::uint64_t offset, std::string what, std::string hint = {}) const;

 private:
  std::filesystem::path path_;
  std::vector<char> bytes_;
};

}  // namespace ringlet::groom
