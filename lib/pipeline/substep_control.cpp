#include "pipeline/substep_control.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "core/error.h"
#include "core/log.h"
#include "core/trace.h"
#include "pipeline/simulation.h"

namespace ringlet::pipeline {
namespace {

constexpr double kAim = 0.7;  // of the tolerance, that the next frame's error should be
constexpr const char* kName = "substeps";

double expected_order(const scene::Effects& effects) {
  return effects.inextensible || effects.hair_hair || !effects.solids.empty() ? 0.5 : 1;
}

double change(const std::vector<double>& from, const std::vector<double>& to, double particles) {
  double square = 0;
  for (std::size_t k = 0; k < to.size(); ++k) square += (to[k] - from[k]) * (to[k] - from[k]);
  return std::sqrt(square / particles);
}

}  // namespace

SubstepControl::SubstepControl(const scene::Scene& scene, double length)
    : choice_(*scene.model.substep_choice),
      length_(length > 0 ? length : 1),
      order_(expected_order(scene.effects)),
      least_(std::max(choice_.min, 2)),
      next_(least_) {}

std::vector<int> SubstepControl::tries(int second) const {
  std::vector<int> tries = {(std::min(second, choice_.max) + 1) / 2};
  while (tries.back() < choice_.max) tries.push_back(std::min(2 * tries.back(), choice_.max));
  return tries;
}

void SubstepControl::step(int frame, double particles, const Try& take) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  std::vector<double> before;  // of the try before, empty where it diverged
  tried_ = 0, error_ = kUnknown;
  for (const int substeps : tries(next_)) {
    trace::Span span("try");
    span.tell("substeps", substeps);
    std::vector<double> now;
    tried_ += substeps;
    try {
      now = take(substeps);
    } catch (const Diverged&) {
      if (substeps == choice_.max) throw;
      error_ = kUnknown;
    }
    if (!before.empty() && !now.empty())
      error_ = change(before, now, particles) / length_ /
               (std::pow(static_cast<double>(substeps) / substeps_, order_) - 1);
    substeps_ = substeps, before = std::move(now);
    span.tell("error", error_);
    if (error_ <= choice_.tolerance) break;
  }
  const double wanted = substeps_ * std::pow(error_ / (kAim * choice_.tolerance), 1 / order_);
  next_ = static_cast<int>(std::ceil(std::clamp(wanted, 0.5 * substeps_, 2.0 * substeps_)));
  next_ = std::clamp(next_, least_, choice_.max);
  if (error_ <= choice_.tolerance || told_) return;
  told_ = true;
  const std::string error = std::isfinite(error_) ? fmt::format("of {:.2g}", error_) : "that is not known";
  log_warning_once(fmt::format(
      "frame {}: {} substeps, the most there may be, leave an error {} of the strands' length, above the "
      "tolerance of {:.2g} (a larger /model/substeps/max would do); later frames' are in the cache's figures",
      frame, substeps_, error, choice_.tolerance));
}

state::Figures SubstepControl::figures() const {
  return {{"substeps", substeps_},
          {"substeps_tried", tried_},
          {"step_error", error_},
          {"step_error_above", error_ <= choice_.tolerance ? 0.0 : 1.0}};
}

void SubstepControl::save(state::Snapshot& snapshot) const {
  std::vector<std::byte>& bytes = snapshot.arrays[kName];
  bytes.resize(sizeof next_);
  std::memcpy(bytes.data(), &next_, sizeof next_);
}

void SubstepControl::restore(const state::Snapshot& snapshot) {
  const auto found = snapshot.arrays.find(kName);
  int next = 0;
  if (found != snapshot.arrays.end() && found->second.size() == sizeof next)
    std::memcpy(&next, found->second.data(), sizeof next);
  if (next < least_ || next > choice_.max)
    throw Error(ErrorKind::kInput, "state", "`substeps` is missing or of another scene",
                "run without --resume");
  next_ = next;
}

}  // namespace ringlet::pipeline
