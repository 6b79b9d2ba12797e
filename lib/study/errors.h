// Sizes of errors: root mean square and 99th percentile of many, in memory that does not grow with them.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ringlet::study {

struct Spread {
  double rms = 0;
  double p99 = 0;  // 99 % are no larger (nearest rank), to half a per cent
};

// Gathers values of at least 0. One that is not finite makes both figures infinite.
class SpreadOf {
 public:
  void add(double value);
  std::optional<Spread> spread() const;  // nothing of nothing

 private:
  // Bins of equal ratio, 64 to an octave, from 2^kLowest to 2^kHighest.
  static constexpr int kBins = 64, kLowest = -100, kHighest = 60;
  std::array<std::int64_t, static_cast<std::size_t>(kBins) * (kHighest - kLowest)> counts_{};
  std::int64_t zeros_ = 0, infinite_ = 0, count_ = 0;
  double squares_ = 0;
};

// How far a run is from the reference; empty: not measured.
struct Errors {
  std::optional<Spread> position;     // distances of particles, over particles and frames [scene units]
  std::optional<Spread> velocity;     // differences of their velocities [scene units per second]
  std::optional<Spread> length;       // of strands, the length over that at rest less the reference's [-]
  std::optional<Spread> volume;       // of frames, the hair's volume over the reference's, less one [-]
  std::optional<Spread> penetration;  // depth of particles in solids: the run's own [scene units]
  std::int64_t strands = 0;           // compared
  std::optional<double>
      median_strand;  // median over strands of the RMS over a strand's particles and frames: few
                      // strands that part with every step size do not show [scene units]

  // By their names in study.json and, with `_rms` and `_p99`, in study.csv.
  std::vector<std::pair<std::string, std::optional<Spread>>> named() const {
    return {{"error", position},
            {"velocity", velocity},
            {"length", length},
            {"volume", volume},
            {"penetration", penetration}};
  }
};

}  // namespace ringlet::study
