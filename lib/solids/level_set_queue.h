// The level sets of a deforming solid, one a frame, built ahead of the stepping by a thread of their own.
#pragma once
#include <condition_variable>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "solids/level_set.h"

namespace ringlet::solids {

// A deforming solid's surface at a frame.
struct FrameSurface {
  std::shared_ptr<const LevelSet> level_set;
  std::vector<std::int32_t> folded;  // folded_triangles

  std::size_t bytes() const { return level_set->bytes() + folded.size() * sizeof folded[0]; }
};

class LevelSetQueue {
 public:
  using Build = std::function<FrameSurface(int frame)>;

  // `build` runs on the queue's thread alone, for one frame after another. Building starts with `first`;
  // nothing later than `last` is built ahead of being asked for.
  LevelSetQueue(Build build, int first, int last);
  ~LevelSetQueue();

  struct Pair {
    FrameSurface before, after;
  };

  // Those of `frame` and the next one; waits for them. Earlier ones are let go. Throws what `build` threw.
  Pair at(int frame);

  std::size_t bytes() const;  // of those held, each counted once

 private:
  struct Result {
    FrameSurface surface;
    std::exception_ptr error;
  };
  int next_wanted() const;  // the frame to build next, or kNone; under the lock
  void work();
  FrameSurface wait_for(std::unique_lock<std::mutex>& lock, int frame);

  const Build build_;
  const int last_;
  mutable std::mutex mutex_;
  std::condition_variable wanted_, finished_;
  std::map<int, Result> results_;
  int frame_;
  bool stop_ = false;
  std::thread thread_;  // last: it uses all the others
};

}  // namespace ringlet::solids
