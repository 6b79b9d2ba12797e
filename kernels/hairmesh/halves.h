// Eight reals as two halves of four: two padded vertices side by side, or four rows of two columns.
//
// One vector where the processor has registers that wide; else two, since compilers take larger vectors apart
// one by one. What moves reals does so within each half, and works on one padded vertex as well.
#pragma once
#include <type_traits>

#include "kernels/hairmesh/padded_vector.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
struct TwoHalves {
  Padded<T> half[2];

  friend RINGLET_KERNEL TwoHalves operator+(const TwoHalves& a, const TwoHalves& b) {
    return {{a.half[0] + b.half[0], a.half[1] + b.half[1]}};
  }
  friend RINGLET_KERNEL TwoHalves operator-(const TwoHalves& a, const TwoHalves& b) {
    return {{a.half[0] - b.half[0], a.half[1] - b.half[1]}};
  }
  friend RINGLET_KERNEL TwoHalves operator*(const TwoHalves& a, const TwoHalves& b) {
    return {{a.half[0] * b.half[0], a.half[1] * b.half[1]}};
  }
  friend RINGLET_KERNEL TwoHalves operator*(T a, const TwoHalves& b) {
    return {{a * b.half[0], a * b.half[1]}};
  }
  RINGLET_KERNEL TwoHalves& operator+=(const TwoHalves& a) { return *this = *this + a; }
  RINGLET_KERNEL TwoHalves& operator-=(const TwoHalves& a) { return *this = *this - a; }
};

#if defined(__AVX512F__)
inline constexpr std::size_t kWidestVector = 64;
#elif defined(__AVX__)
inline constexpr std::size_t kWidestVector = 32;
#else
inline constexpr std::size_t kWidestVector = 16;
#endif
template <class T>
using Octets = std::conditional_t<8 * sizeof(T) <= kWidestVector, typename Octet<T>::Vector, TwoHalves<T>>;
template <class V>
inline constexpr bool kIsPadded = sizeof(V) == 4 * sizeof(V{}[0]);

template <class T>
RINGLET_KERNEL Octets<T> side_by_side(Padded<T> a, Padded<T> b) {
  if constexpr (std::is_same_v<Octets<T>, TwoHalves<T>>)
    return {{a, b}};
  else
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 4, 5, 6, 7);
}
template <int k, class T>
RINGLET_KERNEL Padded<T> half_of(const Octets<T>& a) {
  if constexpr (std::is_same_v<Octets<T>, TwoHalves<T>>)
    return a.half[k];
  else
    return __builtin_shufflevector(a, a, 4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3);
}

// Of each half: reals 0 to 3 are those of a's, 4 to 7 those of b's.
template <int i, int j, int k, int l, class V>
RINGLET_KERNEL V pick(const V& a, const V& b) {
  if constexpr (kIsPadded<V>) {
    return __builtin_shufflevector(a, b, i, j, k, l);
  } else {
    constexpr auto first = [](int of) { return of < 4 ? of : of + 4; };
    constexpr auto second = [](int of) { return of < 4 ? of + 4 : of + 8; };
    return __builtin_shufflevector(a, b, first(i), first(j), first(k), first(l), second(i), second(j),
                                   second(k), second(l));
  }
}
template <int i, int j, int k, int l, class T>
RINGLET_KERNEL TwoHalves<T> pick(const TwoHalves<T>& a, const TwoHalves<T>& b) {
  return {{pick<i, j, k, l>(a.half[0], b.half[0]), pick<i, j, k, l>(a.half[1], b.half[1])}};
}
// Of each half, real k in all of it.
template <int k, class V>
RINGLET_KERNEL V spread_component(const V& a) {
  return pick<k, k, k, k>(a, a);
}

// A block, by columns, or two side by side: its product with a, and w less that, with as few operations in
// turn as there can be: sweeps wait for them.
template <class V>
RINGLET_KERNEL V block_times(const V* block, const V& a) {
  return block[0] * spread_component<0>(a) + block[1] * spread_component<1>(a) +
         block[2] * spread_component<2>(a);
}
template <class V>
RINGLET_KERNEL V less_block_times(const V& w, const V* block, const V& a) {
  return (w - block[0] * spread_component<0>(a)) -
         (block[1] * spread_component<1>(a) + block[2] * spread_component<2>(a));
}
// The same with the transpose, whose product comes in three terms.
template <class V>
RINGLET_KERNEL void transposed_terms(const V* block, const V& a, V (&term)[3]) {
  const V x = block[0] * a, y = block[1] * a, z = block[2] * a, none{};
  const V low = pick<0, 4, 1, 5>(x, y), high = pick<2, 6, 3, 7>(x, y), last = pick<0, 4, 1, 5>(z, none),
          rest = pick<2, 4, 3, 5>(z, none);
  term[0] = pick<0, 1, 4, 5>(low, last);
  term[1] = pick<2, 3, 6, 7>(low, last);
  term[2] = pick<0, 1, 4, 5>(high, rest);
}
template <class V>
RINGLET_KERNEL V transpose_times(const V* block, const V& a) {
  V term[3];
  transposed_terms(block, a, term);
  return term[0] + term[1] + term[2];
}
template <class V>
RINGLET_KERNEL V less_transpose_times(const V& w, const V* block, const V& a) {
  V term[3];
  transposed_terms(block, a, term);
  return (w - term[0]) - (term[1] + term[2]);
}

// Of each half: its reals moved up by one, the first from the end of `before`'s; down by one, the last from
// the start of `after`'s.
template <class V>
RINGLET_KERNEL V shift_up(const V& before, const V& a) {
  return pick<3, 4, 5, 6>(before, a);
}
template <class V>
RINGLET_KERNEL V shift_down(const V& a, const V& after) {
  return pick<1, 2, 3, 4>(a, after);
}

// Four vertices from their components, and back.
template <class V>
RINGLET_KERNEL void to_vertices(const V* component, V (&vertex)[4]) {
  const V x = component[0], y = component[1], z = component[2], none{};
  const V low = pick<0, 4, 1, 5>(x, y), high = pick<2, 6, 3, 7>(x, y), low_z = pick<0, 4, 1, 5>(z, none),
          high_z = pick<2, 6, 3, 7>(z, none);
  vertex[0] = pick<0, 1, 4, 5>(low, low_z), vertex[1] = pick<2, 3, 6, 7>(low, low_z);
  vertex[2] = pick<0, 1, 4, 5>(high, high_z), vertex[3] = pick<2, 3, 6, 7>(high, high_z);
}
template <class V>
RINGLET_KERNEL void to_components(const V (&vertex)[4], V* component) {
  const V low = pick<0, 4, 1, 5>(vertex[0], vertex[1]), high = pick<0, 4, 1, 5>(vertex[2], vertex[3]);
  component[0] = pick<0, 1, 4, 5>(low, high), component[1] = pick<2, 3, 6, 7>(low, high);
  component[2] =
      pick<0, 1, 4, 5>(pick<2, 6, 3, 7>(vertex[0], vertex[1]), pick<2, 6, 3, 7>(vertex[2], vertex[3]));
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
