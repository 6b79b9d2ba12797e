// How sweeps over a hair mesh see its vertices: columns two by two, four rows at once.
//
// Of a pair's columns, and of each four rows, the x of the first column's rows and then of the second's stand
// side by side in eight lanes, then the y, then the z. Products with bands of blocks then run over all lanes
// alike, without shuffles. Lanes past a column's end hold 0, and so do those of a column that is not there.
#pragma once
#include "kernels/hairmesh/hair_mesh_elements.h"
#include "kernels/hairmesh/halves.h"
#include "kernels/hairmesh/vertex_filter.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr std::int32_t kOctet = 8;
// Where lanes of a pair's second column begin, and reals of four rows of the pair.
inline constexpr std::int32_t kSecondHalf = 4, kFourReals = 3 * kOctet;

template <class T>
RINGLET_KERNEL Padded<T> four_at(const T* lanes) {
  return *reinterpret_cast<const Padded<T>*>(lanes);
}

// Which lanes are whose.
template <class T>
class PairLanes {
 public:
  PairLanes(std::int32_t columns, std::int32_t layers, std::int32_t first_layer, MeshArray<ColumnPair> pairs)
      : columns_(columns), layers_(layers), first_layer_(first_layer) {
    copy_values(pairs_, pairs.data, static_cast<std::size_t>(pairs.count));
    place_.resize(static_cast<std::size_t>(columns) + 1);
    for (std::int32_t k = 0; k < pairs.count; ++k)
      for (int half = 0; half < 2; ++half) place_.data()[pairs.data[k].column[half]] = 2 * k + half;
    place_.data()[columns] = 2 * pairs.count;  // whose lanes are those after the last pair's
  }

  std::size_t bytes() const { return pairs_.bytes() + place_.bytes(); }
  std::int32_t columns() const { return columns_; }
  std::int32_t pairs() const { return static_cast<std::int32_t>(pairs_.size()); }
  const ColumnPair& pair(std::int32_t k) const { return pairs_.data()[k]; }
  bool is_column(std::int32_t c) const { return c < columns_; }
  std::int32_t place(std::int32_t column) const { return place_.data()[column]; }
  std::int32_t first_layer() const { return first_layer_; }  // that has a row
  std::int32_t rows() const { return layers_ - first_layer_; }
  std::int32_t fours() const { return (rows() + 3) / 4; }
  std::int32_t first_vertex(std::int32_t column) const { return column * layers_ + first_layer_; }
  std::int32_t column_of(std::int32_t vertex) const { return vertex / layers_; }
  // Below 0 for a root that is held.
  std::int32_t row_of(std::int32_t vertex) const { return vertex % layers_ - first_layer_; }

  // Octets of a pair, and reals of a vector.
  std::int32_t octets() const { return 3 * fours(); }
  std::size_t reals() const {
    return static_cast<std::size_t>(pairs() + 1) * static_cast<std::size_t>(fours() * kFourReals);
  }
  std::int32_t first_octet(std::int32_t pair) const { return pair * octets(); }
  // Where a column's first row lies, and from there another row.
  std::int32_t offset(std::int32_t column) const {
    return place(column) / 2 * fours() * kFourReals + place(column) % 2 * kSecondHalf;
  }
  std::int32_t offset_of(std::int32_t vertex) const {
    return offset(column_of(vertex)) + row_offset(row_of(vertex));
  }
  static std::int32_t row_offset(std::int32_t row) { return row / 4 * kFourReals + row % 4; }

  static Padded<T> get(const T* at) { return Padded<T>{at[0], at[kOctet], at[2 * kOctet], 0}; }
  static void put(T* at, Padded<T> a) { at[0] = a[0], at[kOctet] = a[1], at[2 * kOctet] = a[2]; }
  // Calls f(vertex, where its x lies).
  template <class F>
  void for_vertices(const F& f) const {
    for (std::int32_t c = 0; c < columns_; ++c) for_vertices(c, f);
  }
  template <class F>
  void for_vertices(std::int32_t column, const F& f) const {
    const std::int32_t first = first_vertex(column), from = offset(column);
    for (std::int32_t row = 0; row < rows(); ++row) f(first + row, from + row_offset(row));
  }
  // Goes over a pair's rows upwards, calling f(row, its two vertices side by side).
  template <class F>
  RINGLET_KERNEL void read_rows(const Octets<T>* lanes, const F& f) const {
    const std::int32_t rows = this->rows();
    for (std::int32_t first = 0; first < rows; first += 4, lanes += 3) {
      Octets<T> vertex[4];
      to_vertices(lanes, vertex);
      for (std::int32_t k = 0; k < 4 && first + k < rows; ++k) f(first + k, vertex[k]);
    }
  }
  // And downwards, taking the two vertices from f(row).
  template <class F>
  RINGLET_KERNEL void write_rows(Octets<T>* lanes, const F& f) const {
    const std::int32_t rows = this->rows();
    lanes += octets();
    for (std::int32_t first = 4 * fours() - 4; first >= 0; first -= 4) {
      Octets<T> vertex[4]{};
      for (std::int32_t k = 3; k >= 0; --k)
        if (first + k < rows) vertex[k] = f(first + k);
      to_components(vertex, lanes -= 3);
    }
  }
  // S a in a pair
  void keep(const VertexFilter<T>& filter, std::int32_t k, T* lanes) const {
    for (const std::int32_t c : pair(k).column)
      if (is_column(c) && filter.touches(c))
        for_vertices(
            c, [&](std::int32_t v, std::int32_t at) { put(lanes + at, filter.keep(v, get(lanes + at))); });
  }

 private:
  std::int32_t columns_, layers_, first_layer_;
  HostBuffer<ColumnPair> pairs_;
  HostBuffer<std::int32_t> place_;  // [columns + 1] 2 * pair + which of it
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
