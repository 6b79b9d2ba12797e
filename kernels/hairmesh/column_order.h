// The order in which sweeps go over a hair mesh's columns: in pairs, so that two columns go side by side.
//
// Plain code of the host, compiled for no instruction set.
#pragma once
#include <algorithm>
#include <cstdint>
#include <vector>

#include "kernels/hairmesh/hair_mesh_elements.h"

namespace ringlet::kernels {

// Pairs each column with the next of those left that it is not coupled with. Their order is nearly that of
// the mesh: sweeps by pairs take no more iterations than sweeps by columns.
class ColumnOrder {
 public:
  // `coupled[c]`: the columns that c may be coupled with, ascending.
  explicit ColumnOrder(const std::vector<std::vector<std::int32_t>>& coupled)
      : place_(coupled.size(), kNone) {
    const auto columns = static_cast<std::int32_t>(coupled.size());
    for (std::int32_t first = 0; first < columns; ++first) {
      if (place(first) != kNone) continue;
      const auto& of = coupled[static_cast<std::size_t>(first)];
      std::int32_t partner = first + 1;
      while (partner < columns &&
             (place(partner) != kNone || std::binary_search(of.begin(), of.end(), partner)))
        ++partner;
      const ColumnPair pair{{first, partner}};
      for (int half = 0; half < 2; ++half)
        if (pair.column[half] < columns)
          place_[static_cast<std::size_t>(pair.column[half])] =
              static_cast<std::int32_t>(2 * pairs_.size()) + half;
      pairs_.push_back(pair);
    }
  }

  // Twice the column's pair, plus which of it.
  std::int32_t place(std::int32_t column) const { return place_[static_cast<std::size_t>(column)]; }
  bool is_before(std::int32_t a, std::int32_t b) const { return place(a) < place(b); }
  MeshArray<ColumnPair> pairs() const { return {pairs_.data(), static_cast<std::int32_t>(pairs_.size())}; }

 private:
  static constexpr std::int32_t kNone = -1;

  std::vector<std::int32_t> place_;
  std::vector<ColumnPair> pairs_;
};

}  // namespace ringlet::kernels
