// What is written is what is read, to the bit, by every compression.
#include <gmock/gmock.h>

#include "cache/compare.h"
#include "cache/deflate.h"
#include "cache/files.h"
#include "unit/cache_support.h"

namespace ringlet::cache {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

void expect_same(const state::RunHeader& a, const state::RunHeader& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.scene_json, b.scene_json);
  EXPECT_EQ(a.scene_hash, b.scene_hash);
  EXPECT_EQ(a.program_version, b.program_version);
  EXPECT_EQ(a.backend, b.backend);
  EXPECT_EQ(a.instruction_set, b.instruction_set);
  EXPECT_EQ(a.precision, b.precision);
  EXPECT_EQ(a.length_unit, b.length_unit);
  EXPECT_EQ(a.metres_per_unit, b.metres_per_unit);
  EXPECT_EQ(a.up, b.up);
  EXPECT_EQ(a.fps, b.fps);
  EXPECT_EQ(a.first_frame, b.first_frame);
  EXPECT_EQ(a.last_frame, b.last_frame);
  EXPECT_EQ(a.offsets, b.offsets);
  EXPECT_EQ(a.root_triangle, b.root_triangle);
  EXPECT_EQ(a.root_barycentric, b.root_barycentric);
  EXPECT_EQ(a.rest_position, b.rest_position);
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.groom_of_strand, b.groom_of_strand);
  EXPECT_EQ(a.groom_names, b.groom_names);
  EXPECT_EQ(a.interpolation.neighbours, b.interpolation.neighbours);
  EXPECT_EQ(a.interpolation.guides, b.interpolation.guides);
  EXPECT_EQ(a.interpolation.guide, b.interpolation.guide);
  EXPECT_EQ(a.interpolation.weight, b.interpolation.weight);
  EXPECT_EQ(a.interpolation.guides_apart, b.interpolation.guides_apart);
  ASSERT_EQ(a.surfaces.size(), b.surfaces.size());
  for (std::size_t i = 0; i < a.surfaces.size(); ++i) {
    EXPECT_EQ(a.surfaces[i].name, b.surfaces[i].name);
    EXPECT_EQ(a.surfaces[i].triangles, b.surfaces[i].triangles);
  }
}

void expect_same(const state::Frame& a, const state::Frame& b) {
  EXPECT_EQ(a.number, b.number);
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.velocity, b.velocity);
  EXPECT_EQ(a.elongation, b.elongation);
  EXPECT_EQ(a.living, b.living);
  EXPECT_EQ(a.guide_position, b.guide_position);
  EXPECT_EQ(a.surface_vertices, b.surface_vertices);
  EXPECT_EQ(a.figures, b.figures);
}

TEST_F(CacheTest, HeaderAndFramesComeBackToTheBit) {
  for (const Compression compression : {Compression::kNone, Compression::kDefault}) {
    write_small(directory_, 1, 3, {.compression = compression, .existing = Existing::kOverwrite});
    const CacheReader reader(directory_);
    expect_same(reader.header(), small_header());
    EXPECT_EQ(reader.compression(), compression);
    EXPECT_THAT(reader.frames(), ElementsAre(1, 2, 3));
    for (const int number : reader.frames()) expect_same(reader.read(number), small_frame(number));
  }
}

// Strands 0 and 2 are guides, strand 1 follows both; grooming has cut strand 1.
state::RunHeader followed_header() {
  state::RunHeader header = small_header();
  header.interpolation = {2, {0, 2}, {0, -1, 1, 0, 1, -1}, {1, 0, 0.75f, 0.25f, 1, 0}, true};
  return header;
}

state::Frame followed_frame(int number) {
  state::Frame frame = small_frame(number);
  frame.living = {2, 4 - number, 3};
  frame.elongation.assign(9, 0.25f * static_cast<float>(number));
  for (int i = 0; i < 15; ++i) frame.guide_position.push_back(0.1f * static_cast<float>(i + number));
  return frame;
}

