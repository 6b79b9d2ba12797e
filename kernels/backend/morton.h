// Morton keys: the bits of three coordinates interleaved, x lowest. Sorted by them places lie along a curve
// that fills space, the Z-order (Morton 1966): what is near one another on it is so in space.
#pragma once
#include <cstdint>

#include "kernels/backend/qualifiers.h"

namespace ringlet::kernels {

inline constexpr std::uint64_t kAxisBits = 0x1249249249249249ull;  // a key's bits that are x's

inline namespace RINGLET_ISA {

// The bits of a coordinate three apart.
RINGLET_FUNCTION std::uint64_t spread_bits(std::uint32_t a) {
  std::uint64_t x = a & 0x1fffffu;
  x = (x | x << 32) & 0x1f00000000ffffull;
  x = (x | x << 16) & 0x1f0000ff0000ffull;
  x = (x | x << 8) & 0x100f00f00f00f00full;
  x = (x | x << 4) & 0x10c30c30c30c30c3ull;
  return (x | x << 2) & kAxisBits;
}
RINGLET_FUNCTION std::uint32_t gather_bits(std::uint64_t x) {
  x &= kAxisBits;
  x = (x | x >> 2) & 0x10c30c30c30c30c3ull;
  x = (x | x >> 4) & 0x100f00f00f00f00full;
  x = (x | x >> 8) & 0x1f0000ff0000ffull;
  x = (x | x >> 16) & 0x1f00000000ffffull;
  return static_cast<std::uint32_t>((x | x >> 32) & 0x1fffffu);
}
RINGLET_FUNCTION std::uint64_t key_of(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return spread_bits(x) | spread_bits(y) << 1 | spread_bits(z) << 2;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
