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

// Writes first + lane for each lane whose bit is set, in order, without a branch: `to` has room for kWidth
// numbers beyond those. Returns how many there are.
template <int kWidth>
RINGLET_KERNEL int append_lanes(std::int32_t* to, std::int32_t first, std::uint32_t bits) {
  int count = 0;
  for (int lane = 0; lane < kWidth; ++lane) to[count] = first + lane, count += bits >> lane & 1;
  return count;
}

// Writes from[lane] in the same way, which has room for kWidth values.
template <int kWidth, class T>
RINGLET_KERNEL int append_selected(T* to, const T* from, std::uint32_t bits) {
  int count = 0;
  for (int lane = 0; lane < kWidth; ++lane) to[count] = from[lane], count += bits >> lane & 1;
  return count;
}

// The same for a pack, or for one value.
RINGLET_KERNEL int append_selected(float* to, float from, std::uint32_t bits) {
  *to = from;
  return static_cast<int>(bits & 1);
}
#if !defined(__CUDACC__)
template <class T, int W>
RINGLET_KERNEL int append_selected(T* to, Pack<T, W> from, std::uint32_t bits) {
  alignas(64) T values[W];
  from.store(values);
  return append_selected<W>(to, values, bits);
}

#if defined(__AVX512F__)
template <>
RINGLET_KERNEL int append_lanes<16>(std::int32_t* to, std::int32_t first, std::uint32_t bits) {
  const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  const __m512i numbers = _mm512_add_epi32(lanes, _mm512_set1_epi32(first));
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), numbers));
  return __builtin_popcount(bits);
}
template <>
RINGLET_KERNEL int append_selected<16>(std::int32_t* to, const std::int32_t* from, std::uint32_t bits) {
  const __m512i values = _mm512_loadu_si512(from);
  _mm512_storeu_si512(to, _mm512_maskz_compress_epi32(static_cast<__mmask16>(bits), values));
  return __builtin_popcount(bits);
}
template <>
RINGLET_KERNEL int append_selected(float* to, Pack<float, 16> from, std::uint32_t bits) {
  _mm512_storeu_ps(to, _mm512_maskz_compress_ps(static_cast<__mmask16>(bits), __m512(from.v)));
  return __builtin_popcount(bits);
}
#elif defined(__AVX2__)
// For each set of eight lanes the numbers of its lanes, a byte each, the lowest first.
struct LaneNumbers {
  std::uint64_t of[256];
  constexpr LaneNumbers() : of() {
    for (int bits = 0; bits < 256; ++bits)
      for (int lane = 0, at = 0; lane < 8; ++lane)
        if (bits >> lane & 1) of[bits] |= static_cast<std::uint64_t>(lane) << (8 * at++);
  }
};
inline constexpr LaneNumbers kLaneNumbers;

template <>
RINGLET_KERNEL int append_lanes<8>(std::int32_t* to, std::int32_t first, std::uint32_t bits) {
  const __m128i bytes = _mm_cvtsi64_si128(static_cast<long long>(kLaneNumbers.of[bits]));
  const __m256i numbers = _mm256_add_epi32(_mm256_cvtepu8_epi32(bytes), _mm256_set1_epi32(first));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), numbers);
  return __builtin_popcount(bits);
}
RINGLET_KERNEL __m256i selected_first(__m256i values, std::uint32_t bits) {
  const __m128i bytes = _mm_cvtsi64_si128(static_cast<long long>(kLaneNumbers.of[bits]));
  return _mm256_permutevar8x32_epi32(values, _mm256_cvtepu8_epi32(bytes));
}
template <>
RINGLET_KERNEL int append_selected<8>(std::int32_t* to, const std::int32_t* from, std::uint32_t bits) {
  const __m256i values = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
  _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), selected_first(values, bits));
  return __builtin_popcount(bits);
}
template <>
RINGLET_KERNEL int append_selected(float* to, Pack<float, 8> from, std::uint32_t bits) {
  _mm256_storeu_ps(to, _mm256_castsi256_ps(selected_first(_mm256_castps_si256(__m256(from.v)), bits)));
  return __builtin_popcount(bits);
}
#endif
#endif

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
