// Where the blocks of a hair mesh's matrix lie, found once: which pairs of columns the elements couple, and
// where each element adds its blocks.
//
// Plain code of the host, compiled for no instruction set.
#pragma once
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "kernels/hairmesh/hair_mesh_elements.h"

namespace ringlet::kernels {

class PatternBuilder {
 public:
  PatternBuilder(std::int32_t columns, std::int32_t layers, bool held_roots)
      : columns_(columns),
        layers_(layers),
        first_layer_(held_roots ? 1 : 0),
        slopes_(static_cast<std::size_t>(columns)) {}

  // An element couples all of its vertices with one another: in one column at most two layers apart, in two
  // columns at most one.
  template <std::size_t kVertices>
  void couple(const std::int32_t (&vertex)[kVertices]) {
    for (const std::int32_t a : vertex)
      for (const std::int32_t b : vertex) {
        if (a / layers_ >= b / layers_ || is_held(a) || is_held(b)) continue;
        bool& slopes = slopes_[static_cast<std::size_t>(a / layers_)][b / layers_];
        slopes = slopes || a % layers_ != b % layers_;
      }
  }

  // After all elements are coupled: lays the blocks out.
  void finish() {
    first_.assign(1, 0), first_pair_.assign(1, 0);
    for (const auto& others : slopes_) {
      std::int32_t bands = 0;
      for (const bool sloping : {true, false}) {
        for (const auto& [other, slopes] : others)
          if (slopes == sloping) other_.push_back(other), bands += slopes ? kSlopes : 1;
        first_.push_back(static_cast<std::int32_t>(other_.size()));
      }
      first_pair_.push_back(first_pair_.back() + bands * row_pairs());
    }
  }

  // Of the block of row a and column b, a <= b.
  std::int32_t slot(std::int32_t a, std::int32_t b) const {
    const std::int32_t in_columns = columns_ * layers_ * kOwnPairs;
    if (is_held(a) || is_held(b)) return (in_columns + first_pair_.back()) * kPairReals;
    const std::int32_t c = a / layers_, row = a % layers_ - first_layer_;
    if (c == b / layers_) return a * kOwnPairs * kPairReals + kOwnBlock[b - a];
    const std::int32_t *first = first_.data() + 2 * c, sloping = first[1] - first[0],
                       bands = sloping * (kSlopes - 1) + first[2] - first[0];
    const auto place = static_cast<std::int32_t>(
        std::find(other_.begin() + first[0], other_.begin() + first[2], b / layers_) - other_.begin() -
        first[0]);
    const std::int32_t band = place < sloping ? kSlopes * place + b % layers_ - a % layers_ + 1
                                              : kSlopes * sloping + place - sloping;
    // Bands of four rows lie one after the other, then those of the next four; the last may be of two rows or
    // one.
    const std::int32_t four = row / 4, pairs = std::min(2, row_pairs() - 2 * four);
    return (in_columns + first_pair_[static_cast<std::size_t>(c)] + 2 * four * bands + pairs * band +
            row % 4 / 2) *
               kPairReals +
           row % 2 * kSecondBlock;
  }

  BlockPattern pattern() const {
    return {columns_, layers_, first_layer_, first_.data(), other_.data(), first_pair_.data()};
  }

 private:
  std::int32_t row_pairs() const { return (layers_ - first_layer_ + 1) / 2; }
  bool is_held(std::int32_t v) const { return v % layers_ < first_layer_; }

  std::int32_t columns_, layers_, first_layer_;
  std::vector<std::map<std::int32_t, bool>> slopes_;  // of each column, to later ones
  std::vector<std::int32_t> first_, other_, first_pair_;
};

}  // namespace ringlet::kernels
