#include "core/random.h"

#include <cmath>

namespace ringlet {

std::array<double, 2> cos_sin(double angle) {
  // Half of pi in two parts, the first of few enough bits that its multiples are exact.
  constexpr double kHalfPiHigh = 0x1.921fb544p+0, kHalfPiLow = 0x1.0b4611a626331p-34;
  const double turns = std::floor(angle / (kHalfPiHigh + kHalfPiLow) + 0.5);
  const double r = (angle - turns * kHalfPiHigh) - turns * kHalfPiLow;
  double cosine = 0, sine = 0;
  for (int n = 18; n > 0; n -= 2) {  // Horner, smallest terms first
    cosine = (1 - cosine) * r * r / (n * (n - 1));
    sine = (1 - sine) * r * r / (n * (n + 1));
  }
  const double c = 1 - cosine, s = r * (1 - sine);
  switch (static_cast<long long>(turns) & 3) {
    case 0:
      return {c, s};
    case 1:
      return {-s, c};
    case 2:
      return {-c, -s};
    default:
      return {s, -c};
  }
}

}  // namespace ringlet
