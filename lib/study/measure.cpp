#include "study/measure.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace ringlet::study {
namespace {

constexpr double kSameRoot = 1e-3;  // of the strand's length: roots farther apart are of other strands

Vec3 point(const std::vector<float>& values, std::int64_t particle) {
  const float* x = values.data() + 3 * particle;
  return {x[0], x[1], x[2]};
}

double length_of(const std::vector<float>& values, std::int64_t first, std::int64_t end) {
  double length = 0;
  for (std::int64_t i = first; i + 1 < end; ++i) length += (point(values, i + 1) - point(values, i)).norm();
  return length;
}

// A figure of the frame; nothing where it has none of this name.
std::optional<double> figure(const state::Frame& frame, const char* name) {
  for (const auto& [key, value] : frame.figures)
    if (key == name) return value;
  return std::nullopt;
}

// The side of the grid's cells [scene units].
double grid_cell(const scene::Scene& scene, const state::RunHeader& header) {
  const auto& hair_hair = scene.effects.hair_hair;
  if (!hair_hair || !hair_hair->grid) return 0;
  Eigen::AlignedBox3d box;
  for (std::int64_t i = 0; i < header.offsets.back(); ++i) box.extend(point(header.rest_position, i));
  return box.sizes().maxCoeff() / hair_hair->grid->resolution;
}

// Cubes of this side that hold hair: those that points not half a side apart along the strands lie in.
std::size_t cubes(const std::vector<float>& position, const std::vector<std::int64_t>& offsets,
                  const std::vector<std::int64_t>& from, double cell) {
  std::vector<std::uint64_t> keys;
  const auto add = [&](const Vec3& x) {
    std::uint64_t key = 0;
    for (int c = 0; c < 3; ++c) {
      const auto index = static_cast<std::int64_t>(std::floor(x[c] / cell));
      key = key << 21 | (static_cast<std::uint64_t>(index + (1 << 20)) & ((1u << 21) - 1));
    }
    if (keys.empty() || keys.back() != key) keys.push_back(key);
  };
  for (std::size_t s = 0; s + 1 < offsets.size(); ++s) {
    if (from[static_cast<std::size_t>(offsets[s])] < 0) continue;
    for (std::int64_t i = offsets[s]; i + 1 < offsets[s + 1]; ++i) {
      const Vec3 a = point(position, i), b = point(position, i + 1);
      const int pieces = std::clamp(static_cast<int>(std::ceil(2 * (b - a).norm() / cell)), 1, 1000);
      for (int k = 0; k < pieces; ++k) add(a + (b - a) * (static_cast<double>(k) / pieces));
    }
  }
  std::sort(keys.begin(), keys.end());
  return static_cast<std::size_t>(std::unique(keys.begin(), keys.end()) - keys.begin());
}

}  // namespace

Measure::Measure(const scene::Scene& scene, const cache::CacheReader& reference, state::RunHeader run,
                 bool penetration)
    : scene_(scene), reference_(reference), run_(std::move(run)) {
  const state::RunHeader& header = reference_.header();
  from_.assign(reference_.particles(), -1);
  share_.assign(reference_.particles(), 0.0f);
  pair_strands();
  for (const Pair& pair : pairs_) place(pair);
  cell_ = grid_cell(scene_, header);
  if (penetration) penetration_.emplace(scene_, header);
  if (penetration_ && !penetration_->measures()) penetration_.reset();
}

// Strands of the same number of the same groom, roots permitting.
void Measure::pair_strands() {
  const state::RunHeader& reference = reference_.header();
  const double scale = run_.metres_per_unit / reference.metres_per_unit;
  std::vector<std::vector<std::size_t>> by_groom;
  for (std::size_t s = 0; s + 1 < run_.offsets.size(); ++s) {
    const auto groom = static_cast<std::size_t>(run_.groom_of_strand[s]);
    by_groom.resize(std::max(by_groom.size(), groom + 1));
    by_groom[groom].push_back(s);
  }
  std::vector<std::size_t> next(by_groom.size(), 0);
  for (std::size_t s = 0; s + 1 < reference.offsets.size(); ++s) {
    const auto groom = static_cast<std::size_t>(reference.groom_of_strand[s]);
    if (groom >= by_groom.size() || next[groom] == by_groom[groom].size()) continue;
    const Pair pair{by_groom[groom][next[groom]++], s};
    const double length = length_of(reference.rest_position, reference.offsets[s], reference.offsets[s + 1]);
    const Vec3 apart = scale * point(run_.rest_position, run_.offsets[pair.run]) -
                       point(reference.rest_position, reference.offsets[s]);
    if (apart.norm() <= kSameRoot * length) pairs_.push_back(pair);
  }
}

// Where the reference's particles lie among the run's of the same strand.
void Measure::place(const Pair& pair) {
  const state::RunHeader& reference = reference_.header();
  const std::int64_t first = reference.offsets[pair.reference], end = reference.offsets[pair.reference + 1];
  const std::int64_t run_first = run_.offsets[pair.run], run_end = run_.offsets[pair.run + 1];
  if (end - first == run_end - run_first) {
    for (std::int64_t i = first; i < end; ++i) from_[static_cast<std::size_t>(i)] = run_first + i - first;
    return;
  }
  resampled_ = true;
  const double length = length_of(reference.rest_position, first, end),
               run_length = length_of(run_.rest_position, run_first, run_end);
  double along = 0;              // the reference's parameter
  double before = 0, after = 0;  // the run's at particle `at` and the next
  std::int64_t at = run_first;
  const auto segment = [&](std::int64_t i) {
    return run_length > 0 ? length_of(run_.rest_position, i, i + 2) / run_length : 0;
  };
  if (at + 1 < run_end) after = segment(at);
  for (std::int64_t i = first; i < end; ++i) {
    if (i > first && length > 0) along += length_of(reference.rest_position, i - 1, i + 1) / length;
    while (after < along && at + 2 < run_end) before = after, after += segment(++at);
    const auto k = static_cast<std::size_t>(i);
    from_[k] = at;
    share_[k] =
        after > before ? static_cast<float>(std::clamp((along - before) / (after - before), 0.0, 1.0)) : 0.0f;
  }
}

