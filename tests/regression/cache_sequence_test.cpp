// What other programs and other runs rely on: the master as one sequence, the same bytes, kills and resumes.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <hdf5.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "unit/cache_support.h"

namespace ringlet::cache {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

// All of a data set of the file by HDF5 alone, as another program would read it.
struct Sequence {
  std::vector<hsize_t> dims;
  std::vector<float> values;
};
Sequence read_sequence(const fs::path& file, const char* name) {
  Sequence sequence;
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t set = H5Dopen2(id, name, H5P_DEFAULT), space = H5Dget_space(set);
  sequence.dims.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  H5Sget_simple_extent_dims(space, sequence.dims.data(), nullptr);
  sequence.values.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, sequence.values.data()), 0);
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(id);
  return sequence;
}

std::vector<float> positions(std::initializer_list<int> frames) {
  std::vector<float> all;
  for (const int number : frames) {
    const state::Frame frame = small_frame(number);
    all.insert(all.end(), frame.position.begin(), frame.position.end());
  }
  return all;
}

TEST_F(CacheTest, TheMasterIsOneSequenceOfTheFramesThatExist) {
  for (const Compression compression : {Compression::kNone, Compression::kDefault}) {
    CacheWriter writer(directory_, small_header(),
                       {.compression = compression, .existing = Existing::kOverwrite});
    for (const int number : {1, 2, 4}) writer.write(small_frame(number), {}, 0);
    writer.finish();
    const Sequence position = read_sequence(directory_ / "small.h5", "position");
    EXPECT_THAT(position.dims, ElementsAre(3, 9, 3));
    EXPECT_EQ(position.values, positions({1, 2, 4}));
    EXPECT_THAT(read_sequence(directory_ / "small.h5", "frames").values, ElementsAre(1, 2, 4));
    EXPECT_THAT(read_sequence(directory_ / "small.h5", "figures/iterations").values, ElementsAre(3, 4, 6));
    EXPECT_THAT(read_sequence(directory_ / "small.h5", "velocity").dims, ElementsAre(3, 9, 3));
    const Sequence head = read_sequence(directory_ / "small.h5", "surfaces/0/vertices");
    EXPECT_THAT(head.dims, ElementsAre(3, 3, 3));
    EXPECT_EQ(head.values[9 + 7], 2);
  }
}

TEST_F(CacheTest, TheDirectoryMayMoveAndItsNameMayHoldAnything) {
  state::RunHeader header = small_header();
  header.name = "100%b hair";
  write_small(directory_ / "a", 1, 3, {}, header);
  fs::rename(directory_ / "a", directory_ / "b %d");
  EXPECT_EQ(read_sequence(directory_ / "b %d" / "100%b hair.h5", "position").values, positions({1, 2, 3}));
}

TEST_F(CacheTest, ADeletedFrameReadsAsNotANumber) {
  write_small(directory_, 1, 2);
  fs::remove(directory_ / "small.0001.h5");
  const Sequence position = read_sequence(directory_ / "small.h5", "position");
  for (std::size_t i = 0; i < 27; ++i) EXPECT_TRUE(std::isnan(position.values[i]));
  EXPECT_EQ(std::vector<float>(position.values.begin() + 27, position.values.end()), positions({2}));
}

TEST_F(CacheTest, TheSameFramesAreTheSameBytes) {
  const auto write = [&](const char* into, const state::RunHeader& header) {
    for (const Compression compression : {Compression::kNone, Compression::kDefault, Compression::kQuantised})
      write_small(directory_ / into / to_string(compression), 1, 2,
                  {.compression = compression, .error = 1e-4}, header);
  };
  write("a", small_header());
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // a time stamp would differ
  state::RunHeader other = small_header();                       // provenance is the master's alone
  other.program_version = "9.9";
  other.instruction_set = "avx512";
  write("b", other);
  for (const char* compression : {"none", "default", "quantised"}) {
    for (const char* name : {"small.0001.h5", "small.0002.h5", "small.state.h5"}) {
      EXPECT_TRUE(bytes_of_file(directory_ / "a" / compression / name) ==
                  bytes_of_file(directory_ / "b" / compression / name))
          << compression << ' ' << name;
    }
  }
}

// ---- Resuming -----------------------------------------------------------------------------------

TEST_F(CacheTest, ResumingGoesOnFromTheLastState) {
  write_small(directory_, 1, 2);
  std::ofstream(directory_ / ".small.0003.h5.tmp") << "half a frame";
  std::ofstream(directory_ / "small.failed.h5") << "of an earlier try";
  {
    CacheWriter writer(directory_, small_header(), {.existing = Existing::kResume});
    const auto point = writer.take_resume_point();
    ASSERT_TRUE(point);
    EXPECT_EQ(point->frame, 2);
    EXPECT_EQ(point->arrays, small_snapshot(2).arrays);
    EXPECT_FALSE(writer.take_resume_point());
    EXPECT_THAT(CacheReader(directory_).frames(), ElementsAre(1, 2));
    writer.write(small_frame(3), small_snapshot(3), 0.5);
    writer.finish();
  }
  EXPECT_EQ(read_sequence(directory_ / "small.h5", "position").values, positions({1, 2, 3}));
  EXPECT_THAT(read_sequence(directory_ / "small.h5", "figures/iterations").values, ElementsAre(3, 4, 5));
  EXPECT_THAT(files_in(directory_), ElementsAre("small.0001.h5", "small.0002.h5", "small.0003.h5", "small.h5",
                                                "small.state.h5", "small.timings.jsonl"));

  write_small(directory_ / "whole", 1, 3);
  for (const char* name : {"small.0001.h5", "small.0002.h5", "small.0003.h5", "small.h5", "small.state.h5"})
    EXPECT_TRUE(bytes_of_file(directory_ / name) == bytes_of_file(directory_ / "whole" / name)) << name;
}

