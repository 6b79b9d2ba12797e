// What is prescribed of a solve's unknowns (Baraff and Witkin 1998, section 5.2): nothing of a vertex, one
// direction, or all of it. S takes what is prescribed out of a vertex's value.
#pragma once
#include "kernels/hairmesh/halves.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
class VertexFilter {
 public:
  VertexFilter(std::int32_t columns, std::int32_t layers) : layers_(layers) {
    const auto vertices = static_cast<std::size_t>(columns) * static_cast<std::size_t>(layers);
    zero_values(vertices, kind_), zero_values(4 * vertices, normal_);
    zero_values(static_cast<std::size_t>(columns), in_column_);
    listed_.resize(vertices);
  }

  std::size_t bytes() const { return kind_.bytes() + in_column_.bytes() + normal_.bytes() + listed_.bytes(); }

  void clear() {
    for (std::int32_t k = 0; k < count_; ++k) {
      const std::int32_t i = listed_.data()[k];
      kind_.data()[i] = kFree, in_column_.data()[i / layers_] = 0;
    }
    count_ = 0;
  }
  void prescribe_along(std::int32_t vertex, Padded<T> normal) { prescribe(vertex, kAlong, normal); }
  void prescribe_wholly(std::int32_t vertex) { prescribe(vertex, kWholly, Padded<T>{}); }

  // Whether anything of a column is prescribed.
  RINGLET_KERNEL bool touches(std::int32_t column) const { return in_column_.data()[column] != 0; }
  RINGLET_KERNEL bool is_free(std::int32_t vertex) const { return kind_.data()[vertex] == kFree; }

  // S a
  RINGLET_KERNEL Padded<T> keep(std::int32_t vertex, Padded<T> a) const {
    if (is_free(vertex)) return a;
    if (kind_.data()[vertex] == kWholly) return Padded<T>{};
    const Padded<T> n = normal(vertex);
    return a - dot_product(n, a) * n;
  }
  // S A S' for the block of two vertices, and I - S added to that of a vertex with itself: the solve then
  // leaves 0 for what is prescribed.
  RINGLET_KERNEL void keep(std::int32_t row, std::int32_t column, Padded<T> (&block)[3]) const {
    if (!is_free(column)) {
      // Rows of a block are the columns of its transpose: S' = (I - n n^T) from the right takes (A n) n^T
      // away.
      if (kind_.data()[column] == kWholly) {
        block[0] = block[1] = block[2] = Padded<T>{};
      } else {
        const Padded<T> n = normal(column), along = block_times(block, n);
        block[0] -= along * spread_component<0>(n), block[1] -= along * spread_component<1>(n);
        block[2] -= along * spread_component<2>(n);
      }
    }
    for (Padded<T>& b : block) b = keep(row, b);
    if (row != column || is_free(row)) return;
    if (kind_.data()[row] == kWholly) {
      for (int k = 0; k < 3; ++k) block[k][k] = T(1);
      return;
    }
    // As large as the block it stands in.
    const Padded<T> n = normal(row);
    const T size = block[0][0] + block[1][1] + block[2][2];
    block[0] += (size * n[0]) * n, block[1] += (size * n[1]) * n, block[2] += (size * n[2]) * n;
  }

 private:
  enum Kind : char { kFree, kAlong, kWholly };

  RINGLET_KERNEL Padded<T> normal(std::int32_t vertex) const {
    return reinterpret_cast<const Padded<T>*>(normal_.data())[vertex];
  }
  void prescribe(std::int32_t vertex, Kind kind, Padded<T> normal) {
    if (is_free(vertex)) listed_.data()[count_++] = vertex;
    kind_.data()[vertex] = kind, in_column_.data()[vertex / layers_] = 1;
    reinterpret_cast<Padded<T>*>(normal_.data())[vertex] = normal;
  }

  std::int32_t layers_, count_ = 0;
  HostBuffer<char> kind_, in_column_;
  HostBuffer<T> normal_;
  HostBuffer<std::int32_t> listed_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
