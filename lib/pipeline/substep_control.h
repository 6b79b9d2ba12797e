// How many substeps each frame takes, where the scene gives the error that they may leave in their place.
//
// Step doubling. A frame is taken from its start with n substeps and with m = 2 n; of a method of order p the
// errors of position are C / n^p and C / m^p, so what the second try leaves is
//
//   e = |x_m - x_n| / ((m / n)^p - 1)  [root mean square over the particles, over the strands' mean length]
//
// The second try is kept where e is within the tolerance, or m the most that there may be; else it is the
// first of the next two. The next frame begins with the m that would have led to an e a little under the
// tolerance. Nothing but the positions decides: runs on any number of threads choose the same.
#pragma once
#include <cstddef>
#include <functional>
#include <vector>

#include "scene/scene_desc.h"
#include "state/frame.h"

namespace ringlet::pipeline {

// The strands' step is of order 1. With few substeps errors fall more slowly where something acts on
// positions or velocities beside it (lengths held, solids, hair against hair): of scenes with any of these
// order 1/2 is assumed. Where errors fall faster, less than e is left; where more slowly, more.
class SubstepControl {
 public:
  // `scene`: one that leaves the choice; `length`: the strands' mean length at rest [m]
  SubstepControl(const scene::Scene& scene, double length);

  // Takes a frame from its start in so many substeps; the positions that this led to, in any fixed order
  // [m]. Throws Diverged.
  using Try = std::function<std::vector<double>(int substeps)>;
  // Takes frame `frame`: what the last try led to stays. `particles`: how many the positions are of. Throws
  // Diverged where the most substeps do.
  void step(int frame, double particles, const Try& take);

  int substeps() const { return substeps_; }  // of the last frame's try that was kept
  int least() const { return least_; }        // that a frame can be kept with
  int most() const { return choice_.max; }
  // The tries of a frame whose first pair ends with at least `second` substeps and that goes on to the most.
  std::vector<int> tries(int second) const;

  // What `step` holds where a try leads to so many values of positions [bytes].
  static std::size_t bytes(std::size_t values) { return 2 * values * sizeof(double); }

  // Of the last frame: substeps kept, of all tries, the error left, 1 where it is above the tolerance.
  state::Figures figures() const;

  // What it remembers from frame to frame, into and out of a checkpoint.
  void save(state::Snapshot& snapshot) const;
  void restore(const state::Snapshot& snapshot);

 private:
  scene::SubstepChoice choice_;
  double length_, order_;  // order_: p
  int least_;
  int next_;  // substeps that the next frame's second try should have
  int substeps_ = 0, tried_ = 0;
  double error_ = 0;
  bool told_ = false;  // that the most substeps left more than the tolerance
};

}  // namespace ringlet::pipeline
