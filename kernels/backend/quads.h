// Values that lie four together in memory, one such quad for each lane.
#pragma once
#include "kernels/backend/real.h"
#if !defined(__CUDACC__)
#include "kernels/backend/pack.h"
#endif

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class R>
struct Quad {
  R x, y, z, w;
};

// quads[4 index[lane]] and the three after it, for each lane. `quads` is aligned to one of them.
template <class R>
RINGLET_KERNEL Quad<R> gather_quads(const Scalar<R>* quads, const std::int32_t* index) {
  if constexpr (Traits<R>::kWidth == 1) {
    const Scalar<R>* quad = quads + 4 * static_cast<std::int64_t>(*index);
    return {quad[0], quad[1], quad[2], quad[3]};
  } else {
    alignas(64) Scalar<R> lanes[4][Traits<R>::kWidth];
    for (int lane = 0; lane < Traits<R>::kWidth; ++lane)
      for (int k = 0; k < 4; ++k) lanes[k][lane] = quads[4 * static_cast<std::int64_t>(index[lane]) + k];
    return {load<R>(lanes[0]), load<R>(lanes[1]), load<R>(lanes[2]), load<R>(lanes[3])};
  }
}

// quads[4 stride lane] and the three after it become those of each lane.
template <class R>
RINGLET_KERNEL void store_quads(Scalar<R>* quads, int stride, const Quad<R>& from) {
  alignas(64) Scalar<R> lanes[4][Traits<R>::kWidth];
  store(lanes[0], from.x), store(lanes[1], from.y), store(lanes[2], from.z), store(lanes[3], from.w);
  for (int lane = 0; lane < Traits<R>::kWidth; ++lane)
    for (int k = 0; k < 4; ++k) quads[4 * stride * lane + k] = lanes[k][lane];
}

#if !defined(__CUDACC__) && defined(__AVX2__)
// Each quad is one load; then four by four values are transposed.
RINGLET_KERNEL Quad<Pack<float, 8>> gather_eight_quads(const float* quads, const std::int32_t* index) {
  const auto rows = [&](int lane) {
    const __m128 low = _mm_load_ps(quads + 4 * static_cast<std::int64_t>(index[lane])),
                 high = _mm_load_ps(quads + 4 * static_cast<std::int64_t>(index[lane + 4]));
    return _mm256_insertf128_ps(_mm256_castps128_ps256(low), high, 1);
  };
  const __m256 a = rows(0), b = rows(1), c = rows(2), d = rows(3);
  const __m256 ab_low = _mm256_unpacklo_ps(a, b), ab_high = _mm256_unpackhi_ps(a, b),
               cd_low = _mm256_unpacklo_ps(c, d), cd_high = _mm256_unpackhi_ps(c, d);
  const auto pack = [](__m256 v) { return Pack<float, 8>(Pack<float, 8>::Vector(v)); };
  return {pack(_mm256_shuffle_ps(ab_low, cd_low, 0x44)), pack(_mm256_shuffle_ps(ab_low, cd_low, 0xee)),
          pack(_mm256_shuffle_ps(ab_high, cd_high, 0x44)), pack(_mm256_shuffle_ps(ab_high, cd_high, 0xee))};
}
RINGLET_KERNEL void store_eight_quads(float* quads, int stride, __m256 x, __m256 y, __m256 z, __m256 w) {
  const __m256 xy_low = _mm256_unpacklo_ps(x, y), xy_high = _mm256_unpackhi_ps(x, y),
               zw_low = _mm256_unpacklo_ps(z, w), zw_high = _mm256_unpackhi_ps(z, w);
  const auto put = [&](int lane, __m256 both) {
    _mm_store_ps(quads + 4 * stride * lane, _mm256_castps256_ps128(both));
    _mm_store_ps(quads + 4 * stride * (lane + 4), _mm256_extractf128_ps(both, 1));
  };
  put(0, _mm256_shuffle_ps(xy_low, zw_low, 0x44)), put(1, _mm256_shuffle_ps(xy_low, zw_low, 0xee));
  put(2, _mm256_shuffle_ps(xy_high, zw_high, 0x44)), put(3, _mm256_shuffle_ps(xy_high, zw_high, 0xee));
}
#if defined(__AVX512F__)
template <>
RINGLET_KERNEL void store_quads(float* quads, int stride, const Quad<Pack<float, 16>>& from) {
  const auto low = [](Pack<float, 16> v) { return _mm512_castps512_ps256(__m512(v.v)); };
  const auto high = [](Pack<float, 16> v) { return _mm512_extractf32x8_ps(__m512(v.v), 1); };
  store_eight_quads(quads, stride, low(from.x), low(from.y), low(from.z), low(from.w));
  store_eight_quads(quads + 32 * stride, stride, high(from.x), high(from.y), high(from.z), high(from.w));
}
template <>
RINGLET_KERNEL Quad<Pack<float, 16>> gather_quads(const float* quads, const std::int32_t* index) {
  const Quad<Pack<float, 8>> low = gather_eight_quads(quads, index),
                             high = gather_eight_quads(quads, index + 8);
  const auto join = [](Pack<float, 8> one, Pack<float, 8> other) {
    return Pack<float, 16>(Pack<float, 16>::Vector(
        _mm512_insertf32x8(_mm512_castps256_ps512(__m256(one.v)), __m256(other.v), 1)));
  };
  return {join(low.x, high.x), join(low.y, high.y), join(low.z, high.z), join(low.w, high.w)};
}
#else
template <>
RINGLET_KERNEL void store_quads(float* quads, int stride, const Quad<Pack<float, 8>>& from) {
  store_eight_quads(quads, stride, __m256(from.x.v), __m256(from.y.v), __m256(from.z.v), __m256(from.w.v));
}
template <>
RINGLET_KERNEL Quad<Pack<float, 8>> gather_quads(const float* quads, const std::int32_t* index) {
  return gather_eight_quads(quads, index);
}
#endif
#endif

// Those of each lane: quads[4 stride lane] and the three after it.
template <class R>
RINGLET_KERNEL Quad<R> load_quads(const Scalar<R>* quads, int stride) {
  std::int32_t index[Traits<R>::kWidth];
  for (int lane = 0; lane < Traits<R>::kWidth; ++lane) index[lane] = stride * lane;
  return gather_quads<R>(quads, index);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
