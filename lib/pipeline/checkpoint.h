// What a run needs to go on, bit for bit.
#pragma once
#include "state/frame.h"
#include "state/strand_model.h"

namespace ringlet::pipeline {

// `groomed`: strands change during the run, so the checkpoint holds them too.
template <class T>
state::Snapshot save(int frame, const state::StrandModel<T>& model, const state::StrandState<T>& state,
                     bool groomed);

// Throws Error{kInput} where the snapshot lacks an array or has one of another size.
template <class T>
void restore(const state::Snapshot& snapshot, state::StrandModel<T>& model, state::StrandState<T>& state,
             bool groomed);

}  // namespace ringlet::pipeline
