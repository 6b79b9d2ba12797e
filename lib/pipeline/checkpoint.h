// What a run needs to go on, bit for bit.
#pragma once
#include "state/frame.h"
#include "state/strand_model.h"

namespace ringlet::pipeline {

// What goes into it: the state; with what grooming changes of the model; or every array of the state, those
// too that each substep makes anew.
enum class Arrays { kState, kStateAndModel, kAll };

template <class T>
state::Snapshot save(int frame, const state::StrandModel<T>& model, const state::StrandState<T>& state,
                     Arrays arrays);

// Throws Error{kInput} where the snapshot lacks an array or has one of another size.
template <class T>
void restore(const state::Snapshot& snapshot, state::StrandModel<T>& model, state::StrandState<T>& state,
             Arrays arrays);

}  // namespace ringlet::pipeline
