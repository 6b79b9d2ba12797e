// Solids that no animator meant: they close on hair, appear around it, are thinner than their voxels, hold it
// inside.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "stability/suite.h"

namespace ringlet::stability {
namespace {

constexpr double kNear = 0.01;  // [m]

struct Key {
  double frame;
  Vec3 place;
};
std::string solid(const char* name, const std::vector<Key>& keys, const char* called = "solid") {
  std::string text;
  for (const Key& key : keys)
    text += fmt::format("{}{{\"frame\": {}, \"translate\": [{}, {}, {}]}}", text.empty() ? "" : ", ",
                        key.frame, key.place.x(), key.place.y(), key.place.z());
  return fmt::format(
      "{{\"source\": \"{}.obj\", \"name\": \"{}\", \"resolution\": 48, \"animation\": {{\"interpolation\": "
      "\"linear\", "
      "\"keys\": [{}]}}}}",
      name, called, text);
}
std::string solids(const std::vector<std::string>& each) {
  std::string text;
  for (const std::string& one : each) text += (text.empty() ? "" : ", ") + one;
  return "/effects/solids=[" + text + "]";
}

// All roots in the plane y = 0.
std::vector<Strand> flat_hair() {
  return {straight(Vec3::Zero(), Vec3::UnitX()), straight(Vec3(0, 0, kNear), Vec3(1, 0, 1)),
          helix(Vec3(kNear, 0, 0), Vec3(1, 0, 0.3)), helix(Vec3(0, 0, -kNear), Vec3(1, 0, -1))};
}

Scenario among(const char* name, std::string each, std::map<std::string, Vec3> boxes, double speed,
               double calm, bool pressed) {
  Scenario scenario{.name = name, .hair = flat_hair(), .set = {std::move(each)}, .seconds = calm + 10};
  scenario.solid = speed, scenario.calm = calm, scenario.pressed = pressed, scenario.boxes = std::move(boxes);
  return scenario;
}

// Two slabs that close to `gap` from 10 cm to either side within `frames`.
Scenario closing(const char* name, double frames, double gap) {
  const double half = 0.02, far = 0.1 + half, near = 0.5 * gap + half;
  const auto slab = [&](double side) {
    return solid("slab", {{6, Vec3(0, side * far, 0)}, {6 + frames, Vec3(0, side * near, 0)}},
                 side > 0 ? "above" : "below");
  };
  return among(name, solids({slab(1), slab(-1)}), {{"slab", Vec3(0.3, half, 0.3)}},
               (far - near) / std::max(frames / 24, kStep), (6 + frames) / 24, true);
}
// From 2 m away to where the hair is, within a substep.
Scenario appearing(const char* name, const Vec3& half, const Vec3& place) {
  return among(name, solids({solid("box", {{6, place + Vec3(0, 2, 0)}, {6.01, place}})}), {{"box", half}},
               2 / kStep, 0.26, true);
}
// A needle 30 cm long across the hair.
Scenario needle(const char* name, double radius, double speed) {
  const double way = 0.3;
  return among(name,
               solids({solid("needle", {{6, Vec3(0.1, 0.5 * way, 0)},
                                        {6 + 24 * way / speed, Vec3(0.1, -0.5 * way, 0)}})}),
               {{"needle", Vec3(radius, radius, 0.3)}}, speed, 0.25 + way / speed, true);
}
Scenario inside(const char* name, const Vec3& half) {
  return among(name, solids({solid("box", {{0, Vec3::Zero()}})}), {{"box", half}}, 0, 0, true);
}
// Hair that grows into its head.
Scenario inside_out(const char* name, const char* penetration) {
  Scenario scenario = among(name, solids({"{\"source\": \"head\", \"resolution\": 48}"}),
                            {{"head", Vec3(0.15, 0.1, 0.15)}}, 0, 0, true);
  for (Strand& strand : scenario.hair) {
    const Vec3 root = strand[0];
    for (Vec3& x : strand)
      x = Vec3(root.x(), 0.1, root.z()) + Vec3(0.2 * x.x(), -(x - root).norm(), x.z() - root.z());
  }
  scenario.set.insert(scenario.set.begin(), {"/head={\"mesh\": \"head.obj\"}", "/groom/attach=\"nearest\"",
                                             fmt::format("/groom/penetration=\"{}\"", penetration)});
  return scenario;
}

const std::vector<Scenario> kSolids = {closing("slabs_close_to_4_mm", 6, 0.004),
                                       closing("slabs_close_to_4_mm_in_a_frame", 1, 0.004),
                                       closing("slabs_close_over_each_other", 6, -0.01),
                                       appearing("box_appears_around_all", {0.4, 0.4, 0.4}, {0, 0, 0}),
                                       needle("needle_of_2_mm_at_1_m_per_s", 0.001, 1),
                                       needle("needle_of_half_a_mm_at_10_m_per_s", 0.00025, 10),
                                       inside("inside_a_box", {0.4, 0.4, 0.4}),
                                       inside_out("inside_out_pushed_out", "push_out")};

// Mass springs that are pressed on skin against their rest shape tremble.
const std::vector<Scenario> kBoxOnTips = {
    appearing("box_appears_around_tips", {0.05, 0.05, 0.3}, {0.17, 0, 0})};
INSTANTIATE_TEST_SUITE_P(SolidsInDouble, Stability,
                         testing::ValuesIn(everywhere(kBoxOnTips, kStrandModels, {Machine::kDouble})),
                         case_name);
INSTANTIATE_TEST_SUITE_P(Solids, Stability, testing::ValuesIn(everywhere(kSolids)), case_name);

// Hair that is kept in its head by its rest shape, and pushed out by the head: pressed onto edges, where it
// never quite comes to rest. It is no faster than it moves, by the difference of two runs of which one is a
// step longer.
TEST(Solids, KeepsNoSpeedInWhatTheyPress) {
  constexpr double kSteps = 192;  // a second
  Scenario scenario = inside_out("inside_out_kept", "keep");
  for (const char* set : {"/frames/fps=192", "/model/substeps=1"}) scenario.set.emplace_back(set);
  scenario.seconds = 2;
  const Outcome before = run(scenario);
  scenario.seconds += 1 / kSteps;
  const Outcome after = run(scenario);
  ASSERT_EQ(after.frames, before.frames + 1);
  double moved = 0;
  for (std::size_t i = 0; i < after.last.size(); ++i)
    moved = std::max(moved, (after.last[i] - before.last[i]).norm());
  EXPECT_LE(after.last_speed, kSteps * moved + 1e-9);
}

// Hairs that grow from a ring to its middle, each a little above the one before.
std::vector<Strand> ring(int hairs) {
  std::vector<Strand> strands;
  for (int s = 0; s < hairs; ++s) {
    const double turn = 2 * std::numbers::pi * s / hairs;
    const Vec3 out(std::cos(turn), 0, std::sin(turn));
    strands.push_back(straight(0.1 * out + Vec3(0, 0.024 * s / hairs, 0), -out));
  }
  return strands;
}

// Where hairs lie across one another, seen from above.
struct Crossings {
  double all = 0, upside_down = 0, deep = 0;  // what began above lies below; nearer than half the diameter

