// Lengths held after a stage of hair against hair has moved the strands.
#pragma once
#include "effects/stage.h"
#include "scene/scene_desc.h"

namespace ringlet::effects {

// A stage's part that makes edges what `effects.inextensible` wants again, and tells the frame's figures of
// strains and speeds as they then are. All references must outlive it.
template <class T>
class Lengths {
 public:
  Lengths(const scene::Scene& scene, const state::StrandModel<T>& model, state::StrandState<T>& state);

  // After displacements that took `seconds`: the executor holds the state. Where lengths are not to be held
  // (now) they are only looked at.
  void hold(Executor<T>& executor, const Substep& substep, double seconds, FrameReport& report);

  std::int64_t diverged_strand() const { return diverged_; }  // the first of the last `hold`, -1 for none
  std::size_t bytes() const { return figures_.size() * sizeof(T); }

 private:
  const scene::Scene& scene_;
  const state::StrandModel<T>& model_;
  state::StrandState<T>& state_;
  state::AlignedVector<T> figures_;
  std::int64_t diverged_ = -1;
};

}  // namespace ringlet::effects
