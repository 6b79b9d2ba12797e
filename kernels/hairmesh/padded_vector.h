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

// Component k in every lane.
template <int k, class V>
RINGLET_KERNEL V spread_component(V a) {
  return __builtin_shufflevector(a, a, k, k, k, k);
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

// A block, by columns: its product with a, and that of its transpose.
template <class V>
RINGLET_KERNEL V block_times(const V (&block)[3], V a) {
  return block[0] * spread_component<0>(a) + block[1] * spread_component<1>(a) +
         block[2] * spread_component<2>(a);
}
template <class V>
RINGLET_KERNEL V transpose_times(const V (&block)[3], V a) {
  const V x = block[0] * a, y = block[1] * a, z = block[2] * a, none{};
  const V low = __builtin_shufflevector(x, y, 0, 4, 1, 5), high = __builtin_shufflevector(x, y, 2, 6, 3, 7),
          last = __builtin_shufflevector(z, none, 0, 4, 1, 5),
          rest = __builtin_shufflevector(z, none, 2, 4, 3, 5);
  return __builtin_shufflevector(low, last, 0, 1, 4, 5) + __builtin_shufflevector(low, last, 2, 3, 6, 7) +
         __builtin_shufflevector(high, rest, 0, 1, 4, 5);
}
// The inverse of a symmetric positive definite block.
template <class V>
RINGLET_KERNEL void invert(const V (&a)[3], V (&to)[3]) {
  const V x = cross_product(a[1], a[2]);
  const V scale = 1 / dot_product(a[0], x) - V{};
  to[0] = scale * x, to[1] = scale * cross_product(a[2], a[0]), to[2] = scale * cross_product(a[0], a[1]);
}

template <class T>
using Octets = typename Octet<T>::Vector;

// Two vertices side by side.
template <class T>
RINGLET_KERNEL Octets<T> side_by_side(Padded<T> a, Padded<T> b) {
  return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}
// Component k of each half in all of that half.
template <int k, class V>
RINGLET_KERNEL V spread_halves(V a) {
  return __builtin_shufflevector(a, a, k, k, k, k, k + 4, k + 4, k + 4, k + 4);
}
// Of two blocks side by side, by columns: their products with two vectors, and w less those, with as few
// operations in turn as there can be: sweeps wait for them.
template <class V>
RINGLET_KERNEL V blocks_times(const V* block, V a) {
  return block[0] * spread_halves<0>(a) + block[1] * spread_halves<1>(a) + block[2] * spread_halves<2>(a);
}
template <class V>
RINGLET_KERNEL V less_blocks_times(V w, const V* block, V a) {
  return (w - block[0] * spread_halves<0>(a)) -
         (block[1] * spread_halves<1>(a) + block[2] * spread_halves<2>(a));
}
// The same with the blocks' transposes, whose products come in three terms.
template <class V>
RINGLET_KERNEL void transposed_terms(const V* block, V a, V (&term)[3]) {
  const V x = block[0] * a, y = block[1] * a, z = block[2] * a, none{};
  const V low = __builtin_shufflevector(x, y, 0, 8, 1, 9, 4, 12, 5, 13),
          high = __builtin_shufflevector(x, y, 2, 10, 3, 11, 6, 14, 7, 15),
          last = __builtin_shufflevector(z, none, 0, 8, 1, 9, 4, 12, 5, 13),
          rest = __builtin_shufflevector(z, none, 2, 8, 3, 9, 6, 12, 7, 13);
  term[0] = __builtin_shufflevector(low, last, 0, 1, 8, 9, 4, 5, 12, 13);
  term[1] = __builtin_shufflevector(low, last, 2, 3, 10, 11, 6, 7, 14, 15);
  term[2] = __builtin_shufflevector(high, rest, 0, 1, 8, 9, 4, 5, 12, 13);
}
template <class V>
RINGLET_KERNEL V transposes_times(const V* block, V a) {
  V term[3];
  transposed_terms(block, a, term);
  return term[0] + term[1] + term[2];
}
template <class V>
RINGLET_KERNEL V less_transposes_times(V w, const V* block, V a) {
  V term[3];
  transposed_terms(block, a, term);
  return (w - term[0]) - (term[1] + term[2]);
}
template <class T>
RINGLET_KERNEL Padded<T> first_half(Octets<T> a) {
  return __builtin_shufflevector(a, a, 0, 1, 2, 3);
}
template <class T>
RINGLET_KERNEL Padded<T> second_half(Octets<T> a) {
  return __builtin_shufflevector(a, a, 4, 5, 6, 7);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
