// Errors of runs whose distance from the reference is known.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "cache/writer.h"
#include "study/measure.h"

namespace ringlet::study {
namespace {

namespace fs = std::filesystem;
using Curve = std::function<Vec3(int strand, double along)>;  // along: 0 at the root to 1

constexpr double kLength = 0.2;

// Strands side by side, straight down.
Vec3 at_rest(int strand, double along) { return {0.1 * strand, -kLength * along, 0}; }

state::RunHeader header(int strands, int particles) {
  state::RunHeader header;
  header.name = "lines", header.scene_json = "{}", header.length_unit = "m", header.up = "y";
  header.backend = "cpu", header.instruction_set = "generic", header.precision = "double";
  header.first_frame = 1, header.last_frame = 2;
  header.groom_names = {"lines"};
  header.offsets = {0};
  for (int s = 0; s < strands; ++s) {
    header.offsets.push_back(header.offsets.back() + particles);
    header.root_triangle.push_back(-1);
    header.groom_of_strand.push_back(0);
    header.root_barycentric.insert(header.root_barycentric.end(), 3, 0.0f);
    header.width.insert(header.width.end(), static_cast<std::size_t>(particles), 1e-4f);
    for (int i = 0; i < particles; ++i)
      for (int c = 0; c < 3; ++c)
        header.rest_position.push_back(static_cast<float>(at_rest(s, i / (particles - 1.0))[c]));
  }
  return header;
}

state::Frame frame(int strands, int particles, const Curve& position, const Curve& velocity, int number = 2) {
  state::Frame frame;
  frame.number = number;
  for (int s = 0; s < strands; ++s)
    for (int i = 0; i < particles; ++i)
      for (int c = 0; c < 3; ++c) {
        frame.position.push_back(static_cast<float>(position(s, i / (particles - 1.0))[c]));
        frame.velocity.push_back(static_cast<float>(velocity(s, i / (particles - 1.0))[c]));
      }
  return frame;
}

Vec3 still(int, double) { return Vec3::Zero(); }

class StudyMeasure : public testing::Test {
 protected:
  StudyMeasure() {
    scene_.frames = {1, 2, 24, 0};
    scene_.model.clamped_particles = 1;
  }
  ~StudyMeasure() override { fs::remove_all(folder_); }

  // Three strands of five particles at rest.
  const cache::CacheReader& reference() {
    if (!reader_) {
      cache::CacheWriter writer(folder_, header_, {});
      for (const int number : {1, 2}) {
        state::Frame out = frame(3, 5, at_rest, still, number);
        out.surface_vertices = surfaces_;
        writer.write(std::move(out), {}, 0);
      }
      writer.finish();
      reader_.emplace(folder_);
    }
    return *reader_;
  }

