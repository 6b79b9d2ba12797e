#include "pipeline/health.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <span>

#include "kernels/launch/finite.h"

namespace ringlet::pipeline {
namespace {

enum class Per { kParticle, kStrand };

// Calls visit(name, array, components, per what) for the arrays of the roots, or for every array that a stage
// reads or leaves.
template <class T, class Visit>
void each_of_roots(const state::StrandState<T>& state, const Visit& visit) {
  visit("root_points", state.root_points, 3, Per::kStrand);
  visit("root_motion", state.root_motion, kernels::kRootValues, Per::kStrand);
}
template <class T, class Visit>
void each_array(const state::StrandState<T>& state, const Visit& visit) {
  visit("position", state.position, 3, Per::kParticle);
  visit("velocity", state.velocity, 3, Per::kParticle);
  each_of_roots(state, visit);
  visit("elongation", state.elongation, 1, Per::kParticle);
  visit("air", state.air, 3, Per::kParticle);
  visit("shelter", state.shelter, 1, Per::kParticle);
  visit("companion_position", state.companion_position, 3, Per::kParticle);
  visit("companion_velocity", state.companion_velocity, 3, Per::kParticle);
}

template <class V>
bool all_finite(std::span<const V> values) {
  constexpr std::size_t kGrain = 1 << 15;  // values: some microseconds of work
  static const auto check = kernels::finite_check<V>(kernels::best_instruction_set());
  const auto count = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  if (values.size() <= kGrain) return check(values.data(), count(values.size()));
  std::atomic<bool> finite = true;
  const tbb::blocked_range<std::size_t> rows(0, values.size() / kernels::kLanes, kGrain / kernels::kLanes);
  tbb::parallel_for(rows, [&](const tbb::blocked_range<std::size_t>& some) {
    if (!check(values.data() + some.begin() * kernels::kLanes, count(some.size() * kernels::kLanes)))
      finite = false;
  });
  return finite;
}

// The first row of a strand whose values in this array are not all finite, -1 for none.
template <class V>
std::int64_t first_bad(const state::StrandLayout& layout, const state::AlignedVector<V>& array,
                       int components, Per per, std::size_t strand) {
  const int rows = per == Per::kStrand ? 1 : layout.count(strand);
  for (int i = 0; i < rows; ++i)
    for (int c = 0; c < components; ++c) {
      const std::size_t at =
          per == Per::kStrand ? layout.at_strand(strand, components, c) : layout.at(strand, i, components, c);
      if (!std::isfinite(array[at])) return i;
    }
  return -1;
}

// A visitor that makes `finite` false where an array is not.
auto looking(bool& finite) {
  return [&finite](const char*, const auto& array, int, Per) {
    using V = typename std::decay_t<decltype(array)>::value_type;
    finite = finite && all_finite(std::span<const V>(array));
  };
}

}  // namespace

template <class T>
bool finite(const state::StrandState<T>& state) {
  bool finite = true;
  each_array(state, looking(finite));
  return finite;
}

template <class T>
bool finite_roots(const state::StrandState<T>& state) {
  bool finite = true;
  each_of_roots(state, looking(finite));
  return finite;
}

template <class T>
std::optional<Fault> find_fault(const state::StrandModel<T>& model, const state::StrandState<T>& state) {
  std::optional<Fault> found;
  for (std::size_t s = 0; s < model.layout.strands() && !found; ++s)
    each_array(state, [&](const char* name, const auto& array, int components, Per per) {
      if (array.empty()) return;
      const std::int64_t row = first_bad(model.layout, array, components, per, s);
      if (row >= 0 && (!found || row < found->particle)) found = {static_cast<std::int64_t>(s), row, name};
    });
  return found;
}

template bool finite(const state::StrandState<float>&);
template bool finite(const state::StrandState<double>&);
template bool finite_roots(const state::StrandState<float>&);
template bool finite_roots(const state::StrandState<double>&);
template std::optional<Fault> find_fault(const state::StrandModel<float>&, const state::StrandState<float>&);
template std::optional<Fault> find_fault(const state::StrandModel<double>&,
                                         const state::StrandState<double>&);

}  // namespace ringlet::pipeline
