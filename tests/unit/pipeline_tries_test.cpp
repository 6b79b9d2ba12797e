// What the plan says that frames of substeps by tolerance hold, against what is allocated while one is tried.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include <nlohmann/json.hpp>

#include "pipeline/frame_times.h"
#include "pipeline/simulation.h"
#include "scene/scene.h"
#include "unit/pipeline_support.h"

namespace ringlet::pipeline {
namespace {

using nlohmann::json;

// While a frame's last try, of four substeps, takes its last one.
struct Held {
  std::int64_t allocated = 0;  // since before the simulation was made [bytes]
  std::int64_t state = 0;      // of the arrays of the state [bytes]
  std::int64_t positions = 0;  // values
  std::size_t planned = 0;     // of tries [bytes]
};

class PipelineTries : public testing::Test {
 protected:
  PipelineTries() { std::filesystem::create_directories(folder_); }
  ~PipelineTries() override { std::filesystem::remove_all(folder_); }

  void write(const char* name, const json& text) const { std::ofstream(folder_ / name) << text; }

  // A slab of `across` by `across` quads.
  void write_mesh(int across, int layers) const {
    json faces = json::array(), all = json::array();
    for (int l = 0; l < layers; ++l) {
      json layer = json::array();
      for (int z = 0; z <= across; ++z)
        for (int x = 0; x <= across; ++x) layer.push_back({0.01 * x, 0.02 * l, 0.01 * z});
      all.push_back(layer);
    }
    for (int z = 0; z < across; ++z)
      for (int x = 0; x < across; ++x) {
        const int here = z * (across + 1) + x;
        faces.push_back({here, here + across + 1, here + across + 2, here + 1});
      }
    write("mesh.json", {{"format", "ringlet-hair-mesh"},
                        {"version", 1},
                        {"units", {{"length", "m"}, {"up", "y"}}},
                        {"faces", faces},
                        {"layers", all}});
  }

  Held held(json scene, const json& substeps, Precision precision, const char* positions) const {
    scene["model"]["substeps"] = substeps;
    write("scene.json", scene);
    Options options;
    options.precision = precision, options.backend = Backend::kCpu;
    const scene::Scene loaded = scene::load(folder_ / "scene.json");
    Held held;
    const std::int64_t before = pipeline_testing::allocated();
    const auto simulation = Simulation::create(loaded, options);
    for (const PlannedStage& stage : simulation->plan().stages)
      if (stage.name == kTries) held.planned = stage.bytes;
    DiscardFrames sink;
    RunControl control;
    control.probe = [&](const std::string&, int, int substep, state::Snapshot& arrays) {
      if (substep != 3 || held.allocated != 0) return;
      for (const auto& [name, bytes] : arrays.arrays) {
        held.state += static_cast<std::int64_t>(bytes.size());
        if (name == positions)
          held.positions = static_cast<std::int64_t>(bytes.size() / (precision == Precision::kFloat ? 4 : 8));
      }
      held.allocated = pipeline_testing::allocated() - before;
    };
    simulation->run({1, 2}, sink, control);
    return held;
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("ringlet_tries_" + std::to_string(getpid()));
  const json chosen_ = {{"tolerance", 1e-12}, {"max", 4}};  // 1, 2 and 4 substeps
};

void expect_planned(const Held& chosen, std::int64_t expected) {
  EXPECT_GT(expected, 200000);
  EXPECT_NEAR(static_cast<double>(chosen.planned), static_cast<double>(expected),
              0.01 * static_cast<double>(expected));
}

// The state is allocated beside `new`, by the threads' own allocator: its copy is as large as it is. What the
// last try leads to comes on top, at its end.
TEST_F(PipelineTries, OfStrandsHoldWhatThePlanSays) {
  pipeline_testing::write_hair(folder_ / "hair.data", 1500, 6);
  const json plain = {{"name", "strands"},
                      {"frames", {{"last", 2}}},
                      {"groom", {{"file", "hair.data"}, {"attach", "fixed"}}},
                      {"model", {{"preload", false}}},
                      {"effects", {{"gravity", {0, -9.81, 0}}}}};
  json windy = plain;
  windy["effects"]["wind"] = {{"velocity", {2, 0, 0}}};
  windy["effects"]["non_hookean"] = json::object();
  json springs = plain;
  springs["model"]["type"] = "mass_spring";
  for (const json& scene : {plain, windy, springs})
    for (const Precision precision : {Precision::kFloat, Precision::kDouble}) {
      const Held chosen = held(scene, chosen_, precision, "position"),
                 fixed = held(scene, 4, precision, "position");
      SCOPED_TRACE(scene.dump());
      EXPECT_EQ(fixed.planned, 0u);
      EXPECT_EQ(fixed.state, chosen.state);
      expect_planned(chosen, chosen.allocated - fixed.allocated + chosen.state + 8 * chosen.positions);
    }
}

TEST_F(PipelineTries, OfHairMeshesHoldWhatThePlanSays) {
  write_mesh(40, 4);
  const json scene = {
      {"name", "mesh"},
      {"frames", {{"last", 2}}},
      {"groom",
       {{"hair_mesh", {{"file", "mesh.json"}, {"strands", 20}, {"particles", 6}}}, {"attach", "fixed"}}},
      {"model", {{"type", "hair_mesh"}}},
      {"effects", {{"gravity", {0, -9.81, 0}}}}};
  for (const Precision precision : {Precision::kFloat, Precision::kDouble}) {
    const Held chosen = held(scene, chosen_, precision, "mesh_position"),
               fixed = held(scene, 4, precision, "mesh_position");
    EXPECT_EQ(fixed.planned, 0u);
    expect_planned(chosen, chosen.allocated - fixed.allocated + 8 * chosen.positions);
  }
}

}  // namespace
}  // namespace ringlet::pipeline
