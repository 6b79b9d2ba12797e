#include "stability/suite.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "stability/bounds.h"

namespace ringlet::stability {

TEST_P(Stability, StaysWithinItsBounds) { hold(GetParam()); }

std::vector<Scenario> everywhere(const std::vector<Scenario>& cases, const std::vector<Model>& models,
                                 const std::vector<Machine>& machines) {
  std::vector<Scenario> all;
  for (const Scenario& one : cases)
    for (const Model model : models)
      for (const Machine machine : machines) {
        Scenario& scenario = all.emplace_back(one);
        scenario.model = model, scenario.machine = machine;
        if (model == Model::kMassSpring) scenario.set.insert(scenario.set.begin(), "/model/drag=2");
      }
  return all;
}

std::string moved_roots(double seconds, const std::function<Vec3(double)>& place,
                        const std::function<double(double)>& turn, const char* pointer) {
  std::string keys;
  const int steps = static_cast<int>(std::lround(seconds / kStep));
  for (int k = 0; k <= steps; ++k) {
    const double time = k * kStep, half = turn ? 0.5 * turn(time) : 0;
    const Vec3 at = place(time);
    keys += fmt::format(
        "{}{{\"frame\": {:.9g}, \"translate\": [{:.12g}, {:.12g}, {:.12g}], \"rotate\": [0, {:.12g}, 0, "
        "{:.12g}]}}",
        k ? ", " : "", 24 * time, at.x(), at.y(), at.z(), std::sin(half), std::cos(half));
  }
  return fmt::format("{}={{\"interpolation\": \"linear\", \"keys\": [{}]}}", pointer, keys);
}

std::string shaken_roots(double amplitude, double hertz, double seconds, const char* pointer) {
  return moved_roots(
      seconds,
      [=](double t) {
        const double phase = 2 * std::numbers::pi * hertz * t;
        return Vec3(amplitude * (1 - std::cos(phase)), 0,
                    0.5 * amplitude * std::sin(phase) * std::sin(phase));
      },
      {}, pointer);
}

double speed_of_shake(double amplitude, double hertz) {
  return 2 * std::numbers::pi * hertz * amplitude * 1.2;
}

}  // namespace ringlet::stability
