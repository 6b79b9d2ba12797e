// Weight, wind and mass beyond what hair meets, and hair that nothing holds to its shape.
#include <fmt/format.h>

#include "stability/suite.h"

namespace ringlet::stability {
namespace {

// Shaken for a second, then left alone.
Scenario shaken(const char* name, std::vector<std::string> set) {
  set.push_back(shaken_roots(0.05, 3, 1));
  return {.name = name, .set = std::move(set), .seconds = 13, .driven = speed_of_shake(0.05, 3), .calm = 1};
}
Scenario let_go(const char* name, std::vector<std::string> set) {
  set.insert(set.begin(), "/model/preload=false");
  return {.name = name, .set = std::move(set), .seconds = 12};
}

const std::string kNoGravity = "/effects/gravity=null", kHeavy = "/effects/gravity=[0, -981, 0]",
                  kSideways = "/effects/gravity=[9.81, 0, 0]", kUp = "/effects/gravity=[0, 98.1, 0]",
                  kNoIntegrity = "/model/stiffness/integrity=0", kDrag = "/model/drag=2";

const std::vector<Scenario> kWeights = {shaken("no_gravity", {kNoGravity}),
                                        shaken("100_g", {kHeavy}),
                                        shaken("sideways", {kSideways}),
                                        let_go("100_g_let_go", {kHeavy}),
                                        let_go("sideways_let_go", {kSideways}),
                                        let_go("10_g_upwards_let_go", {kUp}),
                                        let_go("100_g_let_go_one_substep", {kHeavy, "/model/substeps=1"})};
INSTANTIATE_TEST_SUITE_P(Weights, Stability, testing::ValuesIn(everywhere(kWeights)), case_name);

// What the wind has tangled at one step a frame, what still air holds fast, and weight that angular couplings
// all but carry give way slowly.
Scenario creeping(Scenario scenario) {
  scenario.creeps = true;
  return scenario;
}
// Only drag brings them to rest.
const std::vector<Scenario> kUnheld = {
    creeping(shaken("kappa_I_0", {kNoIntegrity, kDrag})),
    creeping(let_go("kappa_I_0_let_go", {kNoIntegrity, kDrag})),
    shaken("kappa_I_0_kappa_alpha_0", {kNoIntegrity, "/model/stiffness/angular=0", kDrag}),
    shaken("kappa_alpha_1e6", {"/model/stiffness/angular=1e6"}),
    shaken("kappa_I_1e6", {"/model/stiffness/integrity=1e6"}),
    shaken("broken_integrity", {"/effects/non_hookean={\"curve\": [[0.02, 0.02], [0.05, 0.03]]}", kDrag})};
INSTANTIATE_TEST_SUITE_P(Unheld, Stability, testing::ValuesIn(everywhere(kUnheld, {Model::kAms})), case_name);

// Blows for a second.
Scenario blown(const char* name, double speed, std::vector<std::string> set = {}, double eddies = 0) {
  const std::string turbulence =
      eddies > 0 ? fmt::format(", \"turbulence\": {{\"strength\": {}, \"scale\": 0.1}}", eddies) : "";
  set.insert(set.begin(), fmt::format("/effects/wind={{\"keys\": [{{\"frame\": 0, \"velocity\": [0, 0, 0]}}, "
                                      "{{\"frame\": 1, \"velocity\": [{0}, {0}, {0}]}}, {{\"frame\": 24, "
                                      "\"velocity\": [{0}, {0}, {0}]}}, "
                                      "{{\"frame\": 25, \"velocity\": [0, 0, 0]}}]{1}}}",
                                      speed / std::sqrt(3.0), turbulence));
  // Eddies: 24 waves of amplitude sqrt(2 / 24) of their root mean square, all at once.
  return {
      .name = name, .set = std::move(set), .seconds = 12, .air = speed * (1 + 7 * eddies), .calm = 25.0 / 24};
}
const std::vector<Scenario> kWinds = {
    blown("wind_300", 300),
    creeping(blown("wind_300_one_substep", 300, {"/model/substeps=1"})),
    blown("wind_300_turbulent", 300, {}, 0.5),
    blown("wind_300_lengths_free", 300, {"/effects/inextensible=null"}),
    blown("particle_mass_2e6_wind_30", 30, {"/model/particle_mass=2e6"}),
    blown("particle_mass_1e9_wind_30", 30, {"/model/particle_mass=1e9"}),
    creeping(blown("particle_mass_1e_minus_6_wind_30", 30, {"/model/particle_mass=1e-6"})),
    shaken("particle_mass_1e9_shaken", {"/model/particle_mass=1e9"})};
INSTANTIATE_TEST_SUITE_P(Winds, Stability, testing::ValuesIn(everywhere(kWinds)), case_name);

}  // namespace
}  // namespace ringlet::stability