  Errors errors_of(int strands, int particles, const Curve& position, const Curve& velocity = still) {
    Measure measure(scene_, reference(), header(strands, particles));
    measure.write(frame(strands, particles, at_rest, still, 1), {}, 0);  // unstepped: does not count
    measure.write(frame(strands, particles, position, velocity), {}, 0);
    return measure.errors();
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("ringlet_measure_" + std::to_string(getpid()));
  scene::Scene scene_{};
  state::RunHeader header_ = header(3, 5);
  std::vector<std::vector<float>> surfaces_;
  std::optional<cache::CacheReader> reader_;
};

TEST_F(StudyMeasure, OfTheSameIsNothing) {
  const Errors errors = errors_of(3, 5, at_rest);
  EXPECT_EQ(errors.strands, 3);
  EXPECT_EQ(errors.position->rms, 0);
  EXPECT_EQ(errors.velocity->p99, 0);
  EXPECT_EQ(errors.length->rms, 0);
  EXPECT_FALSE(errors.volume) << "there is no grid";
  EXPECT_FALSE(errors.penetration) << "there are no solids";
}

TEST_F(StudyMeasure, OfAShiftIsTheShift) {
  const Errors errors = errors_of(
      3, 5, [](int s, double a) { return Vec3(at_rest(s, a) + Vec3(0.003, 0, 0.004)); },
      [](int, double) { return Vec3(0, 0.6, 0.8); });
  EXPECT_NEAR(errors.position->rms, 0.005, 1e-8);
  EXPECT_NEAR(errors.position->p99, 0.005, 0.0055 * 0.005);
  EXPECT_NEAR(errors.velocity->rms, 1, 1e-6);
  EXPECT_NEAR(errors.length->rms, 0, 1e-6);
}

TEST_F(StudyMeasure, OfOtherParticlesIsTakenAtTheReferencesPlaces) {
  const auto stretched = [](int s, double a) { return Vec3(0.1 * s, -kLength * a * 1.1, 0); };
  double squares = 0;
  for (int i = 0; i < 5; ++i) squares += std::pow(0.1 * kLength * i / 4.0, 2);
  for (const int particles : {2, 3, 5, 8, 33}) {
    const Errors errors = errors_of(3, particles, stretched);
    EXPECT_NEAR(errors.position->rms, std::sqrt(squares / 5), 1e-8) << particles;
    EXPECT_NEAR(errors.length->rms, 0.1, 1e-6) << particles;
  }
}

TEST_F(StudyMeasure, ComparesStrandsWhoseRootsAgree) {
  EXPECT_EQ(errors_of(2, 5, at_rest).strands, 2);
  EXPECT_EQ(errors_of(4, 5, at_rest).strands, 3);
  state::RunHeader moved = header(3, 5);
  for (std::size_t i = 0; i < 5; ++i) moved.rest_position[3 * (5 + i)] += 0.05f;  // the middle strand
  Measure measure(scene_, reference(), moved);
  EXPECT_EQ(measure.errors().strands, 2);
}

TEST_F(StudyMeasure, OfNothingFiniteIsInfinite) {
  const Errors errors =
      errors_of(3, 5, [](int s, double a) { return Vec3(at_rest(s, a) * (s == 1 ? NAN : 1)); });
  EXPECT_TRUE(std::isinf(errors.position->rms));
}

// Strands that come together in one line fill a third of the cubes.
TEST_F(StudyMeasure, VolumeIsThatOfTheCubesWithHair) {
  scene_.effects.hair_hair.emplace();
  scene_.effects.hair_hair->grid.emplace();
  scene_.effects.hair_hair->grid->resolution = 10;  // 0.02 m
  const auto off = [](const Curve& curve) {         // away from the cubes' faces
    return [curve](int s, double a) { return Vec3(curve(s, a) + Vec3(0.001, -0.001, 0.001)); };
  };
  const Errors same = errors_of(3, 5, at_rest);
  EXPECT_EQ(same.volume->rms, 0);
  const Errors together = errors_of(3, 5, off([](int, double a) { return at_rest(0, a); }));
  EXPECT_NEAR(together.volume->rms, 2.0 / 3, 0.05);
}

// A cube from -0.1 to 0.1 about the first strand's root, whose particles but the root lie 0.05 to 0.1 inside
// below it, and one outside.
TEST_F(StudyMeasure, DepthIsThatInTheSolidsMesh) {
  state::Surface cube{"box", {}};
  std::vector<float> corners;
  for (int k = 0; k < 8; ++k)
    for (int c = 0; c < 3; ++c) corners.push_back((k >> c & 1) ? 0.1f : -0.1f);
  for (const auto& quad : {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4},
                           std::array{2, 6, 7, 3}, std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}})
    for (const int corner : {0, 1, 2, 0, 2, 3})
      cube.triangles.push_back(quad[static_cast<std::size_t>(corner)]);
  header_.surfaces = {cube};
  surfaces_ = {corners};
  scene::Solid solid{};
  solid.name = "box", solid.offset = 0.01;
  scene_.effects.solids = {solid};
  // Only the first strand is near: its particles at 0.05, 0.1, 0.15 and 0.2 m below the middle.
  const Errors errors =
      errors_of(3, 5, [](int s, double a) { return Vec3(at_rest(s, a) + Vec3(10.0 * s, 0, 0)); });
  const double expected = std::sqrt((0.06 * 0.06 + 0.01 * 0.01) / 12);  // of twelve that are not held
  EXPECT_NEAR(errors.penetration->rms, expected, 1e-6);
}

}  // namespace
}  // namespace ringlet::study
