// Scenarios on every model and machine, each a test: INSTANTIATE_TEST_SUITE_P(Family, Stability, ...).
#pragma once
#include <gtest/gtest.h>

#include "stability/scenario.h"

namespace ringlet::stability {

class Stability : public testing::TestWithParam<Scenario> {};

inline std::string case_name(const testing::TestParamInfo<Scenario>& info) {
  return info.param.name + "_" + name_of(info.param.model) + "_" + name_of(info.param.machine);
}
inline void PrintTo(const Scenario& scenario, std::ostream* out) { *out << scenario.name; }

inline const std::vector<Model> kStrandModels = {Model::kAms, Model::kMassSpring};
inline const std::vector<Machine> kPrecisions = {Machine::kDouble, Machine::kFloat};
inline const std::vector<Machine> kAllMachines = {Machine::kDouble, Machine::kFloat, Machine::kGeneric,
                                                  Machine::kCuda};

// Every case on every model and machine. Nothing but drag lets a chain that is held by no ghosts come to
// rest.
std::vector<Scenario> everywhere(const std::vector<Scenario>& cases,
                                 const std::vector<Model>& models = kStrandModels,
                                 const std::vector<Machine>& machines = kPrecisions);

// Settings as `--set` takes them.

// Roots of the groom moved by keys: to `place(t)` [m] and turned by `turn(t)` radians about y, until
// `seconds`.
std::string moved_roots(double seconds, const std::function<Vec3(double)>& place,
                        const std::function<double(double)>& turn = {},
                        const char* pointer = "/groom/animation");
// To and fro along x and z, from rest to rest.
std::string shaken_roots(double amplitude, double hertz, double seconds,
                         const char* pointer = "/groom/animation");
double speed_of_shake(double amplitude, double hertz);  // its fastest [m/s]
inline constexpr double kStep = 1.0 / 192;              // of the scenarios, unless they say otherwise [s]

}  // namespace ringlet::stability
