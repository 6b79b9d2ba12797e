// Damaged and lying groom files: always a typed error that says where, never a crash or an allocation by
// their word.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/resource.h>

#include <functional>
#include <limits>

#include "core/error.h"
#include "unit/groom_support.h"

namespace ringlet::groom::test {
namespace {
using testing::AllOf;
using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
constexpr std::uint32_t kFourBillion = 4'000'000'000;

std::string message_of(const std::function<void()>& action, ErrorKind kind = ErrorKind::kInput) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), kind);
    return error.what();
  }
  return "no error";
}

std::string read_error(const std::string& name, const Bytes& bytes) {
  const Folder folder;
  const auto file = folder.write(name, bytes);
  const std::string message = message_of([&] { read(file, std::nullopt, {}, kMetres); });
  EXPECT_THAT(message, HasSubstr(file.string()));
  return message;
}

TEST(GroomBadInput, MissingFileFolderAndUnknownFormat) {
  const Folder folder;
  const auto error = [&](const std::filesystem::path& file) {
    return message_of([&] { read(file, std::nullopt, {}, kMetres); });
  };
  EXPECT_THAT(error(folder.file("none.hair")), HasSubstr("no such groom file"));
  EXPECT_THAT(error(folder.file("")), HasSubstr("cannot be read"));
  EXPECT_THAT(read_error("empty.hair", Bytes()), HasSubstr("the file is empty"));
  EXPECT_THAT(read_error("a.xyz", tfx3_file()),
              AllOf(HasSubstr(".xyz"), HasSubstr("expected .hair, .data, .tfx")));
  EXPECT_THAT(
      message_of([&] { read(folder.write("a.tfx", tfx3_file()), folder.file("no.tfxskin"), {}, kMetres); }),
      HasSubstr("no such groom file"));
}

TEST(GroomBadInput, TruncationsOfEveryFormatAreRefused) {
  const std::vector<std::pair<std::string, Bytes>> files = {
      {"a.hair", hair_file()}, {"a.data", data_file()}, {"a3.tfx", tfx3_file()}, {"a4.tfx", tfx4_file()}};
  for (const auto& [name, whole] : files) {
    for (std::size_t cut = 1; cut < whole.size(); cut += 3) {
      Bytes bytes = whole;
      EXPECT_THAT(read_error(name, bytes.truncate(cut)), testing::Not(HasSubstr("no error")))
          << name << " less " << cut;
    }
  }
  EXPECT_THAT(read_error("a.hair", hair_file().truncate(1)),
              AllOf(HasSubstr("byte 192"), HasSubstr("thickness"), HasSubstr("truncated")));
}

