// A scene made ready to run, and the loop that runs it.
#pragma once
#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "core/error.h"
#include "pipeline/options.h"
#include "pipeline/plan.h"
#include "scene/scene_desc.h"
#include "state/frame.h"

namespace ringlet::pipeline {

struct FrameRange {
  int first, last;  // written; stepping always starts at the scene's first frame
};

// Seconds that a frame spent in each stage, by the plan's names.
using StageSeconds = std::vector<std::pair<std::string, double>>;

// The simulation left the scene's limits or is no longer finite: Error{kDiverged} with the failing state.
class Diverged : public Error {
 public:
  Diverged(state::Frame frame, std::string stage, std::int64_t strand, std::int64_t particle,
           std::string what);

  state::Frame frame;
  std::string stage;
  std::int64_t strand, particle;  // the particle counts from the strand's root; -1: unknown
};

struct RunControl {
  std::optional<state::Snapshot> resume;   // go on from here
  const std::atomic<int>* stop = nullptr;  // non-zero: end after the frame in flight
  std::function<void(int frame, double seconds, const StageSeconds&)>
      on_frame;  // after each stepped frame, preroll too
  // For tests: sees and may change the arrays of the state by name, as each stage has left them and before
  // they are looked at (a hair mesh's: as they are at each substep's start). Empty: nothing is copied.
  std::function<void(const std::string& stage, int frame, int substep, state::Snapshot& arrays)> probe;
};

class Simulation {
 public:
  // Reads every asset and allocates. Throws Error{kInput}, Error{kUsage} (double on CUDA), Error{kDevice}.
  static std::unique_ptr<Simulation> create(const scene::Scene& scene, const Options& options);
  virtual ~Simulation() = default;

  virtual const Plan& plan() const = 0;
  virtual state::RunHeader header(const FrameRange& range) const = 0;
  // Steps to range.last and hands frames of the range to the sink. Returns false if stopped early. Throws
  // Diverged.
  virtual bool run(const FrameRange& range, state::FrameSink& sink, const RunControl& control) = 0;
};

}  // namespace ringlet::pipeline
