// A value that is not finite, put into any array of the state after any stage, ends the run there and then,
// by the names of frame, stage, strand and particle.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

#include "kernels/hairmesh/hair_mesh_solver.h"
#include "kernels/strand/strand_batch.h"
#include "pipeline/simulation.h"
#include "scene/scene.h"
#include "unit/pipeline_support.h"

namespace ringlet::pipeline {
namespace {

constexpr int kStrands = 20, kParticles = 6;  // of equal count: in the order of the file, kLanes to a batch
constexpr int kSick = 17, kSickParticle = 3;

constexpr const char* kStill = R"({
  "name": "still", "frames": {"last": 3}, "groom": {"file": "hair.data", "attach": "fixed"},
  "model": {"substeps": 2}, "effects": {"gravity": [0, -9.81, 0]}})";
constexpr const char* kAll = R"({
  "name": "all", "frames": {"last": 3},
  "groom": {"file": "hair.data", "attach": "fixed", "width": 1e-4,
            "animation": {"keys": [{"frame": 1}, {"frame": 3, "translate": [0.01, 0, 0]}]}},
  "model": {"substeps": 2},
  "effects": {
    "gravity": [0, -9.81, 0], "inextensible": {}, "non_hookean": {},
    "wind": {"velocity": [2, 0, 0], "gusts": {}, "turbulence": {}},
    "hair_hair": {"grid": {"resolution": 16, "cadence": "substep", "shelter": {}}, "contacts": {"cadence": "substep"}},
    "solids": [{"source": "solid.obj", "resolution": 16}]}})";
constexpr const char* kMassSpring = R"({
  "name": "companions", "frames": {"last": 3}, "groom": {"file": "hair.data", "attach": "fixed"},
  "model": {"type": "mass_spring", "substeps": 2}, "effects": {"gravity": [0, -9.81, 0]}})";
constexpr const char* kHairMesh = R"({
  "name": "mesh", "frames": {"last": 3},
  "groom": {"hair_mesh": {"file": "mesh.json", "strands": 9, "particles": 7}, "attach": "fixed"},
  "model": {"type": "hair_mesh", "substeps": 2}, "effects": {"gravity": [0, -9.81, 0]}})";

// Where a value of a strand lies in an array of its kind, and how wide a value is.
struct Place {
  const char* array;
  int components;
  bool per_particle;
};
constexpr Place kPlaces[] = {{"position", 3, true},
                             {"velocity", 3, true},
                             {"elongation", 1, true},
                             {"shelter", 1, true},
                             {"air", 3, true},
                             {"companion_position", 3, true},
                             {"companion_velocity", 3, true},
                             {"root_points", 3, false},
                             {"root_motion", kernels::kRootValues, false}};

class CountFrames : public state::FrameSink {
 public:
  void write(state::Frame, state::Snapshot, double) override { ++frames; }
  void finish() override {}
  int frames = 0;
};

class PipelineHealth : public testing::Test {
 protected:
  PipelineHealth() {
    std::filesystem::create_directories(folder_);
    pipeline_testing::write_hair(folder_ / "hair.data", kStrands, kParticles);
    std::ofstream(folder_ / "solid.obj")
        << "v 0 -1 0\nv 0.1 -1 0\nv 0 -0.9 0\nv 0 -1 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::ofstream(folder_ / "mesh.json") << R"({"format": "ringlet-hair-mesh", "version": 1,
      "units": {"length": "m", "up": "y"}, "faces": [[0, 1, 2, 3]],
      "layers": [[[0,0,0],[0,0,0.1],[0.1,0,0.1],[0.1,0,0]], [[0,0.05,0],[0,0.05,0.1],[0.1,0.05,0.1],[0.1,0.05,0]],
                 [[0,0.1,0],[0,0.1,0.1],[0.1,0.1,0.1],[0.1,0.1,0]]]})";
  }
  ~PipelineHealth() override { std::filesystem::remove_all(folder_); }