TEST_F(CacheTest, ResumingWithoutAStateOrWithAMissingFrameStartsAnew) {
  const auto resume_point = [&] {
    return CacheWriter(directory_, small_header(), {.existing = Existing::kResume}).take_resume_point();
  };
  EXPECT_FALSE(resume_point());  // nothing there at all
  write_small(directory_, 1, 3, {.existing = Existing::kOverwrite});
  EXPECT_EQ(resume_point()->frame, 3);
  fs::rename(directory_ / "small.0002.h5", directory_ / "kept");
  EXPECT_FALSE(resume_point());
  fs::rename(directory_ / "kept", directory_ / "small.0002.h5");
  EXPECT_EQ(resume_point()->frame, 3);
  fs::resize_file(directory_ / "small.0001.h5", 200);
  EXPECT_FALSE(resume_point());
  write_small(directory_, 1, 3, {.existing = Existing::kOverwrite});
  fs::remove(directory_ / "small.state.h5");
  EXPECT_FALSE(resume_point());
}

TEST_F(CacheTest, OnlyTheSameRunIsResumed) {
  write_small(directory_, 1, 2);
  const auto refusal = [&](auto change) -> std::string {
    state::RunHeader header = small_header();
    change(header);
    const Error error = error_of([&] { CacheWriter(directory_, header, {.existing = Existing::kResume}); });
    EXPECT_EQ(error.kind(), ErrorKind::kUsage);
    return error.what();
  };
  EXPECT_THAT(
      refusal([](auto& h) { h.scene_json = R"({"frames": {"first": 1, "last": 3}, "model": {"drag": 1}})"; }),
      HasSubstr("the scene's /model/drag was 0.25 and is 1"));
  EXPECT_THAT(refusal([](auto& h) { h.backend = "cuda"; }), HasSubstr("its backend was cpu, now cuda"));
  EXPECT_THAT(refusal([](auto& h) { h.precision = "double"; }),
              HasSubstr("its precision was float, now double"));
  EXPECT_THAT(refusal([](auto& h) { h.rest_position[4] += 1; }), HasSubstr("the strands are not the same"));

  state::RunHeader longer = small_header();
  longer.last_frame = 5;
  longer.scene_json = R"({"frames": {"first": 1, "last": 5}, "model": {"drag": 0.25, "substeps": 8}})";
  CacheWriter writer(directory_, longer, {.existing = Existing::kResume});
  EXPECT_EQ(writer.take_resume_point()->frame, 2);
}

TEST_F(CacheTest, AKilledRunLeavesWholeFramesAndAMasterThatReads) {
  const pid_t child = ::fork();
  if (child == 0) {
    CacheWriter writer(directory_, small_header());
    for (int number = 1;; ++number) writer.write(small_frame(number), small_snapshot(number), 0.001);
  }
  while (!fs::exists(directory_ / "small.0040.h5")) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);

  const CacheReader reader(directory_);
  ASSERT_GE(reader.frames().size(), 40u);
  for (const int number : reader.frames())
    EXPECT_EQ(reader.read(number).position, small_frame(number).position);
  EXPECT_EQ(read_sequence(directory_ / "small.h5", "position").dims.size(), 3u);

  CacheWriter writer(directory_, small_header(), {.existing = Existing::kResume});
  const auto point = writer.take_resume_point();
  ASSERT_TRUE(point);  // the first frame's at least
  EXPECT_EQ(point->arrays, small_snapshot(point->frame).arrays);
  for (const std::string& name : files_in(directory_)) EXPECT_FALSE(name.ends_with(".tmp")) << name;
  const auto listed = read_sequence(directory_ / "small.h5", "frames").values;
  EXPECT_EQ(std::vector<int>(listed.begin(), listed.end()), reader.frames());
}

TEST_F(CacheTest, TheMasterFollowsWhileTheRunGoesOn) {
  CacheWriter writer(directory_, small_header());
  EXPECT_TRUE(CacheReader(directory_).frames().empty());
  writer.write(small_frame(1), small_snapshot(1), 0);
  writer.write(small_frame(2), small_snapshot(2), 0);
  for (int tries = 0; tries < 300; ++tries) {  // within a second of the last, though no further frame comes
    if (H5Fis_hdf5((directory_ / "small.0002.h5").c_str()) > 0 &&
        read_sequence(directory_ / "small.h5", "frames").values.size() == 2)
      break;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(read_sequence(directory_ / "small.h5", "position").values, positions({1, 2}));
  EXPECT_EQ(read_state_file(directory_ / "small.state.h5").frame, 2);
}

}  // namespace
}  // namespace ringlet::cache
