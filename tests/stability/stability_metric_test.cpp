// Lengths corrected in the metric of the step: springs from soft to stiff, some much stiffer than the edges'
// own, heads that shake and vibrate, strands collapsed onto their roots.
#include <fmt/format.h>

#include "stability/suite.h"

namespace ringlet::stability {
namespace {

std::vector<std::string> in_step(const char* edge, const char* others) {
  return {R"(/effects/inextensible/metric="step")", fmt::format("/model/stiffness/edge={}", edge),
          fmt::format("/model/stiffness/bend={}", others), fmt::format("/model/stiffness/twist={}", others)};
}

Scenario shaken(const char* name, const char* edge, const char* others, double amplitude, double hertz,
                int substeps = 8, bool creeps = false) {
  std::vector<std::string> set = in_step(edge, others);
  set.push_back(shaken_roots(amplitude, hertz, 1));
  set.push_back(fmt::format("/model/substeps={}", substeps));
  return {.name = name,
          .set = std::move(set),
          .seconds = 13,
          .driven = speed_of_shake(amplitude, hertz),
          .calm = 1,
          .creeps = creeps};
}

Scenario collapsed() {
  const Start start = [](std::size_t, std::span<Vec3> x, std::span<Vec3> v) {
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = v[i] = Vec3::Zero();
  };
  return {.name = "collapsed", .set = in_step("1e6", "1e6"), .seconds = 13, .start = start};
}

const std::vector<Scenario> kInStep = {shaken("1e3", "1e3", "1e3", 0.1, 3),
                                       shaken("1e6", "1e6", "1e6", 0.1, 3),
                                       shaken("1e6_one_substep", "1e6", "1e6", 0.1, 3, 1),
                                       shaken("1e9", "1e9", "1e9", 0.1, 3),
                                       shaken("1e9_one_substep", "1e9", "1e9", 0.1, 3, 1, true),
                                       shaken("bends_stiffer_than_edges", "1e5", "1e6", 0.1, 3),
                                       shaken("vibrated", "1e6", "1e6", 0.005, 40),
                                       collapsed()};

INSTANTIATE_TEST_SUITE_P(LengthsInStep, Stability, testing::ValuesIn(everywhere(kInStep)), case_name);
INSTANTIATE_TEST_SUITE_P(LengthsInStepInDouble, Stability,
                         testing::ValuesIn(everywhere({shaken("1e12", "1e12", "1e12", 0.1, 3, 8, true)},
                                                      kStrandModels, {Machine::kDouble})),
                         case_name);

}  // namespace
}  // namespace ringlet::stability
