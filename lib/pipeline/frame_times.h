// Wall times of a run's frames, for those who time runs and keep no frames.
#pragma once
#include <string>
#include <utility>
#include <vector>

#include "pipeline/simulation.h"

namespace ringlet::pipeline {

double median(std::vector<double> values);  // at least one

// Gathers what RunControl::on_frame tells.
class FrameTimes {
 public:
  void add(double seconds, const StageSeconds& stages);
  std::size_t frames() const { return frames_.size(); }
  double milliseconds() const { return 1e3 * median(frames_); }            // of a frame, the median
  std::vector<std::pair<std::string, double>> stage_milliseconds() const;  // by the plan's names, medians

 private:
  std::vector<double> frames_;                                       // [s]
  std::vector<std::pair<std::string, std::vector<double>>> stages_;  // [s]
};

class DiscardFrames : public state::FrameSink {
  void write(state::Frame, state::Snapshot, double) override {}
  void finish() override {}
};

}  // namespace ringlet::pipeline
