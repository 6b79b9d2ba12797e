// A checksum at the end of every file of a cache; private to the room.
//
// The HDF5 library may crash on a damaged file. So its files carry 16 bytes behind their end, where HDF5 does
// not look: "crc32", three zero bytes, and the CRC-32 of all before as a little-endian 64-bit number.
#pragma once
#include <cstddef>
#include <filesystem>
#include <vector>

namespace ringlet::cache {

void append_checksum(std::vector<std::byte>& file);

// Whether the file is as it was written. One without a checksum counts as sound: another program has
// rewritten it.
bool is_sound(const std::filesystem::path& path);

}  // namespace ringlet::cache
