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

// The inverse of a symmetric positive definite block, from its factors L E L^T. By cofactors it would lose
// twice the digits where a block is much stiffer along one direction than across.
template <class V>
RINGLET_KERNEL void invert(const V (&a)[3], V (&to)[3]) {
  const auto e0 = 1 / a[0][0], yx = a[0][1] * e0, zx = a[0][2] * e0;  // L's entries, by row and column
  const auto e1 = 1 / (a[1][1] - yx * a[0][1]), left = a[1][2] - yx * a[0][2], zy = left * e1;
  const auto e2 = 1 / (a[2][2] - zx * a[0][2] - zy * left);
  const auto back = yx * zy - zx;  // of L^-1 the entry that is not one of -L
  const auto xy = -(yx * e1) - back * (zy * e2), xz = back * e2, yz = -(zy * e2);
  to[0] = V{e0 + yx * (yx * e1) + back * (back * e2), xy, xz, 0};
  to[1] = V{xy, e1 + zy * (zy * e2), yz, 0};
  to[2] = V{xz, yz, e2, 0};
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
