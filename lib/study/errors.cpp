#include "study/errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ringlet::study {

void SpreadOf::add(double value) {
  ++count_;
  squares_ += value * value;
  if (!std::isfinite(value)) {
    ++infinite_;
  } else if (value <= 0) {
    ++zeros_;
  } else {
    const int bin = static_cast<int>(std::floor(std::log2(value) * kBins)) - kLowest * kBins;
    ++counts_[static_cast<std::size_t>(std::clamp(bin, 0, static_cast<int>(counts_.size()) - 1))];
  }
}

std::optional<Spread> SpreadOf::spread() const {
  if (count_ == 0) return std::nullopt;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (infinite_ > 0) return Spread{kInfinity, kInfinity};
  Spread spread{std::sqrt(squares_ / static_cast<double>(count_)), 0};
  const std::int64_t rank = (count_ * 99 + 99) / 100;
  std::int64_t below = zeros_;
  for (std::size_t bin = 0; bin < counts_.size() && below < rank; ++bin) {
    below += counts_[bin];
    spread.p99 = std::exp2((static_cast<double>(bin) + 0.5) / kBins + kLowest);  // the bin's middle
  }
  return spread;
}

}  // namespace ringlet::study
