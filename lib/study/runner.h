// Single runs: timed, or measured.
#pragma once
#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "study/measure.h"
#include "study/variants.h"

namespace ringlet::study {

// What every run of a study has in common.
struct Common {
  pipeline::FrameRange frames;
  int repeats = 3;
  const std::atomic<int>* stop = nullptr;  // non-zero: end after the frame in flight
};

enum class Ending { kComplete, kStopped, kDiverged };

struct Outcome {
  Ending ending = Ending::kComplete;
  std::string message;  // where it diverged
};

// A run's figures that do not depend on the clock.
struct Measured {
  Outcome outcome;
  Errors errors;
  bool resampled = false;
  std::string backend, instruction_set;     // that it ran on
  std::int64_t strands = 0, particles = 0;  // simulated
};

struct Timed {
  Outcome outcome;
  double milliseconds = 0;                             // of a frame: the median over frames and repeats
  std::vector<std::pair<std::string, double>> stages;  // by the plan's names, medians [ms]
  std::int64_t frames = 0;                             // that the medians are of
};

// The scene with the fields and strands in its frames that are compared, and its surfaces with `solids`.
scene::Scene observed(const std::filesystem::path& file, std::vector<std::string> overrides, bool solids);

// Makes the run ready and throws what it cannot be made for: Error{kUsage, kInput, kDevice}.
void rehearse(const Variant& variant);

// One run against the reference. It warms what the timed ones use.
Measured measure_run(const Variant& variant, const std::filesystem::path& file, const Common& common,
                     const scene::Scene& reference_scene, const cache::CacheReader& reference);

// The scene as given by the variant, `repeats` times. Frames before the range do not count.
Timed time_run(const Variant& variant, const Common& common);

// One run into a cache, from where an earlier one was cut off if that is there.
Outcome cache_run(const scene::Scene& scene, const Machine& machine, const Common& common,
                  const std::filesystem::path& directory);

}  // namespace ringlet::study
