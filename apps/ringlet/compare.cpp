#include "compare.h"

#include <cmath>
#include <cstdio>

#include "cache/compare.h"
#include "report.h"

namespace ringlet::app {
namespace {

using cache::Comparison;
using cache::Distances;

// Frame numbers as ranges: "1-48, 50".
std::string ranges(const std::vector<int>& frames) {
  std::string text;
  for (std::size_t first = 0; first < frames.size();) {
    std::size_t last = first;
    while (last + 1 < frames.size() && frames[last + 1] == frames[last] + 1) ++last;
    text += (text.empty() ? "" : ", ") + std::to_string(frames[first]);
    if (last > first) text += "-" + std::to_string(frames[last]);
    first = last + 1;
  }
  return text;
}

// JSON knows no infinity: null.
Report number(double value) { return std::isfinite(value) ? Report(value) : Report(); }

Report json_of(const Distances& distances) {
  return {{"max", number(distances.max)},   {"rms", number(distances.rms)},
          {"p99", number(distances.p99)},   {"strand", distances.strand},
          {"particle", distances.particle}, {"non_finite", distances.non_finite}};
}

Report json_of(const Comparison& result, const CompareOptions& options, const std::string& unit) {
  Report report = {
      {"same", result.same}, {"exact", options.exact}, {"tolerance", options.tolerance}, {"unit", unit}};
  if (!result.topology.empty()) report["topology"] = result.topology;
  report["only_a"] = result.only_a;
  report["only_b"] = result.only_b;
  report["other_living"] = result.living;
  if (!result.frames.empty()) {
    report["overall"] = json_of(result.overall);
    report["overall"]["frame"] = result.worst_frame;
  }
  report["frames"] = Report::array();
  for (const auto& frame : result.frames) {
    Report row = json_of(frame.distances);
    row["frame"] = frame.frame;
    row["identical"] = frame.identical;
    report["frames"].push_back(std::move(row));
  }
  report["provenance"] = Report::array();
  for (const auto& difference : result.provenance)
    report["provenance"].push_back({{"where", difference.where}, {"a", difference.a}, {"b", difference.b}});
  return report;
}

void print_frames(const Comparison& result, const std::string& unit) {
  if (result.frames.empty()) return;
  std::printf("distances in %s\n%8s %12s %12s %12s  %s\n", unit.c_str(), "frame", "max", "rms", "p99",
              "worst");
  const auto row = [](const char* frame, const Distances& distances, const std::string& worst) {
    std::printf("%8s %12.4g %12.4g %12.4g  %s\n", frame, distances.max, distances.rms, distances.p99,
                worst.c_str());
  };
  const auto place = [](const Distances& distances) {
    if (distances.strand < 0) return std::string("-");
    std::string text =
        "strand " + std::to_string(distances.strand) + ", particle " + std::to_string(distances.particle);
    if (distances.non_finite > 0)
      text += "; " + std::to_string(distances.non_finite) + " particles not finite";
    return text;
  };
  for (const auto& frame : result.frames)
    row(std::to_string(frame.frame).c_str(), frame.distances, place(frame.distances));
  row("all", result.overall, "frame " + std::to_string(result.worst_frame) + ", " + place(result.overall));
}

void print_text(const Comparison& result, const CompareOptions& options, const std::string& unit) {
  for (const auto& difference : result.provenance) {
    const auto value = [](const std::string& text) { return text.empty() ? "absent" : text.c_str(); };
    std::printf("%s: %s | %s\n", difference.where.c_str(), value(difference.a), value(difference.b));
  }
  print_frames(result, unit);
  if (!result.topology.empty()) std::printf("other strands: %s\n", result.topology.c_str());
  if (!result.only_a.empty()) std::printf("frames only in A: %s\n", ranges(result.only_a).c_str());
  if (!result.only_b.empty()) std::printf("frames only in B: %s\n", ranges(result.only_b).c_str());
  if (!result.living.empty())
    std::printf("other living particles in frames: %s\n", ranges(result.living).c_str());
  if (result.topology.empty() && result.frames.empty()) std::printf("no frame in common\n");
  if (options.exact) {
    std::printf("%s\n", result.same ? "identical" : "not identical");
  } else {
    std::printf("%s tolerance %g %s\n", result.same ? "the same within" : "not the same within",
                options.tolerance, unit.c_str());
  }
}

}  // namespace

int run_compare(const CompareOptions& options) {
  const cache::CacheReader a(options.a), b(options.b);
  const Comparison result = cache::compare(a, b, {.tolerance = options.tolerance, .exact = options.exact});
  const std::string& unit = a.header().length_unit;
  if (options.json) {
    print_report(json_of(result, options, unit), true);
  } else {
    print_text(result, options, unit);
  }
  return result.same ? 0 : 1;
}

}  // namespace ringlet::app
