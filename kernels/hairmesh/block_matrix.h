// A symmetric matrix of 3 x 3 blocks whose structure is found once and whose values are filled in each step.
//
// Of the mesh's columns, those of the extrusion, it is seen as A = L + D + L^T: D couples vertices of one
// column, two layers at most apart, L^T a column with later ones, one layer at most apart. Blocks of L^T lie
// in bands: those of two neighbouring rows side by side, with what they multiply side by side in memory too.
// A product then needs neither indices nor sums across lanes; one with the transpose takes a few shuffles,
// which cost less than the memory of the lower half. Where a band goes past a column's end its blocks are 0.
#pragma once
#include "kernels/hairmesh/hair_mesh_elements.h"
#include "kernels/hairmesh/vertex_filter.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Where elements add their blocks.
template <class T>
struct BlockSlots {
  T* values;

  // Adds a block, column by column.
  RINGLET_KERNEL void add(std::int32_t slot, Padded<T> x, Padded<T> y, Padded<T> z) const {
    auto* column = reinterpret_cast<Padded<T>*>(values + slot);
    column[0] += x, column[2] += y, column[4] += z;
  }
  // a b^T
  RINGLET_KERNEL void add_outer(std::int32_t slot, Padded<T> a, Padded<T> b) const {
    add(slot, a * spread_component<0>(b), a * spread_component<1>(b), a * spread_component<2>(b));
  }
};

template <class T>
class BlockMatrix {
 public:
  explicit BlockMatrix(const BlockPattern& p)
      : columns_(p.columns), layers_(p.layers), first_layer_(p.first_layer) {
    const auto columns = static_cast<std::size_t>(p.columns),
               rows = columns * static_cast<std::size_t>(p.layers);
    const auto pairs = static_cast<std::size_t>(p.first_pair[columns]);
    copy_values(first_, p.first, 2 * columns + 1), copy_values(first_pair_, p.first_pair, columns + 1);
    copy_values(other_, p.other, static_cast<std::size_t>(p.first[2 * columns]));
    // The last pair takes the blocks of held roots, which nobody reads.
    zero_values((kOwnPairs * rows + pairs + 1) * kPairReals, values_);
    zero_values(12 * rows * kParts, factor_);
  }

  std::int32_t columns() const { return columns_; }
  std::int32_t first_row(std::int32_t column) const { return column * layers_ + first_layer_; }
  std::int32_t end_row(std::int32_t column) const { return (column + 1) * layers_; }
  std::size_t bytes() const {
    return first_.bytes() + first_pair_.bytes() + other_.bytes() + values_.bytes() + factor_.bytes();
  }

  BlockSlots<T> clear() {
    auto* values = reinterpret_cast<Padded<T>*>(values_.data());
    const std::size_t count = values_.size() / 4;
    for (std::size_t i = 0; i < count; ++i) values[i] = Padded<T>{};
    return {values_.data()};
  }
  RINGLET_KERNEL void add_to_diagonal(std::int32_t row, T value) {
    T* block = own(row, 0);
    block[0] += value, block[kBlockColumn + 1] += value, block[2 * kBlockColumn + 2] += value;
  }

  // Factors D, with the filter S on both of its sides, as D = (I + N) E (I + N^T): E block diagonal, N the
  // two blocks below it in each column.
  void factor(const VertexFilter<T>& filter) {
    for (std::int32_t column = 0; column < columns_; ++column) factor_column(column, filter);
  }
  void factor_column(std::int32_t column, const VertexFilter<T>& filter) {
    const std::int32_t begin = first_row(column), end = end_row(column);
    const bool filtered = filter.touches(column);
    Padded<T> once[3]{}, twice[3]{},
        far[3]{};  // blocks (i - 1, i), (i - 1, i + 1) and (i - 2, i) of E (I + N^T)
    for (std::int32_t i = begin; i < end; ++i) {
      Padded<T> self[3], next[3], after[3], up[3];
      load(own(i, 0), self), load(own(i, 1), next), load(own(i, 2), after);
      if (filtered) {
        filter.keep(i, i, self);
        if (i + 1 < end) filter.keep(i, i + 1, next);
        if (i + 2 < end) filter.keep(i, i + 2, after);
      }
      if (i > begin) {
        divide(i - 1, once, up), store(factor_of(i, kOnce), up);
        subtract_product(self, up, once), subtract_product(next, up, twice);
      }
      if (i > begin + 1) {
        divide(i - 2, far, up), store(factor_of(i, kTwice), up);
        subtract_product(self, up, far);
      }
      invert(self, up), store(factor_of(i, kInverse), up);
      for (int k = 0; k < 3; ++k) far[k] = twice[k], once[k] = next[k], twice[k] = after[k];
    }
  }

