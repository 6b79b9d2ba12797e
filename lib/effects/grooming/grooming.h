// Grooming during a run: the operations of groom/edit.h on the strands as they are.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "groom/edit.h"
#include "scene/scene_desc.h"
#include "state/strand_model.h"

namespace ringlet::effects {

// Changes the model between steps, so whoever holds a copy of it (an Executor) must be told. What grooming
// has made of the strands is state: a resumed run goes on from a checkpoint that holds the model's strands
// too.
template <class T>
class Grooming {
 public:
  // `model` as at the run's start. `groom_of_strand`: index into scene.grooms. All must outlive this. Throws
  // Error{kInput} for a mesh to trim by that cannot be read.
  Grooming(const scene::Scene& scene, std::span<const std::int32_t> groom_of_strand,
           state::StrandModel<T>& model, state::StrandState<T>& state);

  // Does the operations of this frame; false where there are none. `roots`: the root poses now. Throws
  // Error{kInput} at the pointer of a trim that leaves nothing.
  bool apply(int frame, std::span<const Pose> roots);

  std::size_t bytes() const;

 private:
  bool concerns(const scene::GroomingOperation& operation, std::size_t strand) const;
  void apply(const scene::GroomingOperation& operation, const groom::SignedDistance& cutter,
             std::span<const Pose> roots);
  groom::EditedStrand read(std::size_t strand, const Pose& root) const;
  void write(std::size_t strand, const groom::EditedStrand& edited,
             const scene::GroomingOperation& operation);

  const scene::Scene& scene_;
  std::span<const std::int32_t> groom_of_strand_;
  state::StrandModel<T>& model_;
  state::StrandState<T>& state_;
  std::vector<double> spacing_;                 // [strands] groom::spacing at the start [m]
  std::vector<groom::SignedDistance> cutters_;  // [operations] empty where no mesh cuts
};

}  // namespace ringlet::effects
