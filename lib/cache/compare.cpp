#include "cache/compare.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>
#include <limits>

#include "cache/json_difference.h"

namespace ringlet::cache {
namespace {

using state::Frame;
using state::RunHeader;

std::string topology_difference(const RunHeader& a, const RunHeader& b) {
  const auto count = [](const char* what, std::int64_t in_a, std::int64_t in_b) {
    return std::to_string(in_a) + " against " + std::to_string(in_b) + " " + what;
  };
  if (a.offsets.size() != b.offsets.size()) {
    return count("strands", static_cast<std::int64_t>(a.offsets.size()) - 1,
                 static_cast<std::int64_t>(b.offsets.size()) - 1);
  }
  const auto [in_a, in_b] = std::mismatch(a.offsets.begin(), a.offsets.end(), b.offsets.begin());
  if (in_a == a.offsets.end()) return {};
  const auto strand = std::distance(a.offsets.begin(), in_a) - 1;  // offsets start at 0 in both
  return "strand " + std::to_string(strand) + " has " +
         count("particles", *in_a - a.offsets[strand], *in_b - b.offsets[strand]);
}

template <class T>
bool same_bits(const std::vector<T>& a, const std::vector<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

bool identical(const Frame& a, const Frame& b) {
  return same_bits(a.position, b.position) && same_bits(a.velocity, b.velocity) &&
         same_bits(a.elongation, b.elongation) && same_bits(a.living, b.living) &&
         same_bits(a.guide_position, b.guide_position) &&
         std::equal(a.surface_vertices.begin(), a.surface_vertices.end(), b.surface_vertices.begin(),
                    b.surface_vertices.end(), same_bits<float>);
}

// Distance of each particle; `scale` takes B's unit of length to A's.
std::vector<double> distances_between(const std::vector<float>& a, const std::vector<float>& b,
                                      double scale) {
  std::vector<double> distances(a.size() / 3);
  for (std::size_t i = 0; i < distances.size(); ++i) {
    double squared = 0;
    for (std::size_t axis = 3 * i; axis < 3 * i + 3; ++axis) {
      const double difference = static_cast<double>(a[axis]) - scale * static_cast<double>(b[axis]);
      squared += difference * difference;
    }
    distances[i] = std::isfinite(squared) ? std::sqrt(squared) : std::numeric_limits<double>::infinity();
  }
  return distances;
}

// Takes the distances apart: the percentile reorders them.
Distances statistics(std::vector<double> distances, const std::vector<std::int64_t>& offsets) {
  Distances result;
  if (distances.empty()) return result;
  double sum = 0;
  for (const double distance : distances) sum += distance * distance;
  result.rms = std::sqrt(sum / static_cast<double>(distances.size()));
  result.non_finite =
      std::count_if(distances.begin(), distances.end(), [](double d) { return !std::isfinite(d); });

  const auto farthest = std::max_element(distances.begin(), distances.end());
  result.max = *farthest;
  if (result.max > 0) {
    const auto particle = std::distance(distances.begin(), farthest);
    result.strand =
        std::distance(offsets.begin(), std::upper_bound(offsets.begin(), offsets.end(), particle)) - 1;
    result.particle = particle - offsets[result.strand];
  }
  const auto rank = static_cast<std::ptrdiff_t>((distances.size() * 99 + 99) / 100) - 1;
  std::nth_element(distances.begin(), distances.begin() + rank, distances.end());
  result.p99 = distances[rank];
  return result;
}

void add_provenance(std::vector<Difference>& differences, const RunHeader& a, const RunHeader& b) {
  const auto text = [&](const char* where, const std::string& in_a, const std::string& in_b) {
    if (in_a != in_b) differences.push_back({where, in_a, in_b});
  };
  text("program version", a.program_version, b.program_version);
  text("backend", a.backend, b.backend);
  text("instruction set", a.instruction_set, b.instruction_set);
  text("precision", a.precision, b.precision);
  text("length unit", a.length_unit, b.length_unit);
  text("up axis", a.up, b.up);
  const auto scene = json_differences(a.scene_json, b.scene_json);
  differences.insert(differences.end(), scene.begin(), scene.end());
}

void compare_frames(Comparison& result, const CacheReader& a, const CacheReader& b,
                    const std::vector<int>& frames) {
  const double scale = b.header().metres_per_unit / a.header().metres_per_unit;
  double squares = 0;
  for (const int number : frames) {
    const Frame frame_a = a.read(number), frame_b = b.read(number);
    const Distances found =
        statistics(distances_between(frame_a.position, frame_b.position, scale), a.header().offsets);
    result.frames.push_back({number, found, identical(frame_a, frame_b)});
    squares += found.rms * found.rms;
    if (frame_a.living != frame_b.living) result.living.push_back(number);

    Distances& overall = result.overall;
    if (result.frames.size() == 1 || found.max > overall.max) {
      result.worst_frame = number;
      overall.max = found.max;
      overall.strand = found.strand;
      overall.particle = found.particle;
    }
    overall.p99 = std::max(overall.p99, found.p99);
    overall.non_finite += found.non_finite;
  }
  if (!frames.empty()) result.overall.rms = std::sqrt(squares / static_cast<double>(frames.size()));
}

}  // namespace

Comparison compare(const CacheReader& a, const CacheReader& b, const CompareOptions& options) {
  Comparison result;
  add_provenance(result.provenance, a.header(), b.header());
  const auto& in_a = a.frames();
  const auto& in_b = b.frames();
  std::vector<int> both;
  std::set_difference(in_a.begin(), in_a.end(), in_b.begin(), in_b.end(), std::back_inserter(result.only_a));
  std::set_difference(in_b.begin(), in_b.end(), in_a.begin(), in_a.end(), std::back_inserter(result.only_b));
  std::set_intersection(in_a.begin(), in_a.end(), in_b.begin(), in_b.end(), std::back_inserter(both));

  result.topology = topology_difference(a.header(), b.header());
  if (!result.topology.empty()) return result;
  compare_frames(result, a, b, both);
  const bool exact =
      std::all_of(result.frames.begin(), result.frames.end(), [](const auto& f) { return f.identical; });
  const bool within = options.exact ? exact : result.overall.max <= options.tolerance;
  result.same =
      within && result.living.empty() && !both.empty() && result.only_a.empty() && result.only_b.empty();
  return result;
}

}  // namespace ringlet::cache
