#include "solids/level_set_queue.h"

#include <limits>
#include <set>

#include "core/trace.h"

namespace ringlet::solids {
namespace {
constexpr int kAhead = 2;  // frames built beyond the pair in use
constexpr int kNone = std::numeric_limits<int>::max();
}  // namespace

LevelSetQueue::LevelSetQueue(Build build, int first, int last)
    : build_(std::move(build)), last_(last), frame_(first), thread_([this] { work(); }) {}

LevelSetQueue::~LevelSetQueue() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wanted_.notify_one();
  thread_.join();
}

int LevelSetQueue::next_wanted() const {
  for (int frame = frame_; frame <= frame_ + 1 + kAhead; ++frame) {
    const bool in_use = frame <= frame_ + 1;
    if ((in_use || frame <= last_) && !results_.contains(frame)) return frame;
  }
  return kNone;
}

void LevelSetQueue::work() {
  trace::name_thread("level sets");
  std::unique_lock lock(mutex_);
  while (true) {
    wanted_.wait(lock, [this] { return stop_ || next_wanted() != kNone; });
    if (stop_) return;
    const int frame = next_wanted();
    lock.unlock();
    Result result;
    try {
      result.surface = build_(frame);
    } catch (...) {
      result.error = std::current_exception();
    }
    lock.lock();
    results_.emplace(frame, std::move(result));
    finished_.notify_all();
  }
}

FrameSurface LevelSetQueue::wait_for(std::unique_lock<std::mutex>& lock, int frame) {
  finished_.wait(lock, [&] { return results_.contains(frame); });
  const Result& result = results_.at(frame);
  if (result.error) std::rethrow_exception(result.error);
  return result.surface;
}

LevelSetQueue::Pair LevelSetQueue::at(int frame) {
  std::unique_lock lock(mutex_);
  frame_ = frame;
  results_.erase(results_.begin(), results_.lower_bound(frame));
  results_.erase(results_.upper_bound(frame + 1 + kAhead), results_.end());
  wanted_.notify_one();
  FrameSurface before = wait_for(lock, frame);
  return {std::move(before), wait_for(lock, frame + 1)};
}

std::size_t LevelSetQueue::bytes() const {
  const std::lock_guard lock(mutex_);
  std::set<const LevelSet*> held;
  std::size_t sum = 0;
  for (const auto& [frame, result] : results_)
    if (held.insert(result.surface.level_set.get()).second && result.surface.level_set)
      sum += result.surface.bytes();
  return sum;
}

}  // namespace ringlet::solids
