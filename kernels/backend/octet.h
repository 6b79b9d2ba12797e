// Eight reals side by side: a node's values. On the host a vector of the compiler's, split to what the
// processor has; on a device an array. Products and sums are rounded one by one, alike everywhere.
#pragma once
#include <cstdint>

#include "kernels/backend/real.h"

#if !defined(__CUDACC__)
#include <immintrin.h>
#endif

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
struct Octet {
#if defined(__CUDACC__)
  struct alignas(16) Vector {  // as much as a thread loads at once
    T lane[8];
    RINGLET_KERNEL T& operator[](int k) { return lane[k]; }
    RINGLET_KERNEL const T& operator[](int k) const { return lane[k]; }
  };
#else
  typedef T Vector __attribute__((vector_size(8 * sizeof(T))));
  typedef T Unaligned __attribute__((vector_size(8 * sizeof(T)), aligned(sizeof(T)), may_alias));
#endif
  Vector v;

  Octet() = default;
  RINGLET_KERNEL explicit Octet(T all) {
#if defined(__CUDACC__)
    RINGLET_UNROLL
    for (int k = 0; k < 8; ++k) v[k] = all;
#else
    v = all - Vector{};
#endif
  }
  // `p` aligned to eight values
  RINGLET_KERNEL static Octet load(const T* p) { return *reinterpret_cast<const Octet*>(p); }
  RINGLET_KERNEL void store(T* p) const { *reinterpret_cast<Octet*>(p) = *this; }
  // `p` aligned to four values
  RINGLET_KERNEL static Octet load_by_halves(const T* p) {
#if defined(__CUDACC__)
    return load(p);
#else
    Octet a;
    a.v = *reinterpret_cast<const Unaligned*>(p);
    return a;
#endif
  }
  RINGLET_KERNEL void store_by_halves(T* p) const {
#if defined(__CUDACC__)
    store(p);
#else
    *reinterpret_cast<Unaligned*>(p) = v;
#endif
  }

  friend RINGLET_KERNEL Octet operator+(const Octet& a, const Octet& b) {
    return each(a, b, [](auto x, auto y) { return x + y; });
  }
  friend RINGLET_KERNEL Octet operator-(const Octet& a, const Octet& b) {
    return each(a, b, [](auto x, auto y) { return x - y; });
  }
  friend RINGLET_KERNEL Octet operator*(const Octet& a, const Octet& b) {
    return each(a, b, [](auto x, auto y) { return x * y; });
  }
  friend RINGLET_KERNEL Octet operator&(const Octet& a, const Octet& b) {
    return each(a, b, [](auto x, auto y) { return x & y; });
  }
  friend RINGLET_KERNEL Octet operator|(const Octet& a, const Octet& b) {
    return each(a, b, [](auto x, auto y) { return x | y; });
  }
  friend RINGLET_KERNEL Octet operator^(const Octet& a, const Octet& b) {
    return each(a, b, [](auto x, auto y) { return x ^ y; });
  }
  friend RINGLET_KERNEL Octet operator>>(const Octet& a, int bits) {
    return each(a, a, [bits](auto x, auto) { return x >> bits; });
  }

 private:
  template <class F>
  static RINGLET_KERNEL Octet each(const Octet& a, const Octet& b, const F& f) {
    Octet result;
#if defined(__CUDACC__)
    RINGLET_UNROLL
    for (int k = 0; k < 8; ++k) result.v[k] = f(a.v[k], b.v[k]);
#else
    result.v = f(a.v, b.v);
#endif
    return result;
  }
};

// Lanes of `a` (0 to 7) and `b` (8 to 15) by number.
template <int... kFrom, class T>
RINGLET_KERNEL Octet<T> shuffled(const Octet<T>& a, const Octet<T>& b) {
  static_assert(sizeof...(kFrom) == 8);
  Octet<T> result;
#if defined(__CUDACC__)
  int k = 0;
  ((result.v[k++] = kFrom < 8 ? a.v[kFrom & 7] : b.v[kFrom & 7]), ...);
#else  // one instruction or two: lane by lane, GCC takes one for each
  result.v = __builtin_shufflevector(a.v, b.v, kFrom...);
#endif
  return result;
}

