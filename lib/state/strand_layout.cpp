#include "state/strand_layout.h"

#include <algorithm>
#include <numeric>

#include "core/error.h"

namespace ringlet::state {

StrandLayout::StrandLayout(std::span<const std::int32_t> counts) : counts_(counts.begin(), counts.end()) {
  using kernels::kLanes;
  std::vector<std::size_t> order(counts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return counts[a] < counts[b]; });
  const std::size_t batches = (counts.size() + kLanes - 1) / kLanes;
  slot_.resize(counts.size());
  strand_.assign(batches * kLanes, -1);
  row_.assign(1, 0);
  for (std::size_t batch = 0; batch < batches; ++batch) {
    std::int32_t longest = 0;
    for (std::size_t k = batch * kLanes; k < std::min(counts.size(), (batch + 1) * kLanes); ++k) {
      slot_[order[k]] = {static_cast<std::int32_t>(batch), static_cast<std::int32_t>(k - batch * kLanes)};
      strand_[k] = static_cast<std::int64_t>(order[k]);
      longest = std::max(longest, counts[order[k]]);
    }
    const std::int64_t end = static_cast<std::int64_t>(row_.back()) + longest;
    if (end > std::int64_t{1} << 30)
      throw Error(ErrorKind::kInput, "groom", "more than 2^30 rows of particles",
                  "simulate fewer strands at once");
    row_.push_back(static_cast<std::int32_t>(end));
    longest_ = std::max(longest_, longest);
  }
}

}  // namespace ringlet::state
