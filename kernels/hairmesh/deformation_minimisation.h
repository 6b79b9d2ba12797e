// What collisions moved takes the rest of the mesh along (hair mesh paper, equations 3 and 4): with x the
// positions before and x'' those after, the least
//   sum over edges |(x''_i - x''_j) - (x_i - x_j)|^2
// over all vertices but the corrected ones and the roots. For the displacement u = x'' - x that is A^T A u =
// 0 with u given there, A the edges' incidence matrix: a scalar Laplacian of the mesh, fixed once and for
// all.
#pragma once
#include "kernels/hairmesh/vertex_filter.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// A^T A, applied to each of the three components, split by the mesh's columns as BlockMatrix is: D couples a
// vertex with those above and below, the rest with the same layer of other columns.
template <class T>
class MeshLaplacian {
 public:
  // `degree` counts a column's edges of the scalp; of their other ends `neighbour` holds the later columns.
  MeshLaplacian(std::int32_t columns, std::int32_t layers, std::int32_t first_layer,
                const std::int32_t* degree, const std::int32_t* first, const std::int32_t* neighbour)
      : columns_(columns), layers_(layers), first_layer_(first_layer) {
    const auto count = static_cast<std::size_t>(columns);
    copy_values(degree_, degree, count), copy_values(first_, first, count + 1);
    copy_values(neighbour_, neighbour, static_cast<std::size_t>(first[columns]));
    zero_values(count * static_cast<std::size_t>(layers), inverse_), zero_values(inverse_.size(), below_);
  }

  std::int32_t columns() const { return columns_; }
  std::int32_t first_row(std::int32_t column) const { return column * layers_ + first_layer_; }
  std::int32_t end_row(std::int32_t column) const { return (column + 1) * layers_; }
  std::size_t bytes() const {
    return degree_.bytes() + first_.bytes() + neighbour_.bytes() + inverse_.bytes() + below_.bytes();
  }

  // Factors the columns, with vertices that are wholly prescribed taken out.
  void factor(const VertexFilter<T>& filter) {
    for (std::int32_t c = 0; c < columns_; ++c) {
      bool joined = false;  // to the vertex below
      for (std::int32_t i = first_row(c); i < end_row(c); ++i) {
        const bool free = filter.is_free(i);
        const T below = joined && free ? -inverse_.data()[i - 1] : T(0);
        below_.data()[i] = below;
        inverse_.data()[i] = free ? T(1) / (degree(c, i) + below) : T(1);
        joined = free;
      }
    }
  }
  RINGLET_KERNEL void solve_column(std::int32_t column, const Padded<T>* g, Padded<T>* x) const {
    const std::int32_t begin = first_row(column), end = end_row(column);
    Padded<T> last{};
    for (std::int32_t i = begin; i < end; ++i) {
      last = g[i] - below_.data()[i] * last;
      x[i] = inverse_.data()[i] * last;
    }
    for (std::int32_t i = end - 2; i >= begin; --i) x[i] -= below_.data()[i + 1] * x[i + 1];
  }
  RINGLET_KERNEL void later_columns(std::int32_t column, const Padded<T>* x, Padded<T>* y) const {
    const std::int32_t *begin = neighbour_.data() + first_.data()[column],
                       *end = neighbour_.data() + first_.data()[column + 1];
    for (std::int32_t i = first_row(column); i < end_row(column); ++i) {
      const Padded<T>* beside = x + (i - column * layers_);
      Padded<T> sum{};
      for (const std::int32_t* other = begin; other < end; ++other) sum -= beside[*other * layers_];
      y[i] = sum;
    }
  }
  RINGLET_KERNEL void add_to_later_columns(std::int32_t column, const Padded<T>* x, Padded<T>* to) const {
    const std::int32_t *begin = neighbour_.data() + first_.data()[column],
                       *end = neighbour_.data() + first_.data()[column + 1];
    for (std::int32_t i = first_row(column); i < end_row(column); ++i) {
      Padded<T>* beside = to + (i - column * layers_);
      for (const std::int32_t* other = begin; other < end; ++other) beside[*other * layers_] -= x[i];
    }
  }
  RINGLET_KERNEL void own_column(std::int32_t column, const Padded<T>* x, Padded<T>* y) const {
    const std::int32_t begin = first_row(column), end = end_row(column);
    for (std::int32_t i = begin; i < end; ++i) {
      Padded<T> sum = degree(column, i) * x[i];
      if (i > begin) sum -= x[i - 1];
      if (i + 1 < end) sum -= x[i + 1];
      y[i] += sum;
    }
  }

 private:
  // Edges at a vertex.
  RINGLET_KERNEL T degree(std::int32_t column, std::int32_t row) const {
    const std::int32_t layer = row - column * layers_;
    return static_cast<T>(degree_.data()[column] + (layer > 0 ? 1 : 0) + (layer + 1 < layers_ ? 1 : 0));
  }

  std::int32_t columns_, layers_, first_layer_;
  HostBuffer<std::int32_t> degree_, first_, neighbour_;
  HostBuffer<T> inverse_, below_;  // of a vertex: 1 / E, and N to the one below
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
