// Sums that several threads add to. Of whole numbers, so that the order changes nothing.
#pragma once
#include <cstdint>

#include "kernels/backend/qualifiers.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Adds to a number; returns what it was before.
RINGLET_KERNEL std::int32_t atomic_add(std::int32_t* to, std::int32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(to, value);
#else
  return __atomic_fetch_add(to, value, __ATOMIC_RELAXED);
#endif
}
RINGLET_KERNEL std::int64_t atomic_add(std::int64_t* to, std::int64_t value) {
#if defined(__CUDA_ARCH__)
  return static_cast<std::int64_t>(
      atomicAdd(reinterpret_cast<unsigned long long*>(to), static_cast<unsigned long long>(value)));
#else
  return __atomic_fetch_add(to, value, __ATOMIC_RELAXED);
#endif
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