TEST_F(CacheTest, FollowersWeightsAndLivingParticlesComeBackToTheBit) {
  {
    CacheWriter writer(directory_, followed_header());
    for (const int number : {1, 2, 3}) writer.write(followed_frame(number), small_snapshot(number), 0.5);
    writer.finish();
  }
  const CacheReader reader(directory_);
  expect_same(reader.header(), followed_header());
  for (const int number : reader.frames()) expect_same(reader.read(number), followed_frame(number));
  write_failed_state(directory_ / "small.failed.h5", followed_header(), followed_frame(2), {"m", "s", 1, 2});
  const CacheReader failed(directory_ / "small.failed.h5");
  expect_same(failed.header(), followed_header());
  expect_same(failed.read(2), followed_frame(2));
}

TEST_F(CacheTest, AFrameOfOtherLivingParticlesIsNotTheSame) {
  for (const char* name : {"a", "b"}) {
    CacheWriter writer(directory_ / name, followed_header());
    state::Frame frame = followed_frame(1);
    if (name[0] == 'b') frame.living[1] = 1;
    writer.write(frame, {}, 0);
    writer.finish();
  }
  const CacheReader a(directory_ / "a"), b(directory_ / "b");
  for (const bool exact : {false, true}) {
    const Comparison found = compare(a, b, {.tolerance = 1, .exact = exact});
    EXPECT_FALSE(found.same);
    EXPECT_THAT(found.living, ElementsAre(1));
    EXPECT_EQ(found.overall.max, 0) << "the positions are the same";
  }
}

TEST_F(CacheTest, GuidesThatNoStrandIsAreRefused) {
  state::RunHeader header = followed_header();
  header.interpolation.guides = {0, 3};
  header.interpolation.guides_apart = false;
  write_small(directory_, 1, 1, {}, header);
  EXPECT_THAT(error_of([&] { CacheReader reader(directory_); }).what(),
              testing::HasSubstr("interpolation/guides names strand 3, which does not exist"));
}

TEST_F(CacheTest, ManyChunksWithARaggedEndComeBackToTheBit) {
  state::RunHeader header = small_header();
  const std::int64_t particles = 100001;
  header.offsets = {0, particles};
  header.root_triangle = {-1};
  header.root_barycentric = {0, 0, 0};
  header.rest_position.assign(3 * particles, 0);
  header.width.assign(particles, 0.008f);
  header.groom_of_strand = {0};
  header.surfaces = {};
  state::Frame frame;
  frame.number = 1;
  for (std::int64_t i = 0; i < 3 * particles; ++i)
    frame.position.push_back(std::sin(static_cast<float>(i) * 0.37f));
  {
    CacheWriter writer(directory_, header);
    writer.write(frame, {}, 0);
    writer.finish();
  }
  expect_same(CacheReader(directory_).read(1), frame);
  EXPECT_LT(std::filesystem::file_size(directory_ / "small.0001.h5"), 12 * particles);
}

TEST_F(CacheTest, DeflateTakesEveryKindOfBytes) {
  // Random bits are stored as they are, zeros shrink to almost nothing: neither overruns its buffer.
  std::vector<float> noise(32768 * 3), zeros(32768 * 3, 0.0f);
  std::uint32_t state = 1;
  for (float& value : noise) {
    state = state * 1664525u + 1013904223u;
    const std::uint32_t bits = state ^ (state >> 13);
    std::memcpy(&value, &bits, sizeof bits);
  }
  EXPECT_LT(shuffle_and_deflate(noise).size(), noise.size() * 4 + 200);
  EXPECT_LT(shuffle_and_deflate(zeros).size(), zeros.size() * 4 / 100);
  EXPECT_GT(shuffle_and_deflate(std::vector<float>{1.0f}).size(), 0u);
}

