#include "groom/input_file.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <fstream>

#include "core/error.h"

namespace ringlet::groom {

static_assert(std::endian::native == std::endian::little,
              "groom files are little-endian and read as they are");

namespace {
std::vector<char> read_all(const std::filesystem::path& path) {
  std::error_code status;
  if (!std::filesystem::exists(path, status)) {
    throw Error(ErrorKind::kInput, path.string(), "no such groom file",
                "check the path; it is relative to the scene file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, status);
  std::ifstream stream(path, std::ios::binary);
  if (status || !stream) {
    throw Error(ErrorKind::kInput, path.string(), "cannot be read as a file",
                "check that it is a file you may read");
  }
  std::vector<char> bytes(size);
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(
      static_cast<std::size_t>(stream.gcount()));  // a file that shrank meanwhile is caught as truncated
  return bytes;
}
}  // namespace

InputFile::InputFile(const std::filesystem::path& path) : path_(path), bytes_(read_all(path)) {}

bool InputFile::starts_with(std::string_view magic) const {
  return bytes_.size() >= magic.size() && std::string_view(bytes_.data(), magic.size()) == magic;
}

void InputFile::require(std::uint64_t offset, std::uint64_t count, std::uint64_t element_bytes,
                        std::string_view what) const {
  const std::uint64_t room = offset <= size() ? (size() - offset) / element_bytes : 0;
  if (offset <= size() && count <= room) return;
  fail(offset,
       fmt::format("expected {} x {} bytes of {}, but the file ends at byte {}", count, element_bytes, what,
                   size()),
       "the file is truncated, or its header is wrong");
}

void InputFile::append_strand(std::uint64_t offset, std::uint64_t count, std::uint64_t stride,
                              std::uint64_t strand, Strands& strands) const {
  for (std::uint64_t i = 0; i < count; ++i) {
    float xyz[3];
    std::memcpy(xyz, bytes_.data() + offset + i * stride, sizeof xyz);
    for (int axis = 0; axis < 3; ++axis) {
      if (std::isfinite(xyz[axis])) continue;
      fail(offset + i * stride + 4 * axis,
           fmt::format("strand {}, particle {}: coordinate {} is {}, expected a finite number", strand, i,
                       "xyz"[axis], xyz[axis]),
           "repair the groom where it was exported");
    }
    strands.points.emplace_back(xyz[0], xyz[1], xyz[2]);
  }
  strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
}

void InputFile::fail(std::uint64_t offset, std::string what, std::string hint) const {
  throw Error(ErrorKind::kInput, fmt::format("{} byte {}", path_.string(), offset), std::move(what),
              std::move(hint));
}

}  // namespace ringlet::groom
