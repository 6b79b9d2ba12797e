// Distances by hand.
#include "cache/compare.h"

#include <gmock/gmock.h>

#include <limits>

#include "unit/cache_support.h"

namespace ringlet::cache {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class CacheCompareTest : public CacheTest {
 protected:
  // Writes A and B of `frames` frames; B's frame `f` is A's with `change` applied.
  template <class Change>
  void write_pair(int frames, Change change, const state::RunHeader& b = small_header()) {
    write_small(directory_ / "a", 1, frames);
    CacheWriter writer(directory_ / "b", b);
    for (int number = 1; number <= frames; ++number) {
      state::Frame frame = small_frame(number);
      change(frame);
      writer.write(std::move(frame), {}, 0);
    }
    writer.finish();
  }
  Comparison compare_pair(const CompareOptions& options = {}) {
    return compare(CacheReader(directory_ / "a"), CacheReader(directory_ / "b"), options);
  }
};

TEST_F(CacheCompareTest, ACacheIsTheSameAsItself) {
  write_pair(3, [](state::Frame&) {});
  for (const bool exact : {false, true}) {
    const Comparison result = compare_pair({.tolerance = 0, .exact = exact});
    EXPECT_TRUE(result.same);
    EXPECT_EQ(result.overall.max, 0);
    EXPECT_EQ(result.overall.strand, -1);
    EXPECT_THAT(result.provenance, IsEmpty());
    EXPECT_EQ(result.frames.size(), 3u);
  }
}

TEST_F(CacheCompareTest, StatisticsAreThoseWorkedOutByHand) {
  // Positions are set outright so that the differences are exact: particle 4 (strand 1, its particle 2) of
  // frame 2 lies (3, 4, 0) off, particle 7 (strand 2, its particle 1) of frame 3 lies (0, 0, 1) off.
  const auto write = [&](const char* name, bool moved) {
    CacheWriter writer(directory_ / name, small_header());
    for (int number = 1; number <= 3; ++number) {
      state::Frame frame = small_frame(number);
      frame.position.assign(27, 2.0f);
      if (moved && number == 2) frame.position[12] += 3, frame.position[13] += 4;
      if (moved && number == 3) frame.position[23] += 1;
      writer.write(std::move(frame), {}, 0);
    }
    writer.finish();
  };
  write("a", false);
  write("b", true);
  const Comparison result = compare_pair({.tolerance = 5});
  EXPECT_TRUE(result.same);
  EXPECT_FALSE(compare_pair({.tolerance = 4.999}).same);
  EXPECT_FALSE(compare_pair({.tolerance = 5, .exact = true}).same);
  EXPECT_EQ(result.worst_frame, 2);
  EXPECT_EQ(result.overall.max, 5);
  EXPECT_EQ(result.overall.strand, 1);
  EXPECT_EQ(result.overall.particle, 2);
  EXPECT_DOUBLE_EQ(result.overall.rms, std::sqrt((25.0 + 1.0) / 27.0));
  EXPECT_EQ(result.frames[0].distances.max, 0);
  EXPECT_TRUE(result.frames[0].identical);
  EXPECT_DOUBLE_EQ(result.frames[1].distances.rms, 5.0 / 3.0);
  EXPECT_EQ(result.frames[1].distances.p99, 5);  // of 9 particles the 9th
  EXPECT_EQ(result.frames[2].distances.strand, 2);
  EXPECT_EQ(result.frames[2].distances.particle, 1);
}

TEST_F(CacheCompareTest, ThePercentileIsTheNearestRank) {
  // 200 particles at distances 1 to 200, shuffled: 99 % of them are no farther than 198.
  state::RunHeader header = small_header();
  const int particles = 200;
  header.offsets = {0, particles};
  header.root_triangle = {-1};
  header.root_barycentric = {0, 0, 0};
  header.rest_position.assign(3 * particles, 0);
  header.width.assign(particles, 1);
  header.groom_of_strand = {0};
  header.surfaces = {};
  for (const bool moved : {false, true}) {
    state::Frame frame;
    frame.number = 1;
    frame.position.assign(3 * particles, 0);
    for (int i = 0; i < particles && moved; ++i)
      frame.position[3 * i + 1] = static_cast<float>((i * 77) % 200 + 1);
    CacheWriter writer(directory_ / (moved ? "b" : "a"), header);
    writer.write(std::move(frame), {}, 0);
    writer.finish();
  }
  const Comparison result = compare_pair();
  EXPECT_EQ(result.overall.p99, 198);
  EXPECT_EQ(result.overall.max, 200);
  EXPECT_DOUBLE_EQ(result.overall.rms, std::sqrt(200.0 * 201 * 401 / 6 / 200));
}

TEST_F(CacheCompareTest, ANonFiniteCoordinateInEitherIsBeyondEveryTolerance) {
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    std::filesystem::remove_all(directory_ / "a");
    std::filesystem::remove_all(directory_ / "b");
    write_pair(2,
               [&](state::Frame& frame) { frame.position[8] = frame.number == 2 ? bad : frame.position[8]; });
    const CacheReader a(directory_ / "a"), b(directory_ / "b");
    for (const Comparison& result : {compare(a, b, {.tolerance = 1e30}), compare(b, a, {.tolerance = 1e30}),
                                     compare(b, b, {.tolerance = 1e30})}) {
      EXPECT_FALSE(result.same);
      EXPECT_EQ(result.worst_frame, 2);
      EXPECT_EQ(result.overall.non_finite, 1);
      EXPECT_EQ(result.overall.strand, 1);
    }
  }
}