TEST_F(CacheTest, FrameNumbersHaveFourDigitsOrMoreAndASign) {
  const Files files{directory_, "a.b"};
  EXPECT_EQ(files.frame_name(7), "a.b.0007.h5");
  EXPECT_EQ(files.frame_name(12345), "a.b.12345.h5");
  EXPECT_EQ(files.frame_name(-5), "a.b.-0005.h5");
  for (const int number : {7, 12345, -5, 0}) EXPECT_EQ(files.frame_number(files.frame_name(number)), number);
  for (const char* other : {"a.b.h5", "a.b.state.h5", "a.b.007.h5", "a.b.00012.h5", "a.b.0007.h5.tmp",
                            "b.0007.h5", ".a.b.0007.h5.tmp", "a.b..h5", "a.b.-0000.h5"})
    EXPECT_FALSE(files.frame_number(other)) << other;
}

TEST_F(CacheTest, NegativeFramesComeFirst) {
  write_small(directory_, -2, 1);
  const CacheReader reader(directory_);
  EXPECT_THAT(reader.frames(), ElementsAre(-2, -1, 0, 1));
  EXPECT_EQ(reader.read(-2).number, -2);
}

TEST_F(CacheTest, MasterStateAndTimingsLieBesideTheFrames) {
  write_small(directory_, 1, 2);
  EXPECT_THAT(files_in(directory_), ElementsAre("small.0001.h5", "small.0002.h5", "small.h5",
                                                "small.state.h5", "small.timings.jsonl"));
  EXPECT_EQ(bytes_of_file(directory_ / "small.timings.jsonl"),
            "{\"frame\": 1, \"seconds\": 0.500000}\n{\"frame\": 2, \"seconds\": 0.500000}\n");
  const state::Snapshot state = read_state_file(directory_ / "small.state.h5");
  EXPECT_EQ(state.frame, 2);
  EXPECT_EQ(state.arrays, small_snapshot(2).arrays);
  EXPECT_EQ(content_of(directory_ / "small.state.h5"), Content::kState);
  EXPECT_EQ(content_of(directory_ / "small.0001.h5"), Content::kFrame);
  EXPECT_EQ(content_of(directory_ / "small.h5"), Content::kMaster);
}

TEST_F(CacheTest, AReaderSeesTheFramesThatAreThereNow) {
  write_small(directory_, 1, 3);
  std::filesystem::remove(directory_ / "small.0002.h5");
  const CacheReader reader(directory_ / "small.h5");
  EXPECT_THAT(reader.frames(), ElementsAre(1, 3));
  EXPECT_EQ(error_of([&] { reader.read(2); }).kind(), ErrorKind::kInput);
}

TEST_F(CacheTest, AnExistingCacheIsRefusedUnlessOverwritten) {
  write_small(directory_, 1, 3);
  const Error error = error_of([&] { write_small(directory_, 1, 1); });
  EXPECT_EQ(error.kind(), ErrorKind::kUsage);
  EXPECT_THAT(error.what(), testing::HasSubstr("small.h5: a cache is already there"));
  EXPECT_EQ(error_of([&] { check_destination(directory_, "small", Existing::kRefuse); }).kind(),
            ErrorKind::kUsage);
  check_destination(directory_, "other", Existing::kRefuse);

  write_small(directory_, 1, 1, {.existing = Existing::kOverwrite});
  EXPECT_THAT(CacheReader(directory_).frames(), ElementsAre(1));
}

TEST_F(CacheTest, OverwritingLeavesOtherFilesAlone) {
  write_small(directory_, 1, 2);
  std::ofstream(directory_ / "small.notes.h5") << "mine";
  std::ofstream(directory_ / "small2.0001.h5") << "mine";
  write_small(directory_, 2, 2, {.existing = Existing::kOverwrite});
  EXPECT_THAT(files_in(directory_), ElementsAre("small.0002.h5", "small.h5", "small.notes.h5",
                                                "small.state.h5", "small.timings.jsonl", "small2.0001.h5"));
}