  // x = D^-1 g in one column, after `factor`.
  RINGLET_KERNEL void solve_column(std::int32_t column, const Padded<T>* g, Padded<T>* x) const {
    const std::int32_t begin = first_row(column), end = end_row(column);
    Padded<T> one{}, two{}, block[3];  // those of the two rows before, or after
    for (std::int32_t i = begin; i < end; ++i) {
      Padded<T> w = g[i];
      if (i > begin + 1) load_packed(factor_of(i, kTwice), block), w = less_transpose_times(w, block, two);
      if (i > begin) load_packed(factor_of(i, kOnce), block), w = less_transpose_times(w, block, one);
      two = one, one = w;
      load_packed(factor_of(i, kInverse), block);
      x[i] = block_times(block, w);
    }
    for (std::int32_t i = end - 1; i >= begin; --i) {
      Padded<T> value = x[i];
      if (i + 2 < end)
        load_packed(factor_of(i + 2, kTwice), block), value = less_block_times(value, block, x[i + 2]);
      if (i + 1 < end)
        load_packed(factor_of(i + 1, kOnce), block), value = less_block_times(value, block, x[i + 1]);
      x[i] = value;
    }
  }

  // y = L^T x in one column. Vectors have room for two vertices beyond the last.
  RINGLET_KERNEL void later_columns(std::int32_t column, const Padded<T>* x, Padded<T>* y) const {
    const Bands bands = bands_of(column);
    const Octets* block = bands.blocks;
    std::int32_t i = first_row(column);
    for (; i + 2 < end_row(column); i += 4) block = later_rows<2>(column, bands, block, i, x, y);
    if (i < end_row(column)) later_rows<1>(column, bands, block, i, x, y);
  }
  // to += what one column of x adds to L x
  RINGLET_KERNEL void add_to_later_columns(std::int32_t column, const Padded<T>* x, Padded<T>* to) const {
    const Bands bands = bands_of(column);
    const Octets* block = bands.blocks;
    std::int32_t i = first_row(column);
    for (; i + 2 < end_row(column); i += 4) block = add_rows<2>(column, bands, block, i, x, to);
    if (i < end_row(column)) add_rows<1>(column, bands, block, i, x, to);
  }
  // y += D x in one column, without the filter
  RINGLET_KERNEL void own_column(std::int32_t column, const Padded<T>* x, Padded<T>* y) const {
    const std::int32_t begin = first_row(column), end = end_row(column);
    for (std::int32_t i = begin; i < end; ++i) {
      Padded<T> block[3], sum{};
      for (std::int32_t k = 0; k < 3 && i + k < end; ++k)
        load(own(i, k), block), sum += block_times(block, x[i + k]);
      for (std::int32_t k = 1; k < 3 && i - k >= begin; ++k)
        load(own(i - k, k), block), sum += transpose_times(block, x[i - k]);
      y[i] += sum;
    }
  }

 private:
  enum Part { kInverse, kOnce, kTwice, kParts };  // of a factor: E^-1, and the row's blocks of N, transposed

  using Octets = typename Octet<T>::Vector;