  std::unique_ptr<Simulation> simulation(const char* text, Precision precision) const {
    std::ofstream(folder_ / "scene.json") << text;
    Options options;
    options.precision = precision, options.backend = Backend::kCpu;
    return Simulation::create(scene::load(folder_ / "scene.json"), options);
  }

  // Runs with `poison` after one stage of one substep; expects it to end there and then, the frames before it
  // handed on.
  template <class Poison>
  Diverged run_poisoned(const char* text, Precision precision, const std::string& stage, int frame,
                        int substep, const Poison& poison) const {
    CountFrames sink;
    RunControl control;
    bool poisoned = false;
    control.probe = [&](const std::string& after, int in_frame, int in_substep, state::Snapshot& arrays) {
      EXPECT_FALSE(poisoned) << "went on after the value was put there";
      if (after != stage || in_frame != frame || in_substep != substep) return;
      poisoned = true, poison(arrays);
    };
    try {
      simulation(text, precision)->run({1, 3}, sink, control);
    } catch (const Diverged& failure) {
      EXPECT_TRUE(poisoned);
      EXPECT_EQ(failure.frame.number, frame);
      EXPECT_EQ(failure.stage, stage);
      EXPECT_EQ(sink.frames, frame - 1);
      return failure;
    }
    ADD_FAILURE() << "nothing was found after " << stage << " in frame " << frame;
    return Diverged({}, "", -1, -1, "");
  }

  // In strand kSick, particle kSickParticle; the value's last component.
  template <class T>
  static void put(state::Snapshot& arrays, const Place& place, double value) {
    std::vector<std::byte>& bytes = arrays.arrays.at(place.array);
    const int batch = kSick / kernels::kLanes, lane = kSick % kernels::kLanes;
    const int row = place.per_particle ? batch * kParticles + kSickParticle : batch;
    const std::size_t at =
        (static_cast<std::size_t>(row) * place.components + place.components - 1) * kernels::kLanes + lane;
    const T typed = static_cast<T>(value);
    ASSERT_LE((at + 1) * sizeof(T), bytes.size());
    std::memcpy(bytes.data() + at * sizeof(T), &typed, sizeof typed);
  }

