#include "state/strand_order.h"

#include <algorithm>
#include <numeric>

namespace ringlet::state {

template <class T>
std::vector<std::int32_t> strands_by_root(const StrandModel<T>& model, const StrandState<T>& state) {
  const StrandLayout& layout = model.layout;
  std::vector<std::int32_t> strands(layout.strands());
  std::iota(strands.begin(), strands.end(), 0);
  const auto comes_first = [&](std::int32_t one, std::int32_t other) {
    for (int c = 0; c < 3; ++c) {
      const double a = state.root_points[layout.at_strand(one, 3, c)],
                   b = state.root_points[layout.at_strand(other, 3, c)];
      if (a != b) return a < b;
    }
    for (int i = 0; i < std::min(layout.count(one), layout.count(other)); ++i)
      for (int c = 0; c < 3; ++c) {
        const T a = model.rest[layout.at(one, i, 3, c)], b = model.rest[layout.at(other, i, 3, c)];
        if (a != b) return a < b;
      }
    for (int i = 0; !model.radius.empty() && i < std::min(layout.count(one), layout.count(other)); ++i) {
      const T a = model.radius[layout.at(one, i, 1, 0)], b = model.radius[layout.at(other, i, 1, 0)];
      if (a != b) return a < b;
    }
    return layout.count(one) < layout.count(other);
  };
  std::sort(strands.begin(), strands.end(), comes_first);
  for (std::int32_t& strand : strands) strand = static_cast<std::int32_t>(layout.at_strand(strand, 1, 0));
  return strands;
}

template std::vector<std::int32_t> strands_by_root(const StrandModel<float>&, const StrandState<float>&);
template std::vector<std::int32_t> strands_by_root(const StrandModel<double>&, const StrandState<double>&);

}  // namespace ringlet::state