  void add(const std::vector<Strand>& hair, double diameter) {
    for (std::size_t upper = 0; upper < hair.size(); ++upper)
      for (std::size_t lower = 0; lower < upper; ++lower)
        for (int i = 0; i + 1 < kParticles; ++i)
          for (int k = 0; k + 1 < kParticles; ++k)
            add(hair[upper][i], hair[upper][i + 1], hair[lower][k], hair[lower][k + 1], diameter);
  }

 private:
  void add(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double diameter) {
    const auto across = [](const Vec3& u, const Vec3& w) { return u.x() * w.z() - u.z() * w.x(); };
    const double area = across(b - a, d - c);
    const double s = across(c - a, d - c) / area, u = across(c - a, b - a) / area;
    if (!(s >= 0 && s <= 1 && u >= 0 && u <= 1)) return;
    const double above = (a + s * (b - a)).y() - (c + u * (d - c)).y();
    ++all, upside_down += above < 0, deep += above < 0.5 * diameter;
  }
};

// Hair that falls on a floor, and on one another, stays in the order in which it fell, lies on one another,
// and lies still but for what it falls in a step before it is put back: 0.3 mm and 0.05 m/s. It lands at 1
// m/s, 5 mm a step, so some goes through some.
TEST(Solids, BearHairThatLiesOnHair) {
  constexpr double kRadius = 2e-4, kFloor = -0.03;  // [m]
  for (const char* cadence : {"substep", "frame"}) {
    Crossings crossings;
    for (const int hairs : {6, 12, 18, 24}) {
      SCOPED_TRACE(fmt::format("{} hairs, contacts each {}", hairs, cadence));
      Scenario scenario = among("hair_on_hair_on_a_floor", solids({solid("floor", {{0, Vec3(0, -0.05, 0)}})}),
                                {{"floor", Vec3(0.3, 0.02, 0.3)}}, 0, 0, true);
      scenario.machine = hairs % 4 == 0 ? Machine::kFloat : Machine::kDouble;
      scenario.hair = ring(hairs), scenario.seconds = 4;
      scenario.set.emplace_back("/model/preload=false");  // or it would not fall
      scenario.set.emplace_back(fmt::format(
          "/effects/hair_hair={{\"contacts\": {{\"radius\": {}, \"cadence\": \"{}\"}}}}", kRadius, cadence));
      const Outcome before = run(scenario);
      scenario.seconds += 1;
      const Outcome after = run(scenario);
      std::vector<Strand> lying = scenario.hair;
      double moved = 0;
      for (std::size_t s = 0; s < lying.size(); ++s)
        for (int i = 0; i < kParticles; ++i) {
          const std::size_t at = s * kParticles + i;
          lying[s][i] = scenario.hair[s][0] + after.last[at];
          moved = std::max(moved, (after.last[at] - before.last[at]).norm());
          if (2 * i > kParticles) EXPECT_LT(lying[s][i].y(), kFloor + 0.005);
        }
      crossings.add(lying, 2 * kRadius);
      fmt::print("{} hairs, contacts each {}: moved by {:.2g} mm in a second, at {:.2g} m/s\n", hairs,
                 cadence, 1e3 * moved, after.last_speed);
      EXPECT_LT(moved, 0.002);
      EXPECT_LT(after.last_speed, 2 * 9.81 * kStep);
    }
    fmt::print("contacts each {}: of {} crossings {} upside down, {} deep\n", cadence, crossings.all,
               crossings.upside_down, crossings.deep);
    EXPECT_GT(crossings.all, 300);
    EXPECT_LT(crossings.upside_down, 0.08 * crossings.all);
    EXPECT_LT(crossings.deep, 0.5 * crossings.all);
  }
}

// Hair that a solid jumps onto is moved no farther than the solid is wide, and is no faster than that.
TEST(Solids, LendNoSpeedToWhatTheyJumpOn) {
  constexpr double kHalf = 0.05;
  const Scenario scenario = appearing("box_jumps_on_tips", {kHalf, kHalf, 0.3}, {0.17, 0, 0});
  EXPECT_LE(run(scenario).speed, 2 * kHalf / kStep);
}

}  // namespace
}  // namespace ringlet::stability
