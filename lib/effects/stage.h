// A stage of the substep. The pipeline walks a list of them; what a scene does not call for is not in the
// list.
#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "effects/executor.h"
#include "effects/launches.h"
#include "state/frame.h"
#include "state/strand_model.h"

namespace ringlet::effects {

// One substep on the way to `frame`: from `time_before` to `time` [s], h = `step`.
struct Substep {
  int frame;
  double time_before, time, step;
  bool first_of_frame, last_of_frame;
  int substeps;  // of this frame
};

// What a frame looked like strand by strand, gathered by the stages over its substeps.
struct FrameReport {
  std::vector<float> strain;         // [strands] edge strain at the frame's end [-]
  std::vector<unsigned char> moved;  // [strands] 1 where a solid moved the strand in this frame
  double length_iterations = 0;      // Newton iterations, sum over strands and substeps
  double most_length_iterations = 0;
  double subdivided = 0;      // strand steps that were taken in pieces
  double speed = 0;           // largest particle speed of the frame [m/s]
  double contact_rounds = 0;  // most rounds of length and contact projections
  double pushed = 0;          // largest last push-out at the frame's end [m]
  double swept = 0;           // particles that out-ran the narrow band and were looked for along their way
  // Hair against hair, where there are such stages: sums over the frame, and the largest of what has a
  // largest.
  double grid_solves = 0, grid_iterations = 0;  // of the pressure
  double grid_residual = 0;                     // that was left, relative to the right hand side [-]
  double grid_density = 0;   // largest over its target before the frame's last correction [-]
  double grid_cells = 0;     // fluid cells of the largest solve
  double contact_pairs = 0;  // segments that were looked at, two by two
  double contacts = 0;       // those that touched
  double contact_depth = 0;  // largest overlap that the last pass left [m]
  double crossings = 0;      // pairs that the last pass left through one another
};

// A strand that left the limits or is no longer finite.
struct Divergence {
  std::string stage;
  std::int64_t strand;
  double strain, speed;
};

template <class T>
class Stage {
 public:
  virtual ~Stage() = default;
  virtual const char* name() const = 0;
  virtual std::size_t bytes() const = 0;              // that it owns
  virtual Launches launches(int substeps) const = 0;  // of a frame of so many
  // `rest`: the strands at rest, posed by the roots at the run's first time. Before anything is stepped, and
  // whenever grooming has changed the model. The executor holds this state too.
  virtual void at_rest(Executor<T>&, const state::StrandState<T>& /*rest*/) {}
  // Before anything of the substep has moved, the roots neither. At a frame's start the host has the state.
  virtual void begin(Executor<T>&, const Substep&) {}
  virtual void run(Executor<T>& executor, const Substep& substep, FrameReport& report) = 0;
  // What it keeps from one frame to the next beside the state, into and out of a checkpoint: at a frame's
  // end, when the host has the state; after `at_rest`, and before a frame is taken once more.
  virtual void save(state::Snapshot&) {}
  virtual void restore(const state::Snapshot&) {}
  // The first strand that diverged in the last `run`, -1 for none.
  virtual std::int64_t diverged_strand() const { return -1; }
};

}  // namespace ringlet::effects