  // A column's bands with later ones.
  struct Bands {
    const std::int32_t *sloping, *level, *end;
    const Octets* blocks;  // for each four rows, and what is left of them, those of all bands
  };
  RINGLET_KERNEL Bands bands_of(std::int32_t column) const {
    const std::int32_t* first = first_.data() + 2 * std::int64_t{column};
    const std::int64_t own_pairs = std::int64_t{columns_} * layers_ * kOwnPairs;
    return {other_.data() + first[0], other_.data() + first[1], other_.data() + first[2],
            reinterpret_cast<const Octets*>(values_.data() +
                                            (own_pairs + first_pair_.data()[column]) * kPairReals)};
  }
  // Rows from i of the products, so many pairs of them together; return the blocks of those after.
  template <int kPairs>
  RINGLET_KERNEL const Octets* later_rows(std::int32_t column, const Bands& bands, const Octets* block,
                                          std::int32_t i, const Padded<T>* x, Padded<T>* y) const {
    const Padded<T>* beside = x + (i - column * layers_);
    Octets a[kPairs]{}, b[kPairs]{}, c[kPairs]{};
    const auto add = [&](const Padded<T>* from) {
      for (int k = 0; k < kPairs; ++k, block += 3) {
        const Octets v = load_two(from + 2 * k);
        a[k] += block[0] * spread_halves<0>(v);
        b[k] += block[1] * spread_halves<1>(v);
        c[k] += block[2] * spread_halves<2>(v);
      }
    };
    for (const std::int32_t* other = bands.sloping; other < bands.level; ++other) {
      const Padded<T>* from = beside + *other * layers_;
      add(from - 1), add(from), add(from + 1);
    }
    for (const std::int32_t* other = bands.level; other < bands.end; ++other) add(beside + *other * layers_);
    for (int k = 0; k < kPairs; ++k) {
      const Octets sum = a[k] + b[k] + c[k];
      y[i + 2 * k] = first_half<T>(sum);
      if (k + 1 < kPairs || i + 2 * k + 1 < end_row(column)) y[i + 2 * k + 1] = second_half<T>(sum);
    }
    return block;
  }
  template <int kPairs>
  RINGLET_KERNEL const Octets* add_rows(std::int32_t column, const Bands& bands, const Octets* block,
                                        std::int32_t i, const Padded<T>* x, Padded<T>* to) const {
    Padded<T>* beside = to + (i - column * layers_);
    Octets v[kPairs];
    for (int k = 0; k < kPairs; ++k) v[k] = load_two(x + i + 2 * k);
    const auto product = [&](int k, int band) {
      const Octets* at = block + 3 * (kPairs * band + k);
      return transposes_times(at[0], at[1], at[2], v[k]);
    };
    for (const std::int32_t* other = bands.sloping; other < bands.level;
         ++other, block += 3 * kPairs * kSlopes) {
      Padded<T>* at = beside + *other * layers_;
      for (int k = 0; k < kPairs; ++k, at += 2) {
        const Octets down = product(k, 0), level = product(k, 1), up = product(k, 2);
        at[-1] += first_half<T>(down);
        at[0] += second_half<T>(down) + first_half<T>(level);
        at[1] += second_half<T>(level) + first_half<T>(up);
        at[2] += second_half<T>(up);
      }
    }
    for (const std::int32_t* other = bands.level; other < bands.end; ++other, block += 3 * kPairs) {
      Padded<T>* at = beside + *other * layers_;
      for (int k = 0; k < kPairs; ++k, at += 2) {
        const Octets level = product(k, 0);
        at[0] += first_half<T>(level), at[1] += second_half<T>(level);
      }
    }
    return block;
  }
  // Not aligned to two.
  static RINGLET_KERNEL Octets load_two(const Padded<T>* a) { return side_by_side<T>(a[0], a[1]); }

  T* own(std::int32_t row, std::int32_t above) const {
    return values_.data() + std::int64_t{row} * (kOwnPairs * kPairReals) + kOwnBlock[above];
  }
  RINGLET_KERNEL Padded<T>* factor_of(std::int32_t row, Part part) const {
    return reinterpret_cast<Padded<T>*>(factor_.data()) + 3 * (std::int64_t{row} * kParts + part);
  }
  static RINGLET_KERNEL void load(const T* block, Padded<T> (&columns)[3]) {
    const auto* column = reinterpret_cast<const Padded<T>*>(block);
    columns[0] = column[0], columns[1] = column[2], columns[2] = column[4];
  }
  static RINGLET_KERNEL void load_packed(const Padded<T>* block, Padded<T> (&columns)[3]) {
    columns[0] = block[0], columns[1] = block[1], columns[2] = block[2];
  }
  static RINGLET_KERNEL void store(Padded<T>* to, const Padded<T> (&columns)[3]) {
    to[0] = columns[0], to[1] = columns[1], to[2] = columns[2];
  }
  // quotient = E_row^-1 a
  RINGLET_KERNEL void divide(std::int32_t row, const Padded<T> (&a)[3], Padded<T> (&quotient)[3]) const {
    Padded<T> inverse[3];
    load_packed(factor_of(row, kInverse), inverse);
    for (int k = 0; k < 3; ++k) quotient[k] = block_times(inverse, a[k]);
  }
  // from -= a^T b
  static RINGLET_KERNEL void subtract_product(Padded<T> (&from)[3], const Padded<T> (&a)[3],
                                              const Padded<T> (&b)[3]) {
    for (int k = 0; k < 3; ++k) from[k] -= transpose_times(a, b[k]);
  }

  std::int32_t columns_, layers_, first_layer_;
  HostBuffer<std::int32_t> first_, first_pair_, other_;
  HostBuffer<T> values_, factor_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
