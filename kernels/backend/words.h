// What each compiler has a word of its own for.
#pragma once
#include <cstdint>

#include "kernels/backend/qualifiers.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// How many bits are set.
RINGLET_KERNEL int ones(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return __popcll(bits);
#else
  return __builtin_popcountll(bits);
#endif
}

// Asks for memory that will be read soon. A device has other threads to run meanwhile.
RINGLET_KERNEL void prefetch([[maybe_unused]] const void* address) {
#if !defined(__CUDA_ARCH__)
  __builtin_prefetch(address);
#endif
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
