// Springs from soft to as stiff as the precision can tell, lengths free: still, shaken, and shaken at one
// step a frame.
#include <fmt/format.h>

#include <cmath>

#include "stability/suite.h"

namespace ringlet::stability {
namespace {

std::vector<std::string> springs(int power) {
  std::vector<std::string> set = {"/effects/inextensible=null"};
  for (const char* coupling : {"edge", "bend", "twist"})
    set.push_back(fmt::format("/model/stiffness/{}=1e{}", coupling, power));
  return set;
}

Scenario still(int power) { return {.name = fmt::format("1e{}_still", power), .set = springs(power)}; }
Scenario shaken(int power, int substeps) {
  std::vector<std::string> set = springs(power);
  set.push_back(shaken_roots(0.1, 3, 1));
  set.push_back(fmt::format("/model/substeps={}", substeps));
  // Springs lock where a step is long for them: what strains them by turning is resisted too.
  const bool creeps = power >= (substeps == 1 ? 8 : 12);
  return {.name = fmt::format("1e{}_shaken{}", power, substeps == 1 ? "_one_substep" : ""),
          .set = std::move(set),
          .seconds = 13,
          .driven = speed_of_shake(0.1, 3),
          .calm = 1,
          .creeps = creeps};
}

std::vector<Scenario> up_to(int highest) {
  std::vector<Scenario> all;
  for (int power = 3; power <= highest; ++power)
    all.insert(all.end(), {still(power), shaken(power, 8), shaken(power, 1)});
  return all;
}

INSTANTIATE_TEST_SUITE_P(Stiffness, Stability,
                         testing::ValuesIn(everywhere(up_to(12), kStrandModels, {Machine::kDouble})),
                         case_name);
INSTANTIATE_TEST_SUITE_P(StiffnessInFloat, Stability,
                         testing::ValuesIn(everywhere(up_to(9), kStrandModels, {Machine::kFloat})),
                         case_name);
INSTANTIATE_TEST_SUITE_P(StiffnessElsewhere, Stability,
                         testing::ValuesIn(everywhere({shaken(6, 8), shaken(9, 1)}, kStrandModels,
                                                      {Machine::kGeneric, Machine::kCuda})),
                         case_name);

}  // namespace
}  // namespace ringlet::stability
