#include "state/strand_order.h"

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "kernels/backend/morton.h"

namespace ringlet::state {
namespace {

// Where each strand's root lies on a curve that fills their bounding box.
template <class T>
std::vector<std::uint64_t> places_on_curve(const StrandLayout& layout, const StrandState<T>& state) {
  constexpr double kCells = 1 << 20;  // along the longest axis
  const auto strands = static_cast<std::int32_t>(layout.strands());
  const auto root = [&](std::int32_t strand, int c) {
    return state.root_points[layout.at_strand(strand, 3, c)];
  };
  double low[3], longest = 0;
  for (int c = 0; c < 3; ++c) {
    double high = low[c] = strands == 0 ? 0 : root(0, c);
    for (std::int32_t strand = 0; strand < strands; ++strand)
      low[c] = std::min(low[c], root(strand, c)), high = std::max(high, root(strand, c));
    longest = std::max(longest, high - low[c]);
  }
  const double per_length = longest > 0 ? (kCells - 1) / longest : 0;
  const auto cell = [&](std::int32_t strand, int c) {
    const double at = (root(strand, c) - low[c]) * per_length;
    return at > 0 ? static_cast<std::uint32_t>(std::min(at, kCells - 1)) : 0;  // 0 for what is not a number
  };
  std::vector<std::uint64_t> places(strands);
  for (std::int32_t strand = 0; strand < strands; ++strand)
    places[strand] = kernels::key_of(cell(strand, 0), cell(strand, 1), cell(strand, 2));
  return places;
}

}  // namespace

template <class T>
std::vector<std::int32_t> strands_by_root(const StrandModel<T>& model, const StrandState<T>& state) {
  const StrandLayout& layout = model.layout;
  std::vector<std::int32_t> strands(layout.strands());
  std::iota(strands.begin(), strands.end(), 0);
  const std::vector<std::uint64_t> place = places_on_curve(layout, state);
  const auto comes_first = [&](std::int32_t one, std::int32_t other) {
    if (place[one] != place[other]) return place[one] < place[other];
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
