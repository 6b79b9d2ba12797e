#include "study/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cache/reader.h"
#include "core/error.h"

namespace ringlet::study {
namespace fs = std::filesystem;

std::vector<int> ladder(int most_substeps, int cap) {
  int first = 2 * most_substeps;
  while (8 * first > cap && first > 1) first /= 2;
  std::vector<int> rungs;
  for (int substeps = first; substeps <= std::min(8 * first, cap); substeps *= 2) rungs.push_back(substeps);
  return rungs;
}

Reference::Reference(Plan plan, std::vector<Level> levels)
    : plan_(std::move(plan)), ladder_(ladder(plan_.most_substeps, plan_.cap)), levels_(std::move(levels)) {
  std::error_code error;
  if (substeps() > 0 && !fs::exists(cache(), error)) levels_.clear();
  if (substeps() == 0) return;
  double extent = 0;
  const cache::CacheReader reader(cache());
  for (const int frame : reader.frames())
    for (const float x : reader.read(frame).position)
      extent = std::max(extent, std::abs(static_cast<double>(x)));
  resolution_ = extent * 0x1p-24;
}

bool Reference::started() const {
  if (levels_.empty()) return false;
  return levels_.back().substeps >= ladder_.back() || resolved() || !can_refine();
}

int Reference::next() const {
  const int substeps = levels_.empty() ? ladder_.front() : 2 * levels_.back().substeps;
  return substeps <= plan_.cap ? substeps : 0;
}

bool Reference::can_refine() const { return next() > 0; }

int Reference::substeps() const {
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level)
    if (!level->diverged) return level->substeps;
  return 0;
}

std::optional<Spread> Reference::change() const {
  for (auto level = levels_.rbegin(); level != levels_.rend(); ++level)
    if (!level->diverged) return level->change;
  return std::nullopt;
}

bool Reference::resolved() const { return change() && change()->rms <= resolution_; }

std::vector<std::string> Reference::overrides(int substeps) const {
  std::vector<std::string> overrides = plan_.overrides;
  overrides.push_back(fmt::format("/model/substeps={}", substeps));
  return overrides;
}

scene::Scene Reference::scene(int substeps) const { return observed(plan_.file, overrides(substeps), true); }

fs::path Reference::directory_of(int substeps) const { return plan_.directory / std::to_string(substeps); }

fs::path Reference::cache() const { return directory_of(substeps()); }

void Reference::compare(Level& level, int before) {
  const cache::CacheReader old(directory_of(before)), now(directory_of(level.substeps));
  double extent = 0;
  const Errors change = measure_cache(scene(level.substeps), now, old, &extent);
  level.change = change.position, level.median_strand = change.median_strand;
  resolution_ = extent * 0x1p-24;
  const Level& last = levels_.back();
  if (!last.change || last.substeps != before) return;
  const auto order = [](double coarse, double fine) {
    return coarse > 0 && fine > 0 ? std::optional(std::log2(coarse / fine)) : std::nullopt;
  };
  level.order = order(last.change->rms, level.change->rms);
  if (last.median_strand && level.median_strand)
    level.median_strand_order = order(*last.median_strand, *level.median_strand);
}

Ending Reference::refine(const Common& common) {
  Level level{next(), false, {}, {}, {}, {}};
  Machine machine = plan_.machine;
  machine.options.precision = pipeline::Precision::kDouble;
  machine.options.backend = pipeline::Backend::kCpu;
  const int before = substeps();
  const Outcome outcome = cache_run(scene(level.substeps), machine, common, directory_of(level.substeps));
  if (outcome.ending == Ending::kStopped) return outcome.ending;
  level.diverged = outcome.ending == Ending::kDiverged;
  if (!level.diverged && before > 0) compare(level, before);
  levels_.push_back(level);
  const int unused = level.diverged ? level.substeps : before;
  if (unused > 0) {
    std::error_code error;  // what cannot be removed is in nobody's way
    fs::remove_all(directory_of(unused), error);
  }
  if (level.diverged && before == 0 && !can_refine())
    throw Error(ErrorKind::kDiverged, "reference: there is nothing to measure against", outcome.message);
  return Ending::kComplete;
}

}  // namespace ringlet::study
