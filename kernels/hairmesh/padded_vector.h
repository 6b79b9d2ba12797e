// Three components padded to four, in one vector of the compiler's: a vertex's position, velocity or force.
//
// The fourth is 0. Products and sums are rounded one by one, and sums over vertices are taken lane by lane:
// all instruction sets give the same bits.
#pragma once
#include <cstdint>

#include "kernels/backend/host.h"
#include "kernels/backend/octet.h"
#include "kernels/backend/real.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Buffers made of a copy, and of zeros.
template <class T>
RINGLET_FUNCTION void copy_values(HostBuffer<T>& to, const T* from, std::size_t count) {
  to.resize(count);
  for (std::size_t i = 0; i < count; ++i) to.data()[i] = from[i];
}

template <class T, class... More>
RINGLET_FUNCTION void zero_values(std::size_t count, HostBuffer<T>& buffer, More&... more) {
  buffer.resize(count);
  for (std::size_t i = 0; i < count; ++i) buffer.data()[i] = 0;
  if constexpr (sizeof...(more) > 0) zero_values(count, more...);
}

template <class T>
struct PaddedOf {
  typedef T Type __attribute__((vector_size(4 * sizeof(T))));
};
template <class T>
using Padded = typename PaddedOf<T>::Type;

template <class T>
RINGLET_KERNEL Padded<T> padded(const T* three) {
  return Padded<T>{three[0], three[1], three[2], 0};
}
template <class T>
RINGLET_KERNEL void store_three(T* to, Padded<T> a) {
  to[0] = a[0], to[1] = a[1], to[2] = a[2];
}

template <class V>
RINGLET_KERNEL V cross_product(V a, V b) {
  const V turned =
      a * __builtin_shufflevector(b, b, 1, 2, 0, 3) - __builtin_shufflevector(a, a, 1, 2, 0, 3) * b;
  return __builtin_shufflevector(turned, turned, 1, 2, 0, 3);
}
template <class V>
RINGLET_KERNEL auto dot_product(V a, V b) {
  const V products = a * b;
  return products[0] + products[1] + products[2];
}

// The inverse of a symmetric positive definite block.
template <class V>
RINGLET_KERNEL void invert(const V (&a)[3], V (&to)[3]) {
  const V x = cross_product(a[1], a[2]);
  const V scale = 1 / dot_product(a[0], x) - V{};
  to[0] = scale * x, to[1] = scale * cross_product(a[2], a[0]), to[2] = scale * cross_product(a[0], a[1]);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
