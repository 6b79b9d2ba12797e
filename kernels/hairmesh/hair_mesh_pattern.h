// Where the blocks of a hair mesh's matrix lie, found once: which pairs of columns the elements couple, and
// where each element adds its blocks.
//
// Plain code of the host, compiled for no instruction set.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "kernels/hairmesh/column_order.h"
#include "kernels/hairmesh/hair_mesh_elements.h"

namespace ringlet::kernels {

class PatternBuilder {
 public:
  PatternBuilder(ColumnOrder order, std::int32_t columns, std::int32_t layers, bool held_roots)
      : order_(std::move(order)),
        columns_(columns),
        layers_(layers),
        first_layer_(held_roots ? 1 : 0),
        slopes_(static_cast<std::size_t>(columns)) {}

  const ColumnOrder& order() const { return order_; }
  // Of two vertices, which row comes first.
  bool is_before(std::int32_t a, std::int32_t b) const {
    return a / layers_ == b / layers_ ? a < b : order_.is_before(a / layers_, b / layers_);
  }

  // An element couples all of its vertices with one another: in one column at most two layers apart, in two
  // columns at most one.
  template <std::size_t kVertices>
  void couple(const std::int32_t (&vertex)[kVertices]) {
    for (const std::int32_t a : vertex)
      for (const std::int32_t b : vertex) {
        if (!order_.is_before(a / layers_, b / layers_) || is_held(a) || is_held(b)) continue;
        bool& slopes = slopes_[static_cast<std::size_t>(a / layers_)][b / layers_];
        slopes = slopes || a % layers_ != b % layers_;
      }
  }

  // After all elements are coupled: lays the blocks out.
  void finish() {
    first_.assign(1, 0), first_band_.assign(1, 0);
    for (std::int32_t k = 0; k < order_.pairs().count; ++k) {
      std::vector<std::int32_t> others[2];
      std::size_t sloping = 0;
      for (int half = 0; half < 2; ++half) {
        const std::int32_t column = order_.pairs().data[k].column[half];
        others[half] = later_columns(column, true);
        sloping = std::max(sloping, others[half].size());
        const std::vector<std::int32_t> level = later_columns(column, false);
        others[half].insert(others[half].end(), level.begin(), level.end());
      }
      const std::size_t count = std::max(others[0].size(), others[1].size());
      for (std::vector<std::int32_t>& of : others) of.resize(count, columns_);
      for (std::size_t g = 0; g < count; ++g) other_.push_back({{others[0][g], others[1][g]}});
      const std::int32_t begin = first_.back();
      first_.push_back(begin + static_cast<std::int32_t>(sloping));
      first_.push_back(begin + static_cast<std::int32_t>(count));
      first_band_.push_back(first_band_.back() + static_cast<std::int32_t>(count + (kSlopes - 1) * sloping));
    }
  }

  // Of the block of row a and column b, b not before a.
  std::int32_t slot(std::int32_t a, std::int32_t b) const {
    if (is_held(a) || is_held(b)) return (blocks() - 1) * kPairReals;
    const std::int32_t place = order_.place(a / layers_), pair = place / 2, half = place % 2;
    const std::int32_t row = a % layers_ - first_layer_, slope = b % layers_ - a % layers_;
    const std::int32_t block = a / layers_ == b / layers_
                                   ? (pair * rows() + row) * kOwnBlocks + slope
                                   : band_block(pair, half, row + slope, slope, b / layers_);
    return block * kPairReals + half * kSecondBlock;
  }

  BlockPattern pattern() const {
    return {columns_,      layers_,       first_layer_,       order_.pairs(),
            first_.data(), other_.data(), first_band_.data(), blocks()};
  }

 private:
  std::int32_t rows() const { return layers_ - first_layer_; }
  std::int32_t fours() const { return (rows() + 3) / 4; }
  bool is_held(std::int32_t v) const { return v % layers_ < first_layer_; }

  // Those in columns, those in bands, and one for held roots'.
  std::int32_t blocks() const { return first_band_block() + 4 * fours() * first_band_.back() + 1; }
  std::int32_t first_band_block() const { return order_.pairs().count * rows() * kOwnBlocks; }
  // Of a row of a later column. A pair's bands of four such rows lie one after the other, then those of the
  // next four.
  std::int32_t band_block(std::int32_t pair, std::int32_t half, std::int32_t row, std::int32_t slope,
                          std::int32_t later) const {
    const std::int32_t* first = first_.data() + 2 * pair;
    std::int32_t group = first[0];
    while (other_[static_cast<std::size_t>(group)].column[half] != later) ++group;
    const std::int32_t begin = first_band_[static_cast<std::size_t>(pair)],
                       bands = first_band_[static_cast<std::size_t>(pair) + 1] - begin;
    const std::int32_t band =
        group < first[1] ? kSlopes * (group - first[0]) + slope + 1 : bands - (first[2] - group);
    return first_band_block() + 4 * (fours() * begin + row / 4 * bands + band) + row % 4;
  }

  std::vector<std::int32_t> later_columns(std::int32_t column, bool sloping) const {
    std::vector<std::int32_t> all;
    if (column < columns_)
      for (const auto& [other, slopes] : slopes_[static_cast<std::size_t>(column)])
        if (slopes == sloping) all.push_back(other);
    return all;
  }

  ColumnOrder order_;
  std::int32_t columns_, layers_, first_layer_;
  std::vector<std::map<std::int32_t, bool>> slopes_;  // of each column, to later ones
  std::vector<std::int32_t> first_, first_band_;
  std::vector<ColumnPair> other_;
};

}  // namespace ringlet::kernels
