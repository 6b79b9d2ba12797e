// Measures a run against the reference, frame by frame.
#pragma once
#include <optional>
#include <string>

#include "cache/reader.h"
#include "scene/scene_desc.h"
#include "study/errors.h"
#include "study/penetration.h"

namespace ringlet::study {

// Strands are compared with those of the same number of the same groom, where the roots of the two agree at
// rest; particles at the reference's parameters, the arc length along the rest shape over the strand's. A run
// of other particles is taken linearly between them. The reference is read a frame at a time: one frame of
// either is held.
class Measure : public state::FrameSink {
 public:
  // `scene`: the reference's. Both must outlive this. `penetration` false leaves that out.
  Measure(const scene::Scene& scene, const cache::CacheReader& reference, state::RunHeader run,
          bool penetration = true);

  // Frames that nothing has stepped yet do not count.
  void write(state::Frame frame, state::Snapshot snapshot, double seconds) override;
  void finish() override {}

  Errors errors() const;
  // Whether some strands have another number of particles than the reference's.
  bool resampled() const { return resampled_; }
  double extent() const { return extent_; }  // largest coordinate seen in the reference [scene units]

 private:
  struct Pair {
    std::size_t run, reference;  // strands
  };
  void pair_strands();
  void place(const Pair& pair);
  std::vector<float> at_reference(const std::vector<float>& values) const;
  void add_distances(const std::vector<float>& run, const std::vector<float>& reference, SpreadOf& to) const;
  void add_to_strands(const std::vector<float>& run, const std::vector<float>& reference);
  std::optional<double> median_strand() const;
  void add_lengths(const state::Frame& run, const state::Frame& reference);
  void add_volume(const state::Frame& run, const state::Frame& reference, const std::vector<float>& placed);

  const scene::Scene& scene_;
  const cache::CacheReader& reference_;
  state::RunHeader run_;
  std::vector<Pair> pairs_;
  std::vector<std::int64_t> from_;  // [reference's particles] the run's particle before it; -1: not compared
  std::vector<float> share_;        // [reference's particles] how far on to the next
  std::vector<double> squares_;     // [pairs] of distances, over particles and frames
  std::int64_t frames_ = 0;         // of these
  bool resampled_ = false;
  double cell_ = 0;  // [scene units] of the cubes that hair's volume is counted in; 0: not measured
  double extent_ = 0;
  std::optional<Penetration> penetration_;
  SpreadOf position_, velocity_, length_, volume_, depth_;
};

// The run that a cache holds, measured against another of the same frames.
Errors measure_cache(const scene::Scene& scene, const cache::CacheReader& reference,
                     const cache::CacheReader& run, double* extent = nullptr);

}  // namespace ringlet::study
