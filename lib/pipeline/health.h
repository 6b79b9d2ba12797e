// Whether every value of the strands' state is finite, and which one is not.
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "state/strand_model.h"

namespace ringlet::pipeline {

// A value that is not finite.
struct Fault {
  std::int64_t strand;
  std::int64_t particle;  // of the strand; the root for what a strand has once
  std::string array;      // of state::StrandState
};

// Looks at every array of the state, at less than an instruction a value.
template <class T>
bool finite(const state::StrandState<T>& state);
// The same of what strands have once: where their roots are and go.
template <class T>
bool finite_roots(const state::StrandState<T>& state);

// The first strand with such a value, and the first particle of that; where all arrays are finite but for
// lanes without a strand, nothing.
template <class T>
std::optional<Fault> find_fault(const state::StrandModel<T>& model, const state::StrandState<T>& state);

}  // namespace ringlet::pipeline