TEST_F(CacheTest, AFailedStateReadsAsACacheOfOneFrame) {
  state::Frame frame = small_frame(2);
  frame.position[16] = std::nanf("");
  const auto path = directory_ / "small.failed.h5";
  write_failed_state(path, small_header(), frame, {"not finite", "strand_step", 1, 5});
  const CacheReader reader(path);
  expect_same(reader.header(), small_header());
  EXPECT_THAT(reader.frames(), ElementsAre(2));
  const state::Frame read = reader.read(2);
  EXPECT_TRUE(std::isnan(read.position[16]));
  frame.position[16] = 0;
  state::Frame mended = read;
  mended.position[16] = 0;
  expect_same(mended, frame);
  ASSERT_TRUE(reader.failure());
  EXPECT_EQ(reader.failure()->message, "not finite");
  EXPECT_EQ(reader.failure()->stage, "strand_step");
  EXPECT_EQ(reader.failure()->strand, 1);
  EXPECT_EQ(reader.failure()->particle, 5);
}

TEST_F(CacheTest, QuantisedPositionsKeepTheirBound) {
  const float adversarial[] = {
      0.0f,       -0.0f,      1e-6f,         -1e-6f,         0.5e-3f,        1.5e-3f,   0.49999997f, 1.0f,
      -1.0f,      1.0009766f, 999.99994f,    1000.0003f,     16777216,       16777218,  1e30f,       -3e38f,
      1.175e-38f, 1e-45f,     0.0014648437f, -0.0004882812f, 0.00048828122f, 3.1415927f};
  state::RunHeader header = small_header();
  const std::size_t particles = std::size(adversarial);
  header.offsets = {0, static_cast<std::int64_t>(particles)};
  header.root_triangle = {-1};
  header.root_barycentric = {0, 0, 0};
  header.rest_position.assign(3 * particles, 0);
  header.width.assign(particles, 0.008f);
  header.groom_of_strand = {0};
  header.surfaces = {};
  state::Frame frame;
  frame.number = 1;
  for (const float value : adversarial)
    for (const float sign : {1.0f, -1.0f, 0.3333f}) frame.position.push_back(sign * value);
  const state::Frame original = frame;
  const double bound = 1e-3;
  {
    CacheWriter writer(directory_, header, {.compression = Compression::kQuantised, .error = bound});
    writer.write(std::move(frame), {}, 0);
    writer.finish();
  }
  const CacheReader reader(directory_);
  EXPECT_EQ(reader.compression(), Compression::kQuantised);
  EXPECT_EQ(reader.error_bound(), bound);
  const state::Frame read = reader.read(1);
  bool moved = false;
  for (std::size_t i = 0; i < particles; ++i) {
    double squared = 0;
    for (std::size_t axis = 3 * i; axis < 3 * i + 3; ++axis)
      squared += std::pow(static_cast<double>(read.position[axis]) - original.position[axis], 2);
    EXPECT_TRUE(std::sqrt(squared) <= bound) << "particle " << i;
    moved = moved || squared > 0;
  }
  EXPECT_TRUE(moved);
}

TEST_F(CacheTest, TheStepOfQuantisationIsTheLargestPowerOfTwoWithinTheBound) {
  for (const double error : {1e-5, 1e-3, 0.1, 1.0, 7.0}) {
    const double step = quantisation_step(error);
    EXPECT_EQ(std::exp2(std::round(std::log2(step))), step);
    EXPECT_LE(step / 2 * std::sqrt(3.0), error);
    EXPECT_GT(step * std::sqrt(3.0), error);
  }
  const Error error =
      error_of([&] { write_small(directory_, 1, 1, {.compression = Compression::kQuantised}); });
  EXPECT_EQ(error.kind(), ErrorKind::kUsage);
}

}  // namespace
}  // namespace ringlet::cache
