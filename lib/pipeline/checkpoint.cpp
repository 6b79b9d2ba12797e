#include "pipeline/checkpoint.h"

#include <fmt/format.h>

#include <cstring>

#include "core/error.h"

namespace ringlet::pipeline {
namespace {

// Calls visit(name, array) for every array of a checkpoint that this run has.
template <class Model, class State, class Visit>
void each_array(Model& model, State& state, Arrays arrays, const Visit& visit) {
  const auto if_there = [&](const char* name, auto& array) {
    if (!array.empty()) visit(name, array);
  };
  if_there("position", state.position);
  if_there("velocity", state.velocity);
  if_there("elongation", state.elongation);
  if_there("shelter", state.shelter);
  if_there("companion_position", state.companion_position);
  if_there("companion_velocity", state.companion_velocity);
  if_there("touches", state.touches);
  if (arrays == Arrays::kAll) {
    if_there("air", state.air);
    if_there("root_motion", state.root_motion);
    if_there("root_points", state.root_points);
  }
  if (arrays != Arrays::kStateAndModel) return;
  if_there("count", model.count);
  if_there("rest", model.rest);
  if_there("rest_length", model.rest_length);
  if_there("per_length", model.per_length);
  if_there("preload", model.preload);
}

}  // namespace

template <class T>
state::Snapshot save(int frame, const state::StrandModel<T>& model, const state::StrandState<T>& state,
                     Arrays arrays) {
  state::Snapshot snapshot;
  snapshot.frame = frame;
  each_array(model, state, arrays, [&](const char* name, const auto& array) {
    std::vector<std::byte>& bytes = snapshot.arrays[name];
    bytes.resize(array.size() * sizeof array[0]);
    std::memcpy(bytes.data(), array.data(), bytes.size());
  });
  return snapshot;
}

template <class T>
void restore(const state::Snapshot& snapshot, state::StrandModel<T>& model, state::StrandState<T>& state,
             Arrays arrays) {
  each_array(model, state, arrays, [&](const char* name, auto& array) {
    const auto found = snapshot.arrays.find(name);
    const std::size_t size = array.size() * sizeof array[0];
    if (found == snapshot.arrays.end() || found->second.size() != size)
      throw Error(ErrorKind::kInput, "state", fmt::format("`{}` is missing or of another size", name),
                  "run without --resume");
    std::memcpy(array.data(), found->second.data(), size);
  });
}

template state::Snapshot save(int, const state::StrandModel<float>&, const state::StrandState<float>&,
                              Arrays);
template state::Snapshot save(int, const state::StrandModel<double>&, const state::StrandState<double>&,
                              Arrays);
template void restore(const state::Snapshot&, state::StrandModel<float>&, state::StrandState<float>&, Arrays);
template void restore(const state::Snapshot&, state::StrandModel<double>&, state::StrandState<double>&,
                      Arrays);

}  // namespace ringlet::pipeline