// `a` in the lanes whose bits are set, `b` in the others.
template <int kLanesOfA, class T>
RINGLET_KERNEL Octet<T> choose(const Octet<T>& a, const Octet<T>& b) {
  constexpr auto from = [](int k) { return kLanesOfA >> k & 1 ? k : k + 8; };
  return shuffled<from(0), from(1), from(2), from(3), from(4), from(5), from(6), from(7)>(a, b);
}

// Lane k in all lanes.
template <int k, class T>
RINGLET_KERNEL Octet<T> spread(const Octet<T>& a) {
  return shuffled<k, k, k, k, k, k, k, k>(a, a);
}

// Half of the lanes, in both halves.
template <class T>
RINGLET_KERNEL Octet<T> first_half(const Octet<T>& a) {
  return shuffled<0, 1, 2, 3, 0, 1, 2, 3>(a, a);
}
template <class T>
RINGLET_KERNEL Octet<T> second_half(const Octet<T>& a) {
  return shuffled<4, 5, 6, 7, 4, 5, 6, 7>(a, a);
}

// The lanes that are not 0, a bit for each.
RINGLET_KERNEL std::uint32_t not_zero(const Octet<std::int32_t>& a) {
#if defined(__AVX2__) && !defined(__CUDACC__)
  const __m256i zero = _mm256_cmpeq_epi32(reinterpret_cast<__m256i>(a.v), _mm256_setzero_si256());
  return ~static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(zero))) & 0xffu;
#else
  std::uint32_t bits = 0;
  for (int k = 0; k < 8; ++k) bits |= a.v[k] != 0 ? 1u << k : 0u;
  return bits;
#endif
}

// Towards zero; what does not fit is anything.
template <class T>
RINGLET_KERNEL Octet<std::int32_t> truncated(const Octet<T>& a) {
  Octet<std::int32_t> result;
#if defined(__CUDACC__)
  RINGLET_UNROLL
  for (int k = 0; k < 8; ++k) result.v[k] = static_cast<std::int32_t>(a.v[k]);
#else
  result.v = __builtin_convertvector(a.v, Octet<std::int32_t>::Vector);
#endif
  return result;
}
template <class T, class I>
RINGLET_KERNEL Octet<T> to_real(const Octet<I>& a) {
  Octet<T> result;
#if defined(__CUDACC__)
  RINGLET_UNROLL
  for (int k = 0; k < 8; ++k) result.v[k] = static_cast<T>(a.v[k]);
#else
  result.v = __builtin_convertvector(a.v, typename Octet<T>::Vector);
#endif
  return result;
}

// The nearest integers, halves to the even one.
RINGLET_KERNEL Octet<std::int32_t> nearest(const Octet<float>& a) {
  Octet<std::int32_t> result;
#if defined(__CUDACC__)
  RINGLET_UNROLL
  for (int k = 0; k < 8; ++k) {
#if defined(__CUDA_ARCH__)
    result.v[k] = __float2int_rn(a.v[k]);
#else
    result.v[k] = static_cast<std::int32_t>(__builtin_lrintf(a.v[k]));
#endif
  }
#elif defined(__AVX__)
  result.v = reinterpret_cast<Octet<std::int32_t>::Vector>(_mm256_cvtps_epi32(a.v));
#else
  const float* lanes = reinterpret_cast<const float*>(&a.v);
  auto* to = reinterpret_cast<__m128i*>(&result.v);
  to[0] = _mm_cvtps_epi32(_mm_load_ps(lanes)), to[1] = _mm_cvtps_epi32(_mm_load_ps(lanes + 4));
#endif
  return result;
}
RINGLET_KERNEL Octet<std::int64_t> nearest(const Octet<double>& a) {
  Octet<std::int64_t> result;
#if defined(__AVX512DQ__) && !defined(__CUDACC__)
  result.v = reinterpret_cast<Octet<std::int64_t>::Vector>(_mm512_cvtpd_epi64(a.v));
#else
  for (int k = 0; k < 8; ++k) result.v[k] = __builtin_llrint(a.v[k]);
#endif
  return result;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
