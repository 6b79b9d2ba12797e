#include "pipeline/frame_times.h"

#include <algorithm>

namespace ringlet::pipeline {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

void FrameTimes::add(double seconds, const StageSeconds& stages) {
  frames_.push_back(seconds);
  if (stages_.empty())
    for (const auto& [name, spent] : stages) stages_.push_back({name, {}});
  for (std::size_t k = 0; k < stages.size() && k < stages_.size(); ++k)
    stages_[k].second.push_back(stages[k].second);
}

std::vector<std::pair<std::string, double>> FrameTimes::stage_milliseconds() const {
  std::vector<std::pair<std::string, double>> medians;
  for (const auto& [name, spent] : stages_) medians.emplace_back(name, 1e3 * median(spent));
  return medians;
}

}  // namespace ringlet::pipeline
