// Random numbers and the circular functions that are the same on every machine.
//
// The standard's engines are portable, its distributions are not, and libm's sine differs between versions in
// the last bit: growth and noise must not.
#pragma once
#include <array>
#include <cstdint>

namespace ringlet {

// SplitMix64 (Steele, Lea, Flood 2014): one stream for each (seed, stream) pair.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream) : state_(mix(seed) ^ mix(~stream)) {}

  // U(0, 1), never 1.
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  // U(-1, 1).
  double symmetric() { return 2 * uniform() - 1; }

 private:
  static constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15;
  static std::uint64_t mix(std::uint64_t z) {
    z += kGolden;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }
  std::uint64_t next() {
    const std::uint64_t value = mix(state_);
    state_ += kGolden;
    return value;
  }

  std::uint64_t state_;
};

// Cosine and sine of an angle [rad], within 1e-15 for angles up to 1e5: a quarter-turn reduction and Taylor
// series.
std::array<double, 2> cos_sin(double angle);

}  // namespace ringlet
