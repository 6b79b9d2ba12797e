// The helix whose motion is known: shape, shakes and expected figures, for the reference and for every kernel
// alike.
//
// 30 particles of unit mass, x_i = (L t, R (cos a - 1), R sin a) with t = i / 29, a = 8 pi t, L = 0.3 m, R =
// 0.02 m; gravity (0, -9.81, 0) m/s^2; default stiffness; consistent angular and exact integrity tangents;
// one clamped particle, no drag, no projection. It starts at rest on its ghosts and takes steps of 1/60 s, or
// substeps of that. The figures were found by two earlier implementations, dense and banded, in double
// precision.
#pragma once
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "oracle/ams_reference.h"

namespace ringlet::oracle {

inline constexpr int kHelixParticles = 30;
inline constexpr double kHelixStep = 1.0 / 60;  // [s]
inline constexpr int kRestSteps = 240;          // 4 s
inline constexpr int kConvergenceSteps = 63;    // 1.05 s

inline Points helix() {
  Points points(3, kHelixParticles);
  for (int i = 0; i < kHelixParticles; ++i) {
    const double t = i / double(kHelixParticles - 1);
    const double angle = 8 * std::numbers::pi * t;
    points.col(i) = Vec3(0.3 * t, 0.02 * (std::cos(angle) - 1), 0.02 * std::sin(angle));
  }
  return points;
}

// Root and ghosts together at z = amplitude (1 - cos(2 pi frequency t)).
struct Shake {
  double amplitude = 0, frequency = 1;  // [m], [Hz]

  RootPose at(double time) const {
    return {Mat3::Identity(), {0, 0, amplitude * (1 - std::cos(2 * std::numbers::pi * frequency * time))}};
  }
};

inline constexpr Shake kStill{};
inline constexpr Shake kViolentShake{0.3, 3};       // for kRestSteps
inline constexpr Shake kConvergenceShake{0.01, 1};  // for kConvergenceSteps

// An expected figure and the bounds within which a measured one reproduces it.
struct Figure {
  double value, lower, upper;

  bool matches(double measured) const { return measured >= lower && measured <= upper; }  // false for NaN
};

constexpr Figure quiet(double value) { return {value, 0.98 * value, 1.02 * value}; }
constexpr Figure noisy(double value) { return {value, value / 3, 3 * value}; }
constexpr Figure rounding(double value) { return {value, 0, 100 * value}; }
constexpr Figure convergence(double value) { return {value, 0.8 * value, 1.2 * value}; }

// The variant of the helix that a case is about.
struct HelixVariant {
  bool preload = true;
  bool ghosts = true;  // false: no integrity and no angular coupling
  bool geometric_stiffness = true;
  double damping = 0;  // [s] beta
};

inline Strand helix_strand(const HelixVariant& variant) {
  Stiffness stiffness;
  if (!variant.ghosts) stiffness.integrity = stiffness.angular = 0;
  Strand strand = make_strand(helix(), stiffness);
  strand.geometric_stiffness = variant.geometric_stiffness;
  strand.damping = variant.damping;
  if (variant.preload) preload_gravity(strand);
  return strand;
}

// Without motion, after kRestSteps: largest distance to the ghost [m], speed of the fastest particle [m/s],
// and the worst edge strain of any step.
struct RestCase {
  const char* name;
  HelixVariant variant;
  Figure distance, speed, strain;
};

inline const std::vector<RestCase>& rest_cases() {
  static const std::vector<RestCase> cases = {
      {"preload", {true, true, true, 0}, rounding(1e-16), rounding(2e-15), rounding(2e-15)},
      {"no_preload", {false, true, true, 0}, quiet(7.88e-2), quiet(3.2e-3), quiet(9.68e-3)},
      {"no_preload_damped", {false, true, true, 1.0 / 60}, quiet(7.868e-2), quiet(1.1e-5), quiet(9.68e-3)},
      {"no_preload_frozen_directions", {false, true, false, 0}, quiet(7.7e-2), noisy(3e-2), quiet(4.4e-2)},
      {"plain_springs", {false, false, true, 0}, quiet(0.538), quiet(7e-3), quiet(1.83e-2)},
      {"plain_springs_frozen_directions", {false, false, false, 0}, noisy(0.64), noisy(1.5), noisy(0.79)},
  };
  return cases;
}

// kViolentShake for kRestSteps steps of 1/60 s in `substeps` each: worst edge strain of any substep.
struct ShakeCase {
  const char* name;
  HelixVariant variant;
  int substeps;
  Figure strain;
};

inline const std::vector<ShakeCase>& shake_cases() {
  static const std::vector<ShakeCase> cases = {
      {"frozen_directions", {true, true, false, 0}, 1, {36, 10, 108}},
      {"geometric_stiffness", {true, true, true, 0}, 1, {0.67, 0.22, 1}},
      {"frozen_directions_4_substeps", {true, true, false, 0}, 4, noisy(1.8)},
      {"geometric_stiffness_4_substeps", {true, true, true, 0}, 4, noisy(0.13)},
  };
  return cases;
}

// kConvergenceShake for kConvergenceSteps: largest distance [m] of a particle at the end to where it is with
// kReferenceSubsteps, for each of kSubsteps.
inline constexpr int kReferenceSubsteps = 256;
inline constexpr std::array<int, 6> kSubsteps{1, 2, 4, 8, 16, 32};

struct ConvergenceCase {
  const char* name;
  HelixVariant variant;
  std::array<Figure, 6> error;
};

inline const std::vector<ConvergenceCase>& convergence_cases() {
  static const std::vector<ConvergenceCase> cases = {
      {"undamped",
       {true, true, true, 0},
       {convergence(5.3e-4), convergence(4.3e-4), convergence(3.0e-4), convergence(1.8e-4),
        convergence(9.1e-5), convergence(4.4e-5)}},
      {"damped",
       {true, true, true, 1.0 / 60},
       {convergence(1.8e-4), convergence(1.15e-4), convergence(6.2e-5), convergence(3.2e-5),
        convergence(1.6e-5), convergence(7.4e-6)}},
  };
  return cases;
}

struct HelixOutcome {
  State end;
  double distance;  // [m] largest distance to the ghost at the end
  double speed;     // [m/s] fastest particle at the end
  double strain;    // worst edge strain at the end of any substep
};

// Runs the strand through `steps` steps of kHelixStep, `substeps` each. `advance` is any implementation of
// one implicit step: State (const Strand&, const State&, const Step&).
template <class Advance>
HelixOutcome run_helix(const Strand& strand, const Shake& shake, int steps, int substeps, Advance&& advance) {
  const double h = kHelixStep / substeps;
  HelixOutcome outcome{rest_state(strand, shake.at(0)), 0, 0, 0};
  RootPose pose = shake.at(0);
  for (int k = 0; k < steps * substeps; ++k) {
    const Step step{pose, shake.at((k + 1) * h), h};
    outcome.end = advance(strand, outcome.end, step);
    outcome.strain = larger(outcome.strain, worst_edge_strain(strand, outcome.end.position));
    pose = step.after;
  }
  outcome.distance =
      (outcome.end.position - ghost(strand, pose)).colwise().norm().maxCoeff<Eigen::PropagateNaN>();
  outcome.speed = outcome.end.velocity.colwise().norm().maxCoeff<Eigen::PropagateNaN>();
  return outcome;
}

}  // namespace ringlet::oracle