  // Every array that the scene has, after every stage that it has.
  template <class T>
  void poison_everywhere(const char* text, Precision precision, const std::set<std::string>& arrays,
                         int frame, int substep, double value) const {
    const Plan plan = simulation(text, precision)->plan();
    for (const PlannedStage& stage : plan.stages) {
      const bool moves_roots = std::string(text) == kAll;
      if (!stage.runs || (stage.name == "roots" && !moves_roots)) continue;
      for (const Place& place : kPlaces) {
        if (!arrays.contains(place.array)) continue;
        if (stage.name == "roots" && place.per_particle) continue;  // before the stages that change those
        SCOPED_TRACE(std::string(place.array) + " after " + stage.name);
        const Diverged failure = run_poisoned(text, precision, stage.name, frame, substep, [&](auto& all) {
          if (std::string(place.array) == "root_points")
            put<double>(all, place, value);
          else
            put<T>(all, place, value);
        });
        EXPECT_EQ(failure.strand, kSick);
        EXPECT_EQ(failure.particle, place.per_particle ? kSickParticle : 0);
        EXPECT_THAT(failure.what(), testing::HasSubstr(std::string("`") + place.array + "`"));
      }
    }
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("ringlet_health_" + std::to_string(getpid()));
};

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const std::set<std::string> kAlways = {"position", "velocity", "root_points", "root_motion"};

TEST_F(PipelineHealth, OfStrandsUnderGravity) {
  for (const int frame : {2, 3})
    for (const int substep : {0, 1}) {
      poison_everywhere<float>(kStill, Precision::kFloat, kAlways, frame, substep, kNaN);
      poison_everywhere<double>(kStill, Precision::kDouble, kAlways, frame, substep, -kInfinity);
    }
}

TEST_F(PipelineHealth, OfEveryArrayAfterEveryStage) {
  std::set<std::string> arrays = kAlways;
  arrays.insert({"elongation", "shelter", "air"});
  poison_everywhere<float>(kAll, Precision::kFloat, arrays, 2, 0, kNaN);
  poison_everywhere<float>(kAll, Precision::kFloat, arrays, 3, 1, kInfinity);
  poison_everywhere<double>(kAll, Precision::kDouble, arrays, 2, 1, kNaN);
}

TEST_F(PipelineHealth, OfTheMassSpringModelsCompanions) {
  std::set<std::string> arrays = kAlways;
  arrays.insert({"companion_position", "companion_velocity"});
  poison_everywhere<float>(kMassSpring, Precision::kFloat, arrays, 2, 1, kNaN);
  poison_everywhere<double>(kMassSpring, Precision::kDouble, arrays, 3, 0, kNaN);
}

// The particle that goes with the vertex: of seven through three layers, that next to the middle one.
TEST_F(PipelineHealth, OfHairMeshes) {
  for (const char* array : {"mesh_position", "mesh_velocity"})
    for (const int substep : {0, 1}) {
      SCOPED_TRACE(array);
      const Diverged failure =
          run_poisoned(kHairMesh, Precision::kDouble, "start", 3, substep, [&](state::Snapshot& all) {
            double* values = reinterpret_cast<double*>(all.arrays.at(array).data());
            values[3 * (2 * 3 + 1)] = kNaN;  // column 2, layer 1 of 3
          });
      EXPECT_THAT(failure.what(), testing::HasSubstr("vertex 2 of layer 1"));
      EXPECT_GE(failure.strand, 0);
      EXPECT_TRUE(failure.particle >= 2 && failure.particle <= 4) << failure.particle;
    }
}

TEST_F(PipelineHealth, OfAHairMeshsContacts) {
  std::string text = kHairMesh;
  const std::string two = R"("substeps": 2)";
  text.replace(
      text.find(two), two.size(),
      two + R"(, "hair_mesh": {"ellipsoids": [{"centre": [0.05, 0, 0.05], "radii": [0.2, 0.15, 0.2]}]})");
  std::int32_t vertex = -1;
  const Diverged failure = run_poisoned(text.c_str(), Precision::kDouble, "start", 3, 1, [&](auto& all) {
    std::vector<std::byte>& bytes = all.arrays.at("mesh_contacts");
    kernels::MeshContact<double> contact{};
    ASSERT_GE(bytes.size(), sizeof contact);
    std::memcpy(&contact, bytes.data(), sizeof contact);
    vertex = contact.vertex, contact.normal[1] = kNaN;
    std::memcpy(bytes.data(), &contact, sizeof contact);
  });
  const std::string named =
      "vertex " + std::to_string(vertex / 3) + " of layer " + std::to_string(vertex % 3);
  EXPECT_THAT(failure.what(), testing::HasSubstr(named));
  EXPECT_GE(failure.strand, 0);
  EXPECT_GE(failure.particle, 0);
}

// What a checkpoint holds is looked at before the first step.
TEST_F(PipelineHealth, OfACheckpoint) {
  class Keep : public state::FrameSink {
   public:
    void write(state::Frame, state::Snapshot snapshot, double) override { last = std::move(snapshot); }
    void finish() override {}
    state::Snapshot last;
  } kept;
  simulation(kAll, Precision::kFloat)->run({1, 2}, kept, {});
  for (const char* array : {"position", "velocity", "elongation", "shelter"}) {
    SCOPED_TRACE(array);
    RunControl control;
    control.resume = kept.last;
    for (const Place& place : kPlaces)
      if (std::string(place.array) == array) put<float>(*control.resume, place, kNaN);
    CountFrames sink;
    try {
      simulation(kAll, Precision::kFloat)->run({1, 3}, sink, control);
      ADD_FAILURE() << "nothing was found";
    } catch (const Diverged& failure) {
      EXPECT_EQ(failure.stage, "resume");
      EXPECT_EQ(failure.frame.number, 2);
      EXPECT_EQ(failure.strand, kSick);
      EXPECT_EQ(failure.particle, kSickParticle);
    }
  }
}

}  // namespace
}  // namespace ringlet::pipeline