// The run's values at the reference's particles, in the reference's units.
std::vector<float> Measure::at_reference(const std::vector<float>& values) const {
  const double scale = run_.metres_per_unit / reference_.header().metres_per_unit;
  std::vector<float> placed(3 * from_.size(), 0.0f);
  tbb::parallel_for(std::size_t{0}, from_.size(), [&](std::size_t i) {
    if (from_[i] < 0) return;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t at = 3 * static_cast<std::size_t>(from_[i]) + c;
      const double share = share_[i];
      const double value = share > 0 ? (1 - share) * values[at] + share * values[at + 3] : values[at];
      placed[3 * i + c] = static_cast<float>(scale * value);
    }
  });
  return placed;
}

void Measure::add_distances(const std::vector<float>& run, const std::vector<float>& reference,
                            SpreadOf& to) const {
  for (std::size_t i = 0; i < from_.size(); ++i)
    if (from_[i] >= 0)
      to.add(
          (point(run, static_cast<std::int64_t>(i)) - point(reference, static_cast<std::int64_t>(i))).norm());
}

void Measure::add_to_strands(const std::vector<float>& run, const std::vector<float>& reference) {
  const auto& offsets = reference_.header().offsets;
  squares_.resize(pairs_.size(), 0.0), ++frames_;
  tbb::parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t k) {
    const std::size_t strand = pairs_[k].reference;
    double squares = 0;
    for (std::int64_t i = offsets[strand]; i < offsets[strand + 1]; ++i)
      squares += (point(run, i) - point(reference, i)).squaredNorm();
    squares_[k] += squares / static_cast<double>(offsets[strand + 1] - offsets[strand]);
  });
}

std::optional<double> Measure::median_strand() const {
  if (squares_.empty()) return std::nullopt;
  std::vector<double> squares = squares_;
  for (double& value : squares)
    if (std::isnan(value)) value = std::numeric_limits<double>::infinity();
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle / static_cast<double>(frames_));
}

void Measure::add_lengths(const state::Frame& run, const state::Frame& reference) {
  const state::RunHeader& header = reference_.header();
  std::vector<double> difference(pairs_.size(), 0.0);
  tbb::parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t k) {
    const Pair& pair = pairs_[k];
    const auto stretch = [](const state::RunHeader& of, const std::vector<float>& position,
                            std::size_t strand) {
      const std::int64_t first = of.offsets[strand], end = of.offsets[strand + 1];
      const double rest = length_of(of.rest_position, first, end);
      return rest > 0 ? length_of(position, first, end) / rest : 1.0;
    };
    difference[k] =
        std::abs(stretch(run_, run.position, pair.run) - stretch(header, reference.position, pair.reference));
  });
  for (const double value : difference) length_.add(value);
}

void Measure::add_volume(const state::Frame& run, const state::Frame& reference,
                         const std::vector<float>& placed) {
  const auto of_mesh = figure(run, "mesh_volume"), of_reference = figure(reference, "mesh_volume");
  if (of_mesh && of_reference) volume_.add(std::abs(*of_mesh / *of_reference - 1));
  if (!(cell_ > 0)) return;
  const auto& offsets = reference_.header().offsets;
  const auto held = static_cast<double>(cubes(reference.position, offsets, from_, cell_));
  if (held > 0) volume_.add(std::abs(static_cast<double>(cubes(placed, offsets, from_, cell_)) / held - 1));
}

void Measure::write(state::Frame frame, state::Snapshot, double) {
  if (frame.number == scene_.frames.first && scene_.frames.preroll == 0) return;
  const state::Frame reference = reference_.read(frame.number);
  for (const float x : reference.position) extent_ = std::max(extent_, static_cast<double>(std::abs(x)));
  if (!pairs_.empty()) {
    const std::vector<float> placed = at_reference(frame.position);
    add_distances(placed, reference.position, position_);
    add_to_strands(placed, reference.position);
    add_distances(at_reference(frame.velocity), reference.velocity, velocity_);
    add_lengths(frame, reference);
    add_volume(frame, reference, placed);
  }
  if (penetration_) penetration_->add(reference.surface_vertices, run_, frame, depth_);
}

Errors Measure::errors() const {
  return {position_.spread(), velocity_.spread(), length_.spread(),
          volume_.spread(),   depth_.spread(),    static_cast<std::int64_t>(pairs_.size()),
          median_strand()};
}

Errors measure_cache(const scene::Scene& scene, const cache::CacheReader& reference,
                     const cache::CacheReader& run, double* extent) {
  Measure measure(scene, reference, run.header(), false);
  for (const int frame : run.frames()) measure.write(run.read(frame), {}, 0);
  if (extent) *extent = measure.extent();
  return measure.errors();
}

}  // namespace ringlet::study
