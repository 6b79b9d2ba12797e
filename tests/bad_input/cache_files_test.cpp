// Files that are no cache, not this program's, damaged or lying; directories and disks that do not take a
// cache.
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <sys/resource.h>

#include <csignal>

#include "cache/compare.h"
#include "cache/files.h"
#include "cache/hdf5.h"
#include "unit/cache_support.h"

namespace ringlet::cache {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class CacheBadInputTest : public CacheTest {
 protected:
  // Opening `path` must fail with Error{kInput} that names it and says `what`.
  void expect_refused(const fs::path& path, const std::string& what) {
    const Error error = error_of([&] { CacheReader reader(path); });
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    EXPECT_THAT(error.what(), HasSubstr(what));
  }
  void truncate(const fs::path& path, double part) {
    fs::resize_file(path, static_cast<std::uintmax_t>(part * static_cast<double>(fs::file_size(path))));
  }
  // Writes an HDF5 file with the attributes that every file of a cache has, and what `fill` adds.
  template <class Fill>
  void write_image(const fs::path& path, const std::string& format, int version, const std::string& content,
                   Fill fill) {
    const h5::Image image(path);
    image.set("format", format);
    image.set("format_version", static_cast<std::int32_t>(version));
    image.set("content", content);
    fill(image);
    write_atomically(path, image.bytes());
  }
};

TEST_F(CacheBadInputTest, WhatIsNoCacheIsRefused) {
  expect_refused(directory_ / "none.h5", "no such file");
  expect_refused(directory_, "holds no Ringlet cache");
  std::ofstream(directory_ / "text.h5") << "hello";
  expect_refused(directory_ / "text.h5", "is not an HDF5 file");
  std::ofstream(directory_ / "empty.h5");
  expect_refused(directory_ / "empty.h5", "is not an HDF5 file");

  const h5::Image foreign(directory_ / "foreign.h5");
  write_atomically(directory_ / "foreign.h5", foreign.bytes());
  expect_refused(directory_ / "foreign.h5", "not of a Ringlet cache");
  write_image(directory_ / "groom.h5", "ringlet-groom", 1, "", [](const auto&) {});
  expect_refused(directory_ / "groom.h5", "is of the format ringlet-groom");
  EXPECT_EQ(content_of(directory_ / "groom.h5"), std::nullopt);
  EXPECT_EQ(format_of(directory_ / "groom.h5"), "ringlet-groom");
}

TEST_F(CacheBadInputTest, NewerFormatsAreRefused) {
  write_image(directory_ / "newer.h5", "ringlet-cache", 2, "master", [](const auto&) {});
  expect_refused(directory_ / "newer.h5", "is of cache format 2; this program reads up to 1");
  write_image(directory_ / "strange.h5", "ringlet-cache", 1, "dream", [](const auto&) {});
  expect_refused(directory_ / "strange.h5", "holds 'dream'");
}

TEST_F(CacheBadInputTest, AFileOfACacheIsNotTheCache) {
  write_small(directory_, 1, 1);
  expect_refused(directory_ / "small.0001.h5", "is the frame file of a cache");
  expect_refused(directory_ / "small.state.h5", "is the state file of a cache");
}

TEST_F(CacheBadInputTest, TwoCachesInADirectoryMustBeToldApart) {
  state::RunHeader other = small_header();
  other.name = "other";
  write_small(directory_, 1, 1);
  write_small(directory_, 1, 1, {}, other);
  expect_refused(directory_, "holds 2 caches (give one of them: ");
  EXPECT_EQ(CacheReader(directory_ / "other.h5").header().name, "other");
}

TEST_F(CacheBadInputTest, TruncatedFilesAreNamed) {
  for (const double part : {0.01, 0.5, 0.99}) {
    write_small(directory_, 1, 2, {.existing = Existing::kOverwrite});
    truncate(directory_ / "small.0002.h5", part);
    const CacheReader reader(directory_);
    EXPECT_EQ(reader.read(1).number, 1);
    const Error error = error_of([&] { reader.read(2); });
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_THAT(error.what(), HasSubstr("small.0002.h5"));

    truncate(directory_ / "small.h5", part);
    EXPECT_THAT(error_of([&] { CacheReader{directory_}; }).what(), HasSubstr("small.h5"));
    expect_refused(directory_ / "small.h5", part < 0.1 ? "" : "is truncated");
  }
}

TEST_F(CacheBadInputTest, EveryDamagedByteIsFound) {
  write_small(directory_, 1, 1);
  for (const char* name : {"small.h5", "small.0001.h5"}) {
    const std::string sound = bytes_of_file(directory_ / name);
    for (std::size_t at = 0; at < sound.size() - 16; at += 13) {  // the last 16 bytes are the checksum itself
      std::string damaged = sound;
      damaged[at] = static_cast<char>(damaged[at] ^ 0x21);
      fs::remove(directory_ / name);  // rewriting in place would wait for the disk
      std::ofstream(directory_ / name, std::ios::binary) << damaged;
      const Error error = error_of([&] { CacheReader(directory_ / "small.h5").read(1); });
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
    }
    std::ofstream(directory_ / name, std::ios::binary)
        << sound.substr(0, sound.size() - 16);  // none is as good
    EXPECT_EQ(CacheReader(directory_).read(1).position, small_frame(1).position);
  }
}

TEST_F(CacheBadInputTest, ACountOfFourBillionAllocatesNothing) {
  write_image(directory_ / "lying.0001.h5", "ringlet-cache", 1, "frame", [](const h5::Image& image) {
    image.set("frame", std::int32_t{1});
    image.set("time", 0.0);
  });
  {  // a chunked data set of four billion points of which none was ever written
    const hid_t file = H5Fopen((directory_ / "lying.0001.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    const hsize_t dims[] = {4000000000u, 3}, chunk[] = {1000, 3};
    const hid_t space = H5Screate_simple(2, dims, nullptr), properties = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(properties, 2, chunk);
    H5Dclose(H5Dcreate2(file, "position", H5T_IEEE_F32LE, space, H5P_DEFAULT, properties, H5P_DEFAULT));
    H5Pclose(properties);
    H5Sclose(space);
    H5Fclose(file);
  }
  const Error error = error_of([&] { read_frame_file(directory_ / "lying.0001.h5"); });
  EXPECT_THAT(error.what(),
              HasSubstr("lying.0001.h5:/position: claims the shape [4000000000, 3], more than"));
}

TEST_F(CacheBadInputTest, AFrameOfAnotherGroomOrNumberIsRefused) {
  write_small(directory_, 1, 2);
  fs::rename(directory_ / "small.0002.h5", directory_ / "small.0003.h5");
  EXPECT_THAT(error_of([&] { CacheReader(directory_).read(3); }).what(), HasSubstr("holds frame 2"));

  state::RunHeader other = small_header();
  other.offsets = {0, 2, 6, 8};
  other.rest_position.resize(24);
  other.width.resize(8);
  state::Frame frame = small_frame(1);
  frame.position.resize(24);
  frame.velocity.resize(24);
  {
    CacheWriter writer(directory_ / "other", other);
    EXPECT_THROW(writer.write(small_frame(1), {}, 0), std::invalid_argument);
    writer.write(frame, {}, 0);
    writer.finish();
  }
  fs::copy_file(directory_ / "other" / "small.0001.h5", directory_ / "small.0001.h5",
                fs::copy_options::overwrite_existing);
  EXPECT_THAT(error_of([&] { CacheReader(directory_).read(1); }).what(),
              HasSubstr("small.0001.h5:/position: has the shape [8, 3], expected [9, 3]"));
}

TEST_F(CacheBadInputTest, ADamagedStateIsRefused) {
  write_small(directory_, 1, 2);
  std::string bytes = bytes_of_file(directory_ / "small.state.h5");
  const auto at = bytes.find(std::string(37, '\2'));  // the array of small_snapshot(2)
  ASSERT_NE(at, std::string::npos);
  bytes[at + 5] = 3;
  std::ofstream(directory_ / "small.state.h5", std::ios::binary) << bytes;
  EXPECT_THAT(error_of([&] { read_state_file(directory_ / "small.state.h5"); }).what(),
              HasSubstr("small.state.h5: is damaged: its checksum does not match"));
  CacheWriter writer(directory_, small_header(), {.existing = Existing::kResume});
  EXPECT_FALSE(writer.take_resume_point());
}

TEST_F(CacheBadInputTest, ADirectoryBelowAFileCannotBeMade) {
  std::ofstream(directory_ / "file") << "x";
  for (const fs::path& path : {directory_ / "file", directory_ / "file" / "below"}) {
    const Error error = error_of([&] { write_small(path, 1, 1); });
    EXPECT_EQ(error.kind(), ErrorKind::kIo);
    EXPECT_THAT(error.what(), HasSubstr("is not a directory"));
    EXPECT_EQ(error_of([&] { check_destination(path, "small", Existing::kRefuse); }).kind(), ErrorKind::kIo);
  }
}

TEST_F(CacheBadInputTest, ADirectoryWithoutPermissionIsNamed) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  fs::permissions(directory_, fs::perms::owner_read | fs::perms::owner_exec);
  const Error error = error_of([&] { write_small(directory_ / "below", 1, 1); });
  fs::permissions(directory_, fs::perms::owner_all);
  EXPECT_EQ(error.kind(), ErrorKind::kIo);
  EXPECT_THAT(error.what(), HasSubstr("Permission denied"));
}

// Frames of a megabyte until the sink refuses them; nothing unfinished may be left, and what was written must
// read.
void fill_up(const fs::path& directory, const std::string& reason) {
  state::RunHeader header = small_header();
  const std::int64_t particles = 87382;
  header.offsets = {0, particles};
  header.root_triangle = {-1};
  header.root_barycentric = {0, 0, 0};
  header.rest_position.assign(3 * particles, 0);
  header.width.assign(particles, 1);
  header.groom_of_strand = {0};
  header.surfaces = {};
  const auto frame = [&](int number) {
    state::Frame made;
    made.number = number;
    made.position.assign(3 * particles, static_cast<float>(number));
    return made;
  };
  CacheWriter writer(directory, header, {.compression = Compression::kNone});
  const Error error = error_of([&] {
    for (int number = 1; number <= 100; ++number) writer.write(frame(number), {}, 0);
    writer.finish();
  });
  EXPECT_EQ(error.kind(), ErrorKind::kIo);
  EXPECT_THAT(error.what(), HasSubstr(directory.string() + "/small."));
  EXPECT_THAT(error.what(), HasSubstr(reason));
  EXPECT_EQ(error_of([&] { writer.write(frame(101), {}, 0); }).kind(), ErrorKind::kIo);
  EXPECT_EQ(error_of([&] { writer.finish(); }).kind(), ErrorKind::kIo);

  for (const std::string& name : files_in(directory)) EXPECT_FALSE(name.ends_with(".tmp")) << name;
  const CacheReader reader(directory);
  for (const int number : reader.frames()) EXPECT_EQ(reader.read(number).position, frame(number).position);
}

// A small disk, unmounted at the end of the test.
struct SmallDisk {
  explicit SmallDisk(const fs::path& at) : path(at) {
    fs::create_directory(path);
    mounted = ::mount("tmpfs", path.c_str(), "tmpfs", 0, "size=6m") == 0;
  }
  ~SmallDisk() {
    if (mounted) ::umount(path.c_str());
  }
  fs::path path;
  bool mounted;
};

TEST_F(CacheBadInputTest, AFullDiskIsAnErrorAndLeavesNothingUnfinished) {
  const SmallDisk disk(directory_ / "disk");
  if (!disk.mounted) GTEST_SKIP() << "tmpfs cannot be mounted here";
  fill_up(disk.path / "cache", "No space left on device (make room and go on with --resume)");
  EXPECT_GE(CacheReader(disk.path / "cache").frames().size(), 1u);
}

TEST_F(CacheBadInputTest, AFileTooLargeIsAnErrorAndLeavesNothingUnfinished) {
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  {
    // The master fits, the frames do not: their headers tip the scale.
    state::RunHeader header = small_header();
    CacheWriter writer(directory_ / "cache", header);
    const rlimit limit{1024, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    const Error error = error_of([&] {
      writer.write(small_frame(1), small_snapshot(1), 0);
      writer.finish();
    });
    ::setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(error.kind(), ErrorKind::kIo);
    EXPECT_THAT(error.what(), HasSubstr("small.0001.h5: cannot be written: File too large"));
  }
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(files_in(directory_ / "cache"), testing::ElementsAre("small.h5"));
  EXPECT_TRUE(CacheReader(directory_ / "cache").frames().empty());
}

}  // namespace
}  // namespace ringlet::cache