TEST_F(CacheCompareTest, ExactSeesEveryFieldAndTheSignOfZero) {
  write_pair(1, [](state::Frame& frame) { frame.velocity[3] = std::nextafter(frame.velocity[3], 2.0f); });
  EXPECT_TRUE(compare_pair().same);
  EXPECT_FALSE(compare_pair({.tolerance = 0, .exact = true}).same);
}

TEST_F(CacheCompareTest, OtherFramesAreADifference) {
  write_small(directory_ / "a", 1, 3);
  write_small(directory_ / "b", 2, 4);
  const Comparison result = compare_pair();
  EXPECT_FALSE(result.same);
  EXPECT_THAT(result.only_a, ElementsAre(1));
  EXPECT_THAT(result.only_b, ElementsAre(4));
  EXPECT_EQ(result.overall.max, 0);
  EXPECT_EQ(result.frames.size(), 2u);
}

TEST_F(CacheCompareTest, CachesWithoutFramesAreNotTheSame) {
  write_small(directory_ / "a", 1, 0);
  write_small(directory_ / "b", 1, 0);
  EXPECT_FALSE(compare_pair().same);
}

TEST_F(CacheCompareTest, TopologyIsToldByStrandAndCount) {
  state::RunHeader header = small_header();
  header.offsets = {0, 2, 5, 9};
  write_pair(
      1, [](state::Frame&) {}, header);
  Comparison result = compare_pair();
  EXPECT_FALSE(result.same);
  EXPECT_EQ(result.topology, "strand 1 has 4 against 3 particles");
  EXPECT_THAT(result.frames, IsEmpty());

  std::filesystem::remove_all(directory_ / "b");
  header.offsets = {0, 9};
  header.root_triangle = {0};
  header.root_barycentric = {1, 0, 0};
  header.groom_of_strand = {0};
  write_small(directory_ / "b", 1, 1, {}, header);
  EXPECT_EQ(compare_pair().topology, "3 against 1 strands");
}

TEST_F(CacheCompareTest, ProvenanceNamesWhatDiffersByJsonPointer) {
  state::RunHeader header = small_header();
  header.backend = "cuda";
  header.scene_json = R"({"frames": {"first": 1, "last": 3}, "model": {"drag": 0.5, "type": "ams"}})";
  write_pair(
      1, [](state::Frame&) {}, header);
  const Comparison result = compare_pair();
  EXPECT_TRUE(result.same);
  std::vector<std::string> lines;
  for (const Difference& d : result.provenance) lines.push_back(d.where + ": " + d.a + " | " + d.b);
  EXPECT_THAT(lines, ElementsAre("backend: cpu | cuda", "/model/drag: 0.25 | 0.5", "/model/substeps: 8 | ",
                                 "/model/type:  | \"ams\""));
}

TEST_F(CacheCompareTest, UnitsOfLengthAreConverted) {
  state::RunHeader metres = small_header();
  metres.metres_per_unit = 1;
  metres.length_unit = "m";
  write_pair(
      2,
      [](state::Frame& frame) {
        for (float& x : frame.position) x *= 0.01f;
      },
      metres);
  const Comparison result = compare_pair({.tolerance = 1e-6});
  EXPECT_TRUE(result.same) << result.overall.max;
}

}  // namespace
}  // namespace ringlet::cache
