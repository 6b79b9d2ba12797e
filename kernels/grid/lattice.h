// Cells of a lattice: Morton keys, tiles of 4 x 4 x 4 cells, and where a cell lies in its tile.
//
// A key interleaves the bits of x, y and z, x lowest. The lowest six bits of a cell's key number it within
// its tile, those above are its tile's key: sorted by key, a tile's cells are consecutive, and so are the
// eight that make one cell of a lattice of double spacing.
#pragma once
#include <cstdint>

#include "kernels/backend/morton.h"
#include "kernels/backend/words.h"

namespace ringlet::kernels {

enum Direction { kLowX, kHighX, kLowY, kHighY, kLowZ, kHighZ, kDirections };

inline constexpr int kTileEdge = 4, kTileBits = 6, kTileCells = 1 << kTileBits;
inline constexpr int kTileParts = 8;  // of 2 x 2 x 2 cells, one after the other
inline constexpr int kPartCells = kTileCells / kTileParts;
inline constexpr int kAround = 27;        // tiles round a tile, itself among them
inline constexpr int kTileAxisBits = 18;  // of a tile's coordinate

inline namespace RINGLET_ISA {

// The key one further along an axis (0 to 2), wrapping at the end of its bits.
RINGLET_FUNCTION std::uint64_t key_after(std::uint64_t key, int axis) {
  const std::uint64_t mask = kAxisBits << axis, rest = ~mask;
  return (((key | rest) + (std::uint64_t{1} << axis)) & mask) | (key & ~mask);
}
RINGLET_FUNCTION std::uint64_t key_before(std::uint64_t key, int axis) {
  const std::uint64_t mask = kAxisBits << axis;
  return (((key & mask) - (std::uint64_t{1} << axis)) & mask) | (key & ~mask);
}

// Tiles are scattered in blocks of up to 2^together (0 or 3), colour by colour: there is a tile between any
// two blocks of a colour.
RINGLET_KERNEL std::uint64_t block_of(std::uint64_t tile_key, int together) { return tile_key >> together; }
RINGLET_KERNEL int colour_of(std::uint64_t block) { return static_cast<int>(block & 7); }
inline constexpr int kColours = 8;

// The number of a cell within its tile, from its coordinates' lowest two bits.
RINGLET_KERNEL int cell_in_tile(int x, int y, int z) {
  const auto spread = [](int a) { return (a & 1) | (a & 2) << 2; };
  return spread(x) | spread(y) << 1 | spread(z) << 2;
}
RINGLET_KERNEL int coordinate_in_tile(int cell, int axis) {
  return (cell >> axis & 1) | (cell >> (axis + 3) & 1) << 1;
}

// Where a key stands in a sorted list, -1 where it does not.
RINGLET_FUNCTION std::int32_t find_key(const std::uint64_t* keys, std::int32_t n, std::uint64_t key) {
  std::int32_t low = 0, high = n;
  while (low < high) {
    const std::int32_t middle = (low + high) / 2;
    if (keys[middle] < key)
      low = middle + 1;
    else
      high = middle;
  }
  return low < n && keys[low] == key ? low : -1;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
