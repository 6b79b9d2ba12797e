// Roots that are moved as no head is.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "stability/suite.h"

namespace ringlet::stability {
namespace {

constexpr double kReach = kLength + 0.03;  // of the strands from the axis that they turn about [m]

Scenario moved(const char* name, std::string motion, double driven, double calm,
               std::vector<std::string> more = {}) {
  more.push_back(std::move(motion));
  return {.name = name, .set = std::move(more), .seconds = calm + 12, .driven = driven, .calm = calm};
}

Vec3 nowhere(double) { return Vec3::Zero(); }

// Within one substep, at half a second.
Scenario teleport(const char* name, double distance) {
  return moved(name, moved_roots(0.6, [=](double t) { return Vec3(t > 0.5 ? distance : 0, 0, 0); }),
               distance / kStep, 0.6);
}
// There and back every substep.
Scenario tremble(const char* name, double amplitude) {
  return moved(
      name, moved_roots(1, [=](double t) { return Vec3(0, std::lround(t / kStep) % 2 ? amplitude : 0, 0); }),
      amplitude / kStep, 1);
}
Scenario spin(const char* name, double turns, double seconds) {
  const double rate = 2 * std::numbers::pi * turns;
  return moved(name, moved_roots(seconds, nowhere, [=](double t) { return rate * t; }),
               std::min(rate * kReach, 2 * kReach / kStep), seconds);
}
Scenario shake(const char* name, double amplitude, double hertz, std::vector<std::string> more = {}) {
  return moved(name, shaken_roots(amplitude, hertz, 1), speed_of_shake(amplitude, hertz), 1, std::move(more));
}
// The scene's own motion, ten times as fast as it was made.
Scenario ten_times(const char* name, double amplitude, double hertz) {
  Scenario scenario =
      moved(name, shaken_roots(amplitude, hertz, 10, "/motion"), 10 * speed_of_shake(amplitude, hertz), 1);
  scenario.set.push_back("/motion/speed=10");
  return scenario;
}

const std::vector<Scenario> kRoots = {
    teleport("teleport_1_m", 1),
    teleport("teleport_100_m", 100),
    tremble("there_and_back_every_substep_1_cm", 0.01),
    tremble("there_and_back_every_substep_20_cm", 0.2),
    spin("spin_1_turn_a_second", 1, 1),
    spin("spin_100_turns_a_second", 100, 1),
    spin("spin_half_a_turn_a_substep", 0.5 / kStep, 1),
    shake("shake_30_cm_3_hertz", 0.3, 3),
    shake("vibrate_5_mm_40_hertz", 0.005, 40),
    shake("shake_30_cm_3_hertz_one_substep", 0.3, 3, {"/model/substeps=1"}),
    ten_times("ten_times_a_shake_of_10_cm_1_hertz", 0.1, 1),
    shake("shake_30_cm_3_hertz_clamped", 0.3, 3, {"/model/clamped_particles=2"})};

INSTANTIATE_TEST_SUITE_P(Roots, Stability, testing::ValuesIn(everywhere(kRoots)), case_name);

}  // namespace
}  // namespace ringlet::stability
