// The order in which sweeps go over a hair mesh's columns: in pairs, so that two columns go side by side.
//
// Plain code of the host, compiled for no instruction set.
#pragma once
#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "kernels/hairmesh/hair_mesh_elements.h"

namespace ringlet::kernels {

// Pairs each column with the next of those left that it is not coupled with. Their order is nearly that of
// the mesh: sweeps by pairs take no more iterations than sweeps by columns.
class ColumnOrder {
 public:
  // `coupled[c]`: the columns that c may be coupled with, ascending.
  explicit ColumnOrder(const std::vector<std::vector<std::int32_t>>& coupled) : place_(coupled.size()) {
    std::vector<std::int32_t> left(coupled.size());
    std::iota(left.begin(), left.end(), 0);
    const auto take = [&](auto of, int half) {
      const std::int32_t column = *of;
      left.erase(of);
      place_[static_cast<std::size_t>(column)] = static_cast<std::int32_t>(2 * pairs_.size()) + half;
      return column;
    };
    while (!left.empty()) {
      ColumnPair pair{{take(left.begin(), 0), static_cast<std::int32_t>(coupled.size())}};
      const auto& of = coupled[static_cast<std::size_t>(pair.column[0])];
      const auto partner = std::find_if_not(left.begin(), left.end(), [&](std::int32_t c) {
        return std::binary_search(of.begin(), of.end(), c);
      });
      if (partner != left.end()) pair.column[1] = take(partner, 1);
      pairs_.push_back(pair);
    }
  }

  // Twice the column's pair, plus which of it.
  std::int32_t place(std::int32_t column) const { return place_[static_cast<std::size_t>(column)]; }
  bool is_before(std::int32_t a, std::int32_t b) const { return place(a) < place(b); }
  MeshArray<ColumnPair> pairs() const { return {pairs_.data(), static_cast<std::int32_t>(pairs_.size())}; }

 private:
  std::vector<std::int32_t> place_;
  std::vector<ColumnPair> pairs_;
};

}  // namespace ringlet::kernels
