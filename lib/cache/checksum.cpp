#include "cache/checksum.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <fstream>

namespace ringlet::cache {
namespace {

static_assert(std::endian::native == std::endian::little);

struct Trailer {
  char mark[8] = {'c', 'r', 'c', '3', '2'};
  std::uint64_t value = 0;
};

}  // namespace

void append_checksum(std::vector<std::byte>& file) {
  Trailer trailer;
  trailer.value = crc32_z(0, reinterpret_cast<const Bytef*>(file.data()), file.size());
  const auto bytes = std::bit_cast<std::array<std::byte, sizeof trailer>>(trailer);
  file.insert(file.end(), bytes.begin(), bytes.end());
}

bool is_sound(const std::filesystem::path& path) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error || size < sizeof(Trailer)) return true;
  std::ifstream file(path, std::ios::binary);
  Trailer found;
  file.seekg(-static_cast<std::streamoff>(sizeof found), std::ios::end);
  file.read(reinterpret_cast<char*>(&found), sizeof found);
  if (!file || std::memcmp(found.mark, Trailer{}.mark, sizeof found.mark) != 0) return true;

  file.seekg(0);
  uLong value = 0;
  std::vector<char> buffer(1 << 18);
  for (std::uintmax_t left = size - sizeof found; left > 0;) {
    const auto part = static_cast<std::streamsize>(std::min<std::uintmax_t>(left, buffer.size()));
    if (!file.read(buffer.data(), part)) return false;
    value = crc32_z(value, reinterpret_cast<const Bytef*>(buffer.data()), static_cast<z_size_t>(part));
    left -= static_cast<std::uintmax_t>(part);
  }
  return value == found.value;
}

}  // namespace ringlet::cache
