// A symmetric matrix of 3 x 3 blocks whose structure is found once and whose values are filled in each step.
//
// Of the mesh's columns, those of the extrusion, it is seen as A = L + D + L^T: D couples vertices of one
// column, two layers at most apart, L^T a column with later ones, one layer at most apart. Columns go in
// pairs that are not coupled (pair_lanes.h). Blocks of L^T lie in bands, one for each difference of layers
// between a column and one of the later ones that it is coupled with; side by side with it, one for the other
// column of the pair. Where there is nothing to couple, blocks are 0.
//
// Elements add to blocks as they are; `finish` puts the bands' into lanes, by the row of the later column,
// for products without shuffles.
#pragma once
#include "kernels/hairmesh/pair_lanes.h"

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
  BlockMatrix(const BlockPattern& p, const PairLanes<T>& lanes) : lanes_(lanes) {
    const auto pairs = static_cast<std::size_t>(p.pairs.count),
               rows = pairs * static_cast<std::size_t>(lanes.rows()),
               fours = static_cast<std::size_t>(lanes.fours());
    copy_values(first_, p.first, 2 * pairs + 1), copy_values(first_band_, p.first_band, pairs + 1);
    offset_.resize(2 * static_cast<std::size_t>(p.first[2 * pairs]));
    for (std::size_t k = 0; k < offset_.size(); ++k)
      offset_.data()[k] = lanes.offset(p.other[k / 2].column[k % 2]);
    zero_values(static_cast<std::size_t>(p.blocks) * kPairReals, values_);
    zero_values(kPairReals * kParts * rows, factor_);
    zero_values(kBandReals * fours * static_cast<std::size_t>(p.first_band[pairs]), band_lanes_);
    zero_values(4 * kOctet * fours, solved_, products_);
  }

  std::size_t bytes() const {
    return first_.bytes() + first_band_.bytes() + offset_.bytes() + values_.bytes() + factor_.bytes() +
           band_lanes_.bytes() + solved_.bytes() + products_.bytes();
  }

  BlockSlots<T> clear() {
    auto* values = reinterpret_cast<Padded<T>*>(values_.data());
    const std::size_t count = values_.size() / 4;
    for (std::size_t i = 0; i < count; ++i) values[i] = Padded<T>{};
    return {values_.data()};
  }
  void add_to_diagonal(std::int32_t vertex, T value) {
    const std::int32_t row = lanes_.row_of(vertex);
    if (row < 0) return;
    T* block = own(lanes_.place(lanes_.column_of(vertex)), row, 0);
    block[0] += value, block[kBlockColumn + 1] += value, block[2 * kBlockColumn + 2] += value;
  }

  // After all elements have added their blocks: puts those of bands into lanes.
  void finish() {
    const auto* blocks = reinterpret_cast<const Octets<T>*>(own(2 * lanes_.pairs(), 0, 0));
    auto* lanes = reinterpret_cast<Octets<T>*>(band_lanes_.data());
    const std::int32_t bands = first_band_.data()[lanes_.pairs()] * lanes_.fours();
    for (std::int32_t k = 0; k < bands; ++k, blocks += 12)
      for (int c = 0; c < 3; ++c, lanes += 3) {
        const Octets<T> rows[4] = {blocks[c], blocks[3 + c], blocks[6 + c], blocks[9 + c]};
        to_components(rows, lanes);
      }
  }

  // Factors D, with the filter S on both of its sides, as D = (I + N) E (I + N^T): E block diagonal, N the
  // two blocks below it in each column.
  void factor(const VertexFilter<T>& filter) {
    for (std::int32_t c = 0; c < lanes_.columns(); ++c) factor_column(c, filter);
  }
  void factor_column(std::int32_t column, const VertexFilter<T>& filter) {
    const std::int32_t place = lanes_.place(column), end = lanes_.rows(), first = lanes_.first_vertex(column);
    const bool filtered = filter.touches(column);
    Padded<T> once[3]{}, twice[3]{},
        far[3]{};  // blocks (i - 1, i), (i - 1, i + 1) and (i - 2, i) of E (I + N^T)
    for (std::int32_t i = 0; i < end; ++i) {
      Padded<T> self[3], next[3], after[3], up[3];
      load(own(place, i, 0), self), load(own(place, i, 1), next), load(own(place, i, 2), after);
      if (filtered) {
        filter.keep(first + i, first + i, self);
        if (i + 1 < end) filter.keep(first + i, first + i + 1, next);
        if (i + 2 < end) filter.keep(first + i, first + i + 2, after);
      }
      if (i > 0) {
        divide(factor_of(place, i - 1, kInverse), once, up), store(factor_of(place, i, kOnce), up);
        subtract_product(self, up, once), subtract_product(next, up, twice);
      }
      if (i > 1) {
        divide(factor_of(place, i - 2, kInverse), far, up), store(factor_of(place, i, kTwice), up);
        subtract_product(self, up, far);
      }
      invert(self, up), store(factor_of(place, i, kInverse), up);
      for (int k = 0; k < 3; ++k) far[k] = twice[k], once[k] = next[k], twice[k] = after[k];
    }
  }

  // x = D^-1 g in a pair, after `factor`.
  RINGLET_KERNEL void solve(std::int32_t pair, const Octets<T>* g, Octets<T>* x) const {
    const std::int32_t rows = lanes_.rows();
    const Octets<T>* blocks =
        reinterpret_cast<const Octets<T>*>(factor_.data()) + std::int64_t{pair} * rows * kRowOctets;
    auto* solved = reinterpret_cast<Octets<T>*>(solved_.data());
    Octets<T> one{}, two{};  // those of the two rows before, or after
    lanes_.read_rows(g, [&](std::int32_t i, Octets<T> w) {
      const Octets<T>* block = blocks + i * kRowOctets;
      if (i > 1) w = less_transpose_times(w, block + 3 * kTwice, two);
      if (i > 0) w = less_transpose_times(w, block + 3 * kOnce, one);
      two = one, one = w;
      solved[i] = block_times(block + 3 * kInverse, w);
    });
    lanes_.write_rows(x, [&](std::int32_t i) {
      const Octets<T>* block = blocks + i * kRowOctets;
      Octets<T> value = solved[i];
      if (i + 2 < rows) value = less_block_times(value, block + 2 * kRowOctets + 3 * kTwice, two);
      if (i + 1 < rows) value = less_block_times(value, block + kRowOctets + 3 * kOnce, one);
      two = one, one = value;
      return value;
    });
  }

  // y = L^T x in a pair
  RINGLET_KERNEL void later(std::int32_t pair, const T* x, Octets<T>* y) const {
    const Bands bands = bands_of(pair);
    const Octets<T>* block = bands.blocks;
    Octets<T> before[3]{};  // of the last four rows, what goes to rows above
    const Octets<T> none{};
    for (std::int32_t four = 0; four < lanes_.fours(); ++four, x += kFourReals, y += 3) {
      Octets<T> down[3]{}, level[3]{}, up[3]{};
      for (const std::int32_t* other = bands.sloping; other < bands.level; other += 2, block += 27) {
        const Octets<T> from[3] = {two_at(x, other, 0), two_at(x, other, 1), two_at(x, other, 2)};
        add_product(block, from, down), add_product(block + 9, from, level),
            add_product(block + 18, from, up);
      }
      for (const std::int32_t* other = bands.level; other < bands.end; other += 2, block += 9) {
        const Octets<T> from[3] = {two_at(x, other, 0), two_at(x, other, 1), two_at(x, other, 2)};
        add_product(block, from, level);
      }
      for (int c = 0; c < 3; ++c) {
        y[c] = level[c] + (shift_up(before[c], down[c]) + shift_down(up[c], none));
        if (four > 0) y[c - 3] += shift_down(none, up[c]);
        before[c] = down[c];
      }
    }
  }
  // to += what a pair of x adds to L x
  RINGLET_KERNEL void add_to_later(std::int32_t pair, const Octets<T>* x, T* to) const {
    const Bands bands = bands_of(pair);
    const Octets<T>* block = bands.blocks;
    const std::int32_t fours = lanes_.fours();
    const Octets<T> none{};
    for (std::int32_t four = 0; four < fours; ++four, x += 3, to += kFourReals) {
      Octets<T> below[3], level[3], above[3];  // of the row that a lane stands for
      for (int c = 0; c < 3; ++c) {
        level[c] = x[c];
        below[c] = shift_up(four > 0 ? x[c - 3] : none, x[c]);
        above[c] = shift_down(x[c], four + 1 < fours ? x[c + 3] : none);
      }
      for (const std::int32_t* other = bands.sloping; other < bands.level; other += 2, block += 27)
        for (int c = 0; c < 3; ++c)
          add_two(to, other, c,
                  transposed_product(block + 3 * c, above) + transposed_product(block + 9 + 3 * c, level) +
                      transposed_product(block + 18 + 3 * c, below));
      for (const std::int32_t* other = bands.level; other < bands.end; other += 2, block += 9)
        for (int c = 0; c < 3; ++c) add_two(to, other, c, transposed_product(block + 3 * c, level));
    }
  }
  // y += D x in a pair, without the filter
  RINGLET_KERNEL void add_own(std::int32_t pair, const Octets<T>* x, Octets<T>* y) const {
    const std::int32_t rows = lanes_.rows();
    const auto* blocks = reinterpret_cast<const Octets<T>*>(own(2 * pair, 0, 0));
    const auto block = [&](std::int32_t row, std::int32_t above) {
      return blocks + 3 * (kOwnBlocks * row + above);
    };
    auto* sums = reinterpret_cast<Octets<T>*>(solved_.data());
    Octets<T> one{}, two{};
    for (std::int32_t i = 0; i < rows; ++i) sums[i] = Octets<T>{};
    lanes_.read_rows(x, [&](std::int32_t i, Octets<T> a) {
      sums[i] += block_times(block(i, 0), a);
      if (i > 0)
        sums[i - 1] += block_times(block(i - 1, 1), a), sums[i] += transpose_times(block(i - 1, 1), one);
      if (i > 1)
        sums[i - 2] += block_times(block(i - 2, 2), a), sums[i] += transpose_times(block(i - 2, 2), two);
      two = one, one = a;
    });
    auto* products = reinterpret_cast<Octets<T>*>(products_.data());
    lanes_.write_rows(products, [&](std::int32_t i) { return sums[i]; });
    for (std::int32_t k = 0; k < lanes_.octets(); ++k) y[k] += products[k];
  }

 private:
  enum Part { kInverse, kOnce, kTwice, kParts };  // of a factor: E^-1, and the row's blocks of N, transposed
  static constexpr std::int32_t kRowOctets = 3 * kParts;
  static constexpr std::int32_t kBandReals = 9 * kOctet;  // of four rows

  // A pair's bands with later columns: where those begin, and for each four rows the blocks of all bands.
  struct Bands {
    const std::int32_t *sloping, *level, *end;
    const Octets<T>* blocks;
  };
  RINGLET_KERNEL Bands bands_of(std::int32_t pair) const {
    const std::int32_t* first = first_.data() + 2 * pair;
    return {offset_.data() + 2 * first[0], offset_.data() + 2 * first[1], offset_.data() + 2 * first[2],
            reinterpret_cast<const Octets<T>*>(band_lanes_.data()) +
                std::int64_t{first_band_.data()[pair]} * (kBandReals / kOctet * lanes_.fours())};
  }
  static RINGLET_KERNEL Octets<T> two_at(const T* x, const std::int32_t* other, int c) {
    return side_by_side<T>(four_at(x + other[0] + kOctet * c), four_at(x + other[1] + kOctet * c));
  }
  // One after the other: both may be the same column.
  static RINGLET_KERNEL void add_two(T* to, const std::int32_t* other, int c, Octets<T> a) {
    *reinterpret_cast<Padded<T>*>(to + other[0] + kOctet * c) += half_of<0, T>(a);
    *reinterpret_cast<Padded<T>*>(to + other[1] + kOctet * c) += half_of<1, T>(a);
  }
  static RINGLET_KERNEL void add_product(const Octets<T>* block, const Octets<T> (&x)[3], Octets<T> (&y)[3]) {
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) y[r] += block[3 * c + r] * x[c];
  }
  static RINGLET_KERNEL Octets<T> transposed_product(const Octets<T>* column, const Octets<T> (&x)[3]) {
    return column[0] * x[0] + column[1] * x[1] + column[2] * x[2];
  }
  T* own(std::int32_t place, std::int32_t row, std::int32_t above) const {
    return values_.data() +
           ((std::int64_t{place / 2} * lanes_.rows() + row) * kOwnBlocks + above) * kPairReals +
           place % 2 * kSecondBlock;
  }
  T* factor_of(std::int32_t place, std::int32_t row, Part part) const {
    return factor_.data() + ((std::int64_t{place / 2} * lanes_.rows() + row) * kParts + part) * kPairReals +
           place % 2 * kSecondBlock;
  }
  static RINGLET_KERNEL void load(const T* block, Padded<T> (&columns)[3]) {
    const auto* column = reinterpret_cast<const Padded<T>*>(block);
    columns[0] = column[0], columns[1] = column[2], columns[2] = column[4];
  }
  static RINGLET_KERNEL void store(T* block, const Padded<T> (&columns)[3]) {
    auto* column = reinterpret_cast<Padded<T>*>(block);
    column[0] = columns[0], column[2] = columns[1], column[4] = columns[2];
  }
  // quotient = E^-1 a
  static RINGLET_KERNEL void divide(const T* inverse_of, const Padded<T> (&a)[3], Padded<T> (&quotient)[3]) {
    Padded<T> inverse[3];
    load(inverse_of, inverse);
    for (int k = 0; k < 3; ++k) quotient[k] = block_times(inverse, a[k]);
  }
  // from -= a^T b
  static RINGLET_KERNEL void subtract_product(Padded<T> (&from)[3], const Padded<T> (&a)[3],
                                              const Padded<T> (&b)[3]) {
    for (int k = 0; k < 3; ++k) from[k] -= transpose_times(a, b[k]);
  }

  const PairLanes<T>& lanes_;
  HostBuffer<std::int32_t> first_, first_band_, offset_;
  HostBuffer<T> values_, factor_, band_lanes_;
  HostBuffer<T> solved_, products_;  // of one pair's rows
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
