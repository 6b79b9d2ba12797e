// A mask as bits, one a lane, so that the few lanes of interest can be visited.
#pragma once
#include <cstdint>

#include "kernels/backend/real.h"
#if !defined(__CUDACC__)
#include "kernels/backend/pack.h"
#endif

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

RINGLET_KERNEL std::uint32_t lane_bits(bool mask) { return mask ? 1u : 0u; }

#if !defined(__CUDACC__)
#if defined(__AVX512DQ__)
RINGLET_KERNEL std::uint32_t lane_bits(PackMask<float, 16> mask) {
  return _mm512_movepi32_mask(reinterpret_cast<__m512i>(mask.v));
}
RINGLET_KERNEL std::uint32_t lane_bits(PackMask<double, 8> mask) {
  return _mm512_movepi64_mask(reinterpret_cast<__m512i>(mask.v));
}
#elif defined(__AVX2__)
RINGLET_KERNEL std::uint32_t lane_bits(PackMask<float, 8> mask) {
  return static_cast<std::uint32_t>(_mm256_movemask_ps(reinterpret_cast<__m256>(mask.v)));
}
RINGLET_KERNEL std::uint32_t lane_bits(PackMask<double, 4> mask) {
  return static_cast<std::uint32_t>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask.v)));
}
#else
RINGLET_KERNEL std::uint32_t lane_bits(PackMask<float, 4> mask) {
  return static_cast<std::uint32_t>(_mm_movemask_ps(reinterpret_cast<__m128>(mask.v)));
}
RINGLET_KERNEL std::uint32_t lane_bits(PackMask<double, 2> mask) {
  return static_cast<std::uint32_t>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask.v)));
}
#endif
#endif

// `any` by way of the bits: compilers take `any` lane by lane.
template <class Mask>
RINGLET_KERNEL bool some(Mask mask) {
  return lane_bits(mask) != 0;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
