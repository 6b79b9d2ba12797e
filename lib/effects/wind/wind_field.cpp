#include "effects/wind/wind_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/random.h"
#include "core/trace.h"

namespace ringlet::effects {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr int kModesOfOctave = 8;
static_assert(6 * kModesOfOctave == kernels::kMostModes);  // the schema's most octaves

Vec3 circle(double turns, const Vec3& x, const Vec3& y) {
  const auto [c, s] = cos_sin(kTurn * turns);
  return c * x + s * y;
}

// Uniform among all rotations (Shoemake 1992).
Mat3 random_rotation(Random& random) {
  const double u = random.uniform();
  const auto [ca, sa] = cos_sin(kTurn * random.uniform());
  const auto [cb, sb] = cos_sin(kTurn * random.uniform());
  const double a = std::sqrt(1 - u), b = std::sqrt(u);
  return Quat(b * cb, a * sa, a * ca, b * sb).toRotationMatrix();
}

double fraction(double turns) { return turns - std::floor(turns); }

}  // namespace

WindField::WindField(const scene::Wind& wind, const scene::Frames& frames, const Vec3& origin)
    : origin_(origin) {
  const trace::Span span("wind field", "set-up");
  for (const scene::WindKey& key : wind.keys)
    knots_.push_back({(key.frame - frames.first) / frames.fps, key.velocity});
  if (wind.gusts) make_gusts(*wind.gusts);
  if (wind.turbulence) make_modes(*wind.turbulence);
}

// Four sines of incommensurate rates about one a period; together at most `strength`.
void WindField::make_gusts(const scene::Gusts& gusts) {
  constexpr double kShare[] = {0.4, 0.3, 0.2, 0.1}, kRate[] = {1, 1.4142135624, 0.7320508076, 2.4494897428};
  Random random(static_cast<std::uint64_t>(gusts.seed), 0);
  for (int k = 0; k < 4; ++k)
    gusts_.push_back({gusts.strength * kShare[k], kTurn * kRate[k] / gusts.period, kTurn * random.uniform()});
}

// An eddy is half a wave; the speed of eddies goes with the cube root of their size (Kolmogorov 1941). Each
// octave's waves run in directions spread evenly over a hemisphere that is turned at random.
void WindField::make_modes(const scene::Turbulence& turbulence) {
  constexpr double kGoldenTurn = 0.6180339887498949;
  Random random(static_cast<std::uint64_t>(turbulence.seed), 1);
  double square = 0;  // mean of the squared speed
  for (int octave = 0; octave < turbulence.octaves; ++octave) {
    const Mat3 turn = random_rotation(random);
    for (int k = 0; k < kModesOfOctave; ++k) {
      const double up = (k + 0.5) / kModesOfOctave, flat = std::sqrt(1 - up * up);
      const Vec3 direction =
          turn * (circle(k * kGoldenTurn, flat * Vec3::UnitX(), flat * Vec3::UnitY()) + up * Vec3::UnitZ());
      const Vec3 across = direction.unitOrthogonal();
      const double size = turbulence.scale * std::exp2(-octave + 0.25 * random.symmetric());
      const double speed = std::cbrt(size);
      const Vec3 amplitude = speed * circle(random.uniform(), across, direction.cross(across));
      modes_.push_back({direction / (2 * size), amplitude, random.uniform()});
      square += 0.5 * speed * speed;
    }
  }
  for (Mode& mode : modes_) mode.amplitude /= std::sqrt(square);
  intensity_ = turbulence.strength;
}

Vec3 WindField::keyed(double time) const {
  const auto after = std::find_if(knots_.begin(), knots_.end(), [&](const Knot& k) { return k.time > time; });
  if (after == knots_.begin()) return after->velocity;
  const Knot& before = *std::prev(after);
  if (after == knots_.end()) return before.velocity;
  const double weight = (time - before.time) / (after->time - before.time);
  return before.velocity + weight * (after->velocity - before.velocity);
}

Vec3 WindField::mean(double time) const {
  double swell = 1;
  for (const Sine& sine : gusts_) swell += sine.amplitude * cos_sin(sine.rate * time + sine.phase)[1];
  return swell * keyed(time);
}

// Of w(t) (1 + sum A sin(r t + p)), w linear: the sine's part has the antiderivative
// A (-w cos(r t + p) / r + w' sin(r t + p) / r^2).
Vec3 WindField::carried(const Knot& from, const Knot& to) const {
  const double span = to.time - from.time;
  if (span == 0) return Vec3::Zero();
  Vec3 way = 0.5 * span * (from.velocity + to.velocity);
  const Vec3 slope = (to.velocity - from.velocity) / span;
  for (const Sine& sine : gusts_) {
    const auto antiderivative = [&](const Knot& at) -> Vec3 {
      const auto [c, s] = cos_sin(sine.rate * at.time + sine.phase);
      return sine.amplitude / sine.rate * (s / sine.rate * slope - c * at.velocity);
    };
    way += antiderivative(to) - antiderivative(from);
  }
  return way;
}

Vec3 WindField::travel(double time) const {
  const double begin = std::min(0.0, time), end = std::max(0.0, time);
  Vec3 way = Vec3::Zero();
  Knot last{begin, keyed(begin)};
  for (const Knot& knot : knots_) {
    if (knot.time <= begin || knot.time >= end) continue;
    way += carried(last, knot);
    last = knot;
  }
  way += carried(last, {end, keyed(end)});
  return time < 0 ? Vec3(-way) : way;
}

template <class T>
kernels::WindField<T> WindField::at(double time) const {
  kernels::WindField<T> field{};
  const Vec3 now = mean(time), way = travel(time);
  for (int c = 0; c < 3; ++c) field.mean[c] = static_cast<T>(now[c]), field.origin[c] = origin_[c];
  field.modes = static_cast<std::int32_t>(modes_.size());
  for (std::size_t n = 0; n < modes_.size(); ++n) {
    const Vec3 amplitude = intensity_ * now.norm() * modes_[n].amplitude;
    for (int c = 0; c < 3; ++c) {
      field.wave[n][c] = static_cast<T>(modes_[n].wave[c]);
      field.amplitude[n][c] = static_cast<T>(amplitude[c]);
    }
    field.phase[n] = static_cast<T>(fraction(modes_[n].phase + modes_[n].wave.dot(origin_ - way)));
  }
  return field;
}

template kernels::WindField<float> WindField::at(double) const;
template kernels::WindField<double> WindField::at(double) const;

}  // namespace ringlet::effects