TEST(GroomBadInput, CountsOfFourBillionAllocateNothing) {
  const std::vector<std::pair<std::string, Bytes>> files = {
      {"strands.hair", hair_file().put(4, kFourBillion)},
      {"points.hair", hair_file().put(8, kFourBillion)},
      {"default.hair", hair_file().put(12, 2u).put(16, kFourBillion)},
      {"strands.data", data_file().put(0, std::int32_t{2'000'000'000})},
      {"vertices.data", data_file().put(4, std::int32_t{2'000'000'000})},
      {"strands.tfx", tfx3_file().put(4, kFourBillion)},
      {"both.tfx", tfx4_file().put(4, kFourBillion).put(8, kFourBillion)},
      {"offset.tfx", tfx3_file().put(36 * 4, kFourBillion)},
      {"offset4.tfx", tfx4_file().put(12, kFourBillion)}};
  rusage before, after;
  getrusage(RUSAGE_SELF, &before);
  for (const auto& [name, bytes] : files) EXPECT_THAT(read_error(name, bytes), HasSubstr("byte ")) << name;
  getrusage(RUSAGE_SELF, &after);
  EXPECT_LE(after.ru_maxrss - before.ru_maxrss, 64 * 1024);  // [KiB]
}

TEST(GroomBadInput, LyingHeaders) {
  EXPECT_THAT(read_error("a.hair", hair_file().put(8, 4u).truncate(4)),
              AllOf(HasSubstr("byte 8"), HasSubstr("says 4 points"), HasSubstr("at least 5")));
  EXPECT_THAT(read_error("a.hair", hair_file().put(12, 1u)),
              AllOf(HasSubstr("byte 12"), HasSubstr("points array")));
  EXPECT_THAT(read_error("a.tfx", tfx3_file().put(0, 2.0f)), HasSubstr("version is 2, expected 3 or 4"));
  EXPECT_THAT(read_error("a.tfx", tfx3_file().put(0, kNan)), HasSubstr("version is nan"));
  EXPECT_THAT(read_error("a.tfx", tfx3_file().put(36 * 4, 16u)), HasSubstr("inside the header"));
}

TEST(GroomBadInput, EmptyGroomsAndStrands) {
  EXPECT_THAT(read_error("a.hair", hair_file().put(4, 0u)), HasSubstr("the groom is empty"));
  EXPECT_THAT(read_error("a.data", data_file().put(0, 0)),
              HasSubstr("strand count is 0, expected at least 1"));
  EXPECT_THAT(read_error("a.data", data_file().put(0, -1)), HasSubstr("strand count is -1"));
  EXPECT_THAT(read_error("a.data", data_file().put(32, 0)),
              AllOf(HasSubstr("byte 32"), HasSubstr("vertex count of strand 1 is 0")));
  EXPECT_THAT(read_error("a.data", Bytes().add(1).add(1).floats({1, 2, 3})), HasSubstr("the groom is empty"));
  EXPECT_THAT(read_error("a.tfx", tfx3_file().put(4, 0u)), HasSubstr("the groom is empty"));
  EXPECT_THAT(read_error("a.tfx", tfx3_file().put(8, 0u)), HasSubstr("strands have 0 vertices"));
}

TEST(GroomBadInput, CoordinatesThatAreNoNumbers) {
  EXPECT_THAT(read_error("a.hair", hair_file().put(132 + 4 * 10, kNan)),
              AllOf(HasSubstr("byte 172"), HasSubstr("strand 1, particle 1: coordinate y is nan")));
  EXPECT_THAT(
      read_error("a.data", data_file().put(52, kInf)),  // numbered as in the file, though strand 1 is dropped
      AllOf(HasSubstr("byte 52"), HasSubstr("strand 2, particle 0: coordinate x is inf")));
  EXPECT_THAT(read_error("a.tfx", tfx3_file().put(296 + 4 * 5, -kInf)),
              HasSubstr("strand 0, particle 1: coordinate z is -inf"));
  EXPECT_THAT(read_error("a.tfx", tfx4_file().put(168 + 4 * 8, kNan)),
              HasSubstr("strand 1, particle 0: coordinate x is nan"));
  EXPECT_THAT(read_error("a.hair", hair_file().put(192 + 4, kNan)), HasSubstr("point 1: thickness is nan"));
}

TEST(GroomBadInput, Skins) {
  const Folder folder;
  const auto groom = folder.write("a.tfx", tfx3_file());
  const auto error = [&](const Bytes& bytes) {
    const auto skin = folder.write("s.tfxskin", bytes);
    return message_of([&] { read(groom, skin, {}, kMetres); });
  };
  EXPECT_THAT(error(skin_file().put(4, 3u)), HasSubstr("the skin is for 3 strands, the groom has 2"));
  EXPECT_THAT(error(skin_file().put(34 * 4, kFourBillion)), HasSubstr("roots"));
  EXPECT_THAT(error(skin_file().truncate(1)), HasSubstr("truncated"));
  EXPECT_THAT(error(skin_file().put(268 + 4, kFourBillion)),
              HasSubstr("root triangle 4000000000 does not exist"));
  EXPECT_THAT(error(skin_file().put(268 + 8, kNan)), HasSubstr("strand 0: barycentric coordinate 0 is nan"));
}

// Ringlet's own file with one data set or attribute replaced.
class OwnFile : public testing::Test {
 protected:
  OwnFile() {
    Strands strands;
    strands.offsets = {0, 2, 3};
    strands.points = {Vec3(0, 0, 0), Vec3(0, 1, 0), Vec3(1, 0, 0)};
    strands.widths = {1, 1, 1};
    strands.roots.resize(2);
    strands.groups = {0, 0};
    strands.group_names = {"hair"};
    write(path_, strands, scene::Axis::kY);
    file_ = H5Fopen(path_.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  }
  template <class T>
  void replace(const char* name, hid_t type, const std::vector<hsize_t>& shape,
               const std::vector<T>& values) {
    H5Ldelete(file_, name, H5P_DEFAULT);
    const hid_t space = H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t set = H5Dcreate2(file_, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (!values.empty()) H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(set), H5Sclose(space);
  }
  void replace_number(const char* name, double value) {
    H5Adelete(file_, name);
    const hid_t space = H5Screate(H5S_SCALAR),
                attr = H5Acreate2(file_, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attr, H5T_NATIVE_DOUBLE, &value);
    H5Aclose(attr), H5Sclose(space);
  }
  std::string error() {
    H5Fclose(file_);
    return message_of([&] { read(path_, std::nullopt, {}, kMetres); });
  }

  Folder folder_;
  std::filesystem::path path_ = folder_.file("own.h5");
  hid_t file_;
};

TEST_F(OwnFile, LyingExtentAllocatesNothing) {
  replace<double>("points", H5T_NATIVE_DOUBLE, {kFourBillion, 3}, {});
  EXPECT_THAT(error(),
              AllOf(HasSubstr("own.h5:/points"), HasSubstr("4000000000 rows"), HasSubstr("truncated")));
}
TEST_F(OwnFile, LyingChunkedExtentAllocatesNothing) {
  H5Ldelete(file_, "offsets", H5P_DEFAULT);
  const hsize_t extent = kFourBillion, chunk = 1024;
  const hid_t space = H5Screate_simple(1, &extent, nullptr), plan = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(plan, 1, &chunk), H5Pset_deflate(plan, 9);
  H5Dclose(H5Dcreate2(file_, "offsets", H5T_NATIVE_INT64, space, H5P_DEFAULT, plan, H5P_DEFAULT));
  H5Pclose(plan), H5Sclose(space);
  EXPECT_THAT(error(), HasSubstr("own.h5:/offsets: says it has 4000000000 rows"));
}
TEST_F(OwnFile, NanNamesStrandAndParticle) {
  replace<double>("points", H5T_NATIVE_DOUBLE, {3, 3}, {0, 0, 0, 0, double(kNan), 0, 0, 0, 0});
  EXPECT_THAT(error(), HasSubstr("strand 0, particle 1: nan"));
}
TEST_F(OwnFile, StrandWithoutParticles) {
  replace<std::int64_t>("offsets", H5T_NATIVE_INT64, {4}, {0, 2, 2, 3});
  EXPECT_THAT(error(), HasSubstr("strand 1 goes from particle 2 to 2"));
}
TEST_F(OwnFile, OffsetsThatDoNotBeginWithZero) {
  replace<std::int64_t>("offsets", H5T_NATIVE_INT64, {3}, {1, 2, 3});
  EXPECT_THAT(error(), HasSubstr("begins with 1, expected 0"));
}
TEST_F(OwnFile, OffsetsBeyondThePoints) {
  replace<std::int64_t>("offsets", H5T_NATIVE_INT64, {3}, {0, 2, 1'000'000'000'000});
  EXPECT_THAT(error(), HasSubstr("/points: has 3 rows, expected 1000000000000"));
}
TEST_F(OwnFile, Empty) {
  replace<std::int64_t>("offsets", H5T_NATIVE_INT64, {1}, {0});
  EXPECT_THAT(error(), HasSubstr("the groom is empty"));
}
TEST_F(OwnFile, WrongShapeAndType) {
  replace<double>("points", H5T_NATIVE_DOUBLE, {9}, {0, 0, 0, 0, 0, 0, 0, 0, 0});
  EXPECT_THAT(error(), HasSubstr("has 1 dimensions, expected 2"));
}
TEST_F(OwnFile, OffsetsOfFloats) {
  replace<double>("offsets", H5T_NATIVE_DOUBLE, {3}, {0, 2, 3});
  EXPECT_THAT(error(), HasSubstr("is not of an integer type"));
}
TEST_F(OwnFile, MissingDataSet) {
  H5Ldelete(file_, "points", H5P_DEFAULT);
  EXPECT_THAT(error(), HasSubstr("/points: data set is missing"));
}
TEST_F(OwnFile, UnknownGroup) {
  replace<std::int32_t>("groups", H5T_NATIVE_INT32, {2}, {0, 5});
  EXPECT_THAT(error(), HasSubstr("/groups: strand 1: 5 found, expected 0 to 0"));
}
TEST_F(OwnFile, ForeignHdf5) {
  H5Adelete(file_, "format");
  EXPECT_THAT(error(), HasSubstr("/format: attribute is missing (this is no Ringlet groom"));
}
TEST_F(OwnFile, LaterVersion) {
  replace_number("version", 2);
  EXPECT_THAT(error(), HasSubstr("/version: is 2, this program reads 1"));
}
TEST_F(OwnFile, UnitThatIsNone) {
  replace_number("metres_per_unit", 0);
  EXPECT_THAT(error(), HasSubstr("/metres_per_unit: is 0, expected a positive number"));
}
TEST_F(OwnFile, Truncated) {
  H5Fflush(file_, H5F_SCOPE_GLOBAL);
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) - 200);
  H5Fclose(file_);
  std::filesystem::resize_file(path_, 1000);
  EXPECT_THAT(message_of([&] { read(path_, std::nullopt, {}, kMetres); }), HasSubstr("own.h5"));
}

TEST(GroomBadInput, WritingWhereNothingCanBeWritten) {
  const Folder folder;
  Strands strands;
  strands.offsets = {0, 1};
  strands.points = {Vec3::Zero()};
  strands.groups = {0};
  strands.group_names = {"a"};
  EXPECT_THAT(message_of([&] { write(folder.file("no/such/folder/a.h5"), strands, scene::Axis::kY); },
                         ErrorKind::kIo),
              HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace ringlet::groom::test
