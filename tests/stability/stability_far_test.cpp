// A scene 10 km from the origin is the same scene: hair lives in the frame of its own root, solids and grids
// in their own axes; places in the world are in double.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "stability/suite.h"

namespace ringlet::stability {
namespace {

const Vec3 kFar(10000, -2000, 10000);  // [m]

struct Place {
  const char* name;
  std::function<void(Scenario&, const Vec3& origin)> make;
};

std::string at(const Vec3& place) {
  return fmt::format("[{:.17g}, {:.17g}, {:.17g}]", place.x(), place.y(), place.z());
}

// The groom's own points are there, and its roots are shaken.
void shake(Scenario& scenario, const Vec3& origin) {
  for (Strand& strand : scenario.hair)
    for (Vec3& x : strand) x += origin;
  scenario.set.push_back(shaken_roots(0.05, 3, 1));
}
// Keys carry it there.
void carry(Scenario& scenario, const Vec3& origin) {
  scenario.set.push_back(
      moved_roots(1, [=](double t) { return Vec3(origin + Vec3(0.05 * std::sin(20 * t), 0, 0)); }));
}
// Eddies are those of the place, so the wind has none.
void blow(Scenario& scenario, const Vec3& origin) {
  shake(scenario, origin);
  scenario.set.push_back("/effects/wind={\"velocity\": [6, 0, 1], \"gusts\": {\"strength\": 0.5}}");
}
// A slab that falls on the hair.
void collide(Scenario& scenario, const Vec3& origin) {
  shake(scenario, origin);
  scenario.boxes = {{"slab", Vec3(0.3, 0.02, 0.3)}};
  scenario.set.push_back(fmt::format(
      "/effects/solids=[{{\"source\": \"slab.obj\", \"resolution\": 48, \"animation\": {{"
      "\"keys\": [{{\"frame\": 4, \"translate\": {}}}, {{\"frame\": 16, \"translate\": {}}}]}}}}]",
      at(origin + Vec3(0, 0.2, 0)), at(origin + Vec3(0, 0.03, 0))));
}
void on_hair(Scenario& scenario, const Vec3& origin) {
  shake(scenario, origin);
  scenario.set.push_back(
      "/effects/hair_hair={\"contacts\": {\"radius\": 1e-3}, \"grid\": {\"resolution\": 16}}");
}

class FarAway : public testing::TestWithParam<std::tuple<Place, Model, Machine>> {};

// Of roots that move the world's coordinates keep 2e-12 m, and a step makes a velocity of that; in single
// precision differences of places are rounded to it once, which is no matter of where they are. A micrometre
// and a tenth of a millimetre are what straight hair that is pushed along itself, and buckles, makes of that
// in half a second. Mass springs choose between altitudes by less: they are compared for two frames,
// and without straight hair, two of whose altitudes are equal.
TEST_P(FarAway, IsTheSameScene) {
  const auto& [place, model, machine] = GetParam();
  Scenario near{.name = place.name, .model = model, .machine = machine};
  near.seconds = model == Model::kAms ? 0.5 : 0.1;
  if (model == Model::kMassSpring) near.hair = {few_strands()[2], few_strands()[3]};
  Scenario far = near;
  place.make(near, Vec3::Zero()), place.make(far, kFar);
  const Outcome here = run(near), there = run(far);
  ASSERT_EQ(here.diverged + there.diverged, "");
  ASSERT_EQ(here.last.size(), there.last.size());
  double apart = 0, shown = 0;
  for (std::size_t i = 0; i < here.last.size(); ++i) {
    apart = std::max(apart, (there.last[i] - here.last[i]).norm());
    for (int c = 0; c < 3; ++c)
      shown = std::max(shown, std::abs(there.shown[3 * i + c] - kFar[c] - here.shown[3 * i + c]));
  }
  const double bound = in_double(machine) ? 1e-6 : 1e-4;
  RecordProperty("apart", fmt::format("{:.6g}", apart));
  RecordProperty("apart_bound", fmt::format("{:.6g}", bound));
  EXPECT_TRUE(apart <= bound) << "hair is " << apart << " m from where it is at the origin";
  // The cache holds single precision: half a spacing of floats at 10 km.
  const double rounding = 0.5 * 0x1p-10 + bound;
  EXPECT_TRUE(shown <= rounding) << "frames are " << shown << " m apart";
}

INSTANTIATE_TEST_SUITE_P(Places, FarAway,
                         testing::Combine(testing::Values(Place{"shaken", shake}, Place{"carried", carry},
                                                          Place{"wind", blow}, Place{"solid", collide},
                                                          Place{"hair_hair", on_hair}),
                                          testing::ValuesIn(kStrandModels), testing::ValuesIn(kPrecisions)),
                         [](const auto& info) {
                           return std::string(std::get<0>(info.param).name) + "_" +
                                  name_of(std::get<1>(info.param)) + "_" + name_of(std::get<2>(info.param));
                         });

}  // namespace
}  // namespace ringlet::stability
