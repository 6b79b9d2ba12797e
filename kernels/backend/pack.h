// Pack<T, W>: W reals side by side in one vector register, one strand a lane. Host only.
#pragma once
#include <immintrin.h>

#include "kernels/backend/real.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
struct IntOfSize;
template <>
struct IntOfSize<float> {
  using Type = int;
};
template <>
struct IntOfSize<double> {
  using Type = long long;
};

template <class T, int W>
struct VectorOf {
  typedef T Type __attribute__((vector_size(W * sizeof(T))));
};

template <class T, int W>
struct PackMask {
  using Vector = typename VectorOf<typename IntOfSize<T>::Type, W>::Type;
  Vector v;

  RINGLET_KERNEL PackMask operator&(PackMask o) const { return {v & o.v}; }
  RINGLET_KERNEL PackMask operator|(PackMask o) const { return {v | o.v}; }
  RINGLET_KERNEL PackMask operator!() const { return {~v}; }
};

template <class T, int W>
RINGLET_KERNEL bool any(PackMask<T, W> mask) {
  typename IntOfSize<T>::Type found = 0;
  for (int lane = 0; lane < W; ++lane) found |= mask.v[lane];
  return found != 0;
}

template <class T, int W>
struct Pack {
  using Vector = typename VectorOf<T, W>::Type;
  Vector v;

  Pack() = default;
  RINGLET_KERNEL Pack(Vector vector) : v(vector) {}
  RINGLET_KERNEL Pack(T scalar) : v(scalar - Vector{}) {}
  RINGLET_KERNEL explicit Pack(int scalar) : Pack(static_cast<T>(scalar)) {}

  RINGLET_KERNEL static Pack load(const T* p) { return *reinterpret_cast<const Vector*>(p); }
  RINGLET_KERNEL void store(T* p) const { *reinterpret_cast<Vector*>(p) = v; }

  friend RINGLET_KERNEL Pack operator+(Pack a, Pack b) { return a.v + b.v; }
  friend RINGLET_KERNEL Pack operator-(Pack a, Pack b) { return a.v - b.v; }
  friend RINGLET_KERNEL Pack operator-(Pack a) { return -a.v; }
  friend RINGLET_KERNEL Pack operator*(Pack a, Pack b) { return a.v * b.v; }
  friend RINGLET_KERNEL Pack operator/(Pack a, Pack b) { return a.v / b.v; }
  friend RINGLET_KERNEL PackMask<T, W> operator<(Pack a, Pack b) { return {a.v < b.v}; }
  friend RINGLET_KERNEL PackMask<T, W> operator>(Pack a, Pack b) { return {a.v > b.v}; }
  friend RINGLET_KERNEL PackMask<T, W> operator<=(Pack a, Pack b) { return {a.v <= b.v}; }
};

template <class T, int W>
struct Traits<Pack<T, W>> {
  using Scalar = T;
  using Mask = PackMask<T, W>;
  static constexpr int kWidth = W;
};

template <class T, int W>
RINGLET_KERNEL Pack<T, W> select(PackMask<T, W> mask, Pack<T, W> a, Pack<T, W> b) {
  return mask.v ? a.v : b.v;
}

#if defined(__AVX512F__)
RINGLET_KERNEL Pack<float, 16> fma(Pack<float, 16> a, Pack<float, 16> b, Pack<float, 16> c) {
  return _mm512_fmadd_ps(a.v, b.v, c.v);
}
RINGLET_KERNEL Pack<double, 8> fma(Pack<double, 8> a, Pack<double, 8> b, Pack<double, 8> c) {
  return _mm512_fmadd_pd(a.v, b.v, c.v);
}
RINGLET_KERNEL Pack<float, 16> fnma(Pack<float, 16> a, Pack<float, 16> b, Pack<float, 16> c) {
  return _mm512_fnmadd_ps(a.v, b.v, c.v);
}
RINGLET_KERNEL Pack<double, 8> fnma(Pack<double, 8> a, Pack<double, 8> b, Pack<double, 8> c) {
  return _mm512_fnmadd_pd(a.v, b.v, c.v);
}
RINGLET_KERNEL Pack<float, 16> sqrt(Pack<float, 16> a) { return _mm512_sqrt_ps(a.v); }
RINGLET_KERNEL Pack<double, 8> sqrt(Pack<double, 8> a) { return _mm512_sqrt_pd(a.v); }
inline constexpr int kFloatLanes = 16, kDoubleLanes = 8;
#elif defined(__FMA__)
RINGLET_KERNEL Pack<float, 8> fma(Pack<float, 8> a, Pack<float, 8> b, Pack<float, 8> c) {
  return _mm256_fmadd_ps(a.v, b.v, c.v);
}
RINGLET_KERNEL Pack<double, 4> fma(Pack<double, 4> a, Pack<double, 4> b, Pack<double, 4> c) {
  return _mm256_fmadd_pd(a.v, b.v, c.v);
}
RINGLET_KERNEL Pack<float, 8> fnma(Pack<float, 8> a, Pack<float, 8> b, Pack<float, 8> c) {
  return _mm256_fnmadd_ps(a.v, b.v, c.v);
}
RINGLET_KERNEL Pack<double, 4> fnma(Pack<double, 4> a, Pack<double, 4> b, Pack<double, 4> c) {
  return _mm256_fnmadd_pd(a.v, b.v, c.v);
}
RINGLET_KERNEL Pack<float, 8> sqrt(Pack<float, 8> a) { return _mm256_sqrt_ps(a.v); }
RINGLET_KERNEL Pack<double, 4> sqrt(Pack<double, 4> a) { return _mm256_sqrt_pd(a.v); }
inline constexpr int kFloatLanes = 8, kDoubleLanes = 4;
#else  // no fused multiply-add: the product rounds, so results differ in the last bits from the other sets
template <class T, int W>
RINGLET_KERNEL Pack<T, W> fma(Pack<T, W> a, Pack<T, W> b, Pack<T, W> c) {
  return a.v * b.v + c.v;
}
template <class T, int W>
RINGLET_KERNEL Pack<T, W> fnma(Pack<T, W> a, Pack<T, W> b, Pack<T, W> c) {
  return c.v - a.v * b.v;
}
RINGLET_KERNEL Pack<float, 4> sqrt(Pack<float, 4> a) { return _mm_sqrt_ps(a.v); }
RINGLET_KERNEL Pack<double, 2> sqrt(Pack<double, 2> a) { return _mm_sqrt_pd(a.v); }
inline constexpr int kFloatLanes = 4, kDoubleLanes = 2;
#endif

using FloatPack = Pack<float, kFloatLanes>;
using DoublePack = Pack<double, kDoubleLanes>;

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
