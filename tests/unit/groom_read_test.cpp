// Every reader against bytes laid out here from its format's specification.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>

#include "unit/groom_support.h"

namespace ringlet::groom::test {
namespace {
using testing::ElementsAre;

Strands read_metres(const std::filesystem::path& file) { return read(file, std::nullopt, {}, kMetres); }

void expect_two_and_three(const Strands& strands) {
  EXPECT_THAT(strands.offsets, ElementsAre(0, 2, 5));
  EXPECT_THAT(strands.points,
              ElementsAre(Vec3(1, 2, 3), Vec3(1, 3, 3), Vec3(4, 5, 6), Vec3(4, 6, 6), Vec3(4, 7, 6)));
  EXPECT_THAT(strands.groups, ElementsAre(0, 0));
}

TEST(GroomRead, HairWithSegmentsAndThickness) {
  const Folder folder;
  const Strands strands =
      read(folder.write("bob.hair", hair_file()), std::nullopt, {0.01, scene::Axis::kY}, kMetres);
  ASSERT_EQ(strands.size(), 2u);
  EXPECT_THAT(strands.offsets, ElementsAre(0, 2, 5));
  EXPECT_EQ(strands.points[4], Vec3(4, 7, 6) * 0.01);
  ASSERT_EQ(strands.widths.size(), 5u);
  for (int i = 0; i < 5; ++i) EXPECT_FLOAT_EQ(strands.widths[i], 1e-4f * (i + 1));
  EXPECT_THAT(strands.group_names, ElementsAre("bob"));
}

TEST(GroomRead, HairWithDefaultSegmentsAndNoThickness) {
  Bytes bytes;
  bytes.add("HAIR", 4).add(2u).add(4u).add(2u).add(1u).add(1e-4f).zeros(104);
  bytes.floats({1, 2, 3, 1, 3, 3, 4, 5, 6, 4, 6, 6});
  const Folder folder;
  const Strands strands = read_metres(folder.write("a.hair", bytes));
  EXPECT_THAT(strands.offsets, ElementsAre(0, 2, 4));
  EXPECT_EQ(strands.points[3], Vec3(4, 6, 6));
  EXPECT_THAT(strands.widths, ElementsAre(1e-4f, 1e-4f, 1e-4f, 1e-4f));
}

TEST(GroomRead, HairThicknessThatIsNoHairsIsLeft) {
  Bytes bytes = hair_file();
  bytes.put(bytes.size() - 4, 0.5f);
  const Folder folder;
  EXPECT_TRUE(read_metres(folder.write("a.hair", bytes)).widths.empty());
}

TEST(GroomRead, HairStrandOfOneParticleIsKept) {
  Bytes bytes;
  bytes.add("HAIR", 4).add(1u).add(1u).add(2u).add(0u).zeros(108).floats({1, 2, 3});
  const Folder folder;
  EXPECT_THAT(read_metres(folder.write("a.hair", bytes)).offsets, ElementsAre(0, 1));
}

TEST(GroomRead, ContentGoesBeforeExtension) {
  const Folder folder;
  expect_two_and_three(read_metres(folder.write("misnamed.tfx", hair_file())));
}

TEST(GroomRead, HairSalonDropsStrandsOfOneVertex) {
  const Folder folder;
  const Strands strands = read_metres(folder.write("salon.data", data_file()));
  expect_two_and_three(strands);
  EXPECT_TRUE(strands.widths.empty());
  EXPECT_TRUE(strands.roots.empty());
}

TEST(GroomRead, TressFx3And4) {
  const Folder folder;
  for (const auto& [name, bytes] : {std::pair{"a.tfx", tfx3_file()}, std::pair{"b.tfx", tfx4_file()}}) {
    const Strands strands = read_metres(folder.write(name, bytes));
    EXPECT_THAT(strands.offsets, ElementsAre(0, 2, 4)) << name;
    EXPECT_THAT(strands.points, ElementsAre(Vec3(1, 2, 3), Vec3(1, 3, 3), Vec3(4, 5, 6), Vec3(4, 6, 6)))
        << name;
  }
}

TEST(GroomRead, TressFxSkinNamedOrBesideTheGroom) {
  const Folder folder;
  const auto groom = folder.write("fur.tfx", tfx3_file());
  EXPECT_TRUE(read_metres(groom).roots.empty());
  const auto skin = folder.write("other.tfxskin", skin_file());
  const Strands named = read(groom, skin, {}, kMetres);
  folder.write("fur.tfxskin", skin_file());
  const Strands beside = read_metres(groom);
  for (const Strands& strands : {named, beside}) {
    ASSERT_EQ(strands.roots.size(), 2u);
    EXPECT_EQ(strands.roots[0].triangle, 7);
    EXPECT_EQ(strands.roots[0].barycentric, Vec3(0.5, 0.25, 0.25));
    EXPECT_EQ(strands.roots[1].triangle, 0);
    EXPECT_EQ(strands.roots[1].barycentric, Vec3(0, 1, 0));
  }
}

// y up (1, 2, 3): the height 2 goes to the new up axis, and the turn keeps handedness.
TEST(GroomRead, UpAxisTurnsIntoTheScenes) {
  const Folder folder;
  const auto file = folder.write("a.tfx", tfx3_file());
  const auto first = [&](scene::Axis from, scene::Axis to) {
    return read(file, std::nullopt, {1.0, from}, {1.0, to}).points[0];
  };
  using enum scene::Axis;
  EXPECT_EQ(first(kY, kY), Vec3(1, 2, 3));
  EXPECT_EQ(first(kY, kZ), Vec3(1, -3, 2));
  EXPECT_EQ(first(kZ, kY), Vec3(1, 3, -2));
  EXPECT_EQ(first(kX, kY), Vec3(-2, 1, 3));
  EXPECT_EQ(first(kY, kX), Vec3(2, -1, 3));
  EXPECT_EQ(first(kZ, kX), Vec3(3, -1, -2));
  EXPECT_EQ(first(kX, kZ), Vec3(-2, -3, 1));
}

TEST(GroomRead, ScenesUnitIsTheFallback) {
  const Folder folder;
  const auto file = folder.write("a.tfx", tfx3_file());
  EXPECT_EQ(read(file, std::nullopt, {}, {0.01, scene::Axis::kY}).points[0], Vec3(1, 2, 3) * 0.01);
  EXPECT_EQ(read(file, std::nullopt, {0.5, {}}, {0.01, scene::Axis::kY}).points[0], Vec3(0.5, 1, 1.5));
}

Strands everything() {
  Strands strands;
  strands.offsets = {0, 1, 4};
  strands.points = {Vec3(0.1, 0.2, 0.3), Vec3(1.0 / 3, 0, -1), Vec3(0, 1e-9, 0), Vec3(7, 8, 9)};
  strands.widths = {1e-4f, 2e-4f, 3e-4f, 4e-4f};
  strands.roots = {{3, Vec3(0.1, 0.2, 0.7)}, {-1, Vec3::Zero()}};
  strands.groups = {1, 0};
  strands.group_names = {"hair", "a longer name"};
  return strands;
}

TEST(GroomRead, OwnFileRoundTripIsExact) {
  const Folder folder;
  const Strands written = everything();
  write(folder.file("own.h5"), written, scene::Axis::kZ);
  const Strands strands = read(folder.file("own.h5"), std::nullopt, {}, {1.0, scene::Axis::kZ});
  EXPECT_EQ(strands.offsets, written.offsets);
  EXPECT_EQ(strands.points, written.points);
  EXPECT_EQ(strands.widths, written.widths);
  EXPECT_EQ(strands.groups, written.groups);
  EXPECT_EQ(strands.group_names, written.group_names);
  ASSERT_EQ(strands.roots.size(), 2u);
  EXPECT_EQ(strands.roots[0].triangle, 3);
  EXPECT_EQ(strands.roots[0].barycentric, written.roots[0].barycentric);
  EXPECT_EQ(strands.roots[1].triangle, -1);
  EXPECT_FALSE(std::filesystem::exists(folder.file("own.h5.part")));
}

TEST(GroomRead, OwnFilesUnitAndAxisAreObeyedUnlessTheSceneOverrides) {
  const Folder folder;
  write(folder.file("own.h5"), everything(), scene::Axis::kZ);
  const scene::Units centimetres{0.01, scene::Axis::kY};
  EXPECT_EQ(read(folder.file("own.h5"), std::nullopt, {}, centimetres).points[3], Vec3(7, 9, -8));
  EXPECT_EQ(read(folder.file("own.h5"), std::nullopt, {0.5, scene::Axis::kY}, centimetres).points[3],
            Vec3(3.5, 4, 4.5));
}

// The file as schemas/groom.md has it, by HDF5 alone: other number types, compression, variable-length
// strings.
TEST(GroomRead, OwnFormatFromForeignWriter) {
  const Folder folder;
  const hid_t file = H5Fcreate(folder.file("foreign.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const auto attribute = [&](const char* name, hid_t type, const void* value) {
    const hid_t space = H5Screate(H5S_SCALAR),
                attr = H5Acreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(attr, type, value);
    H5Aclose(attr), H5Sclose(space);
  };
  const hid_t text = H5Tcopy(H5T_C_S1);
  H5Tset_size(text, H5T_VARIABLE);
  const char *format = "ringlet-groom", *up = "y";
  const long version = 1;
  const float metres = 0.5f;
  attribute("format", text, &format), attribute("up", text, &up);
  attribute("version", H5T_NATIVE_LONG, &version), attribute("metres_per_unit", H5T_NATIVE_FLOAT, &metres);
  const hsize_t three = 3, shape[2] = {3, 3};
  const std::int16_t offsets[] = {0, 1, 3};
  const float points[] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  const hid_t line = H5Screate_simple(1, &three, nullptr), table = H5Screate_simple(2, shape, nullptr);
  const hid_t packed = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_chunk(packed, 2, shape), H5Pset_deflate(packed, 6);
  const hid_t o = H5Dcreate2(file, "offsets", H5T_STD_I16BE, line, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t p = H5Dcreate2(file, "points", H5T_IEEE_F32LE, table, H5P_DEFAULT, packed, H5P_DEFAULT);
  H5Dwrite(o, H5T_NATIVE_INT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, offsets);
  H5Dwrite(p, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, points);
  H5Dclose(o), H5Dclose(p), H5Pclose(packed), H5Sclose(line), H5Sclose(table), H5Tclose(text), H5Fclose(file);

  const Strands strands = read_metres(folder.file("foreign.h5"));
  EXPECT_THAT(strands.offsets, ElementsAre(0, 1, 3));
  EXPECT_EQ(strands.points[2], Vec3(3.5, 4, 4.5));
  EXPECT_THAT(strands.group_names, ElementsAre("foreign"));
}

scene::Groom scene_groom(const std::filesystem::path& file) {
  scene::Groom desc{};
  desc.name = "hair";
  desc.file = file;
  desc.width = 8e-5;
  return desc;
}

TEST(GroomBuild, SeveralFilesBecomeGroups) {
  const Folder folder;
  scene::Groom desc = scene_groom(folder.write("side.data", data_file()));
  desc.more = {folder.write("tail.tfx", tfx4_file())};
  const Strands strands = build(desc, kMetres, nullptr);
  EXPECT_THAT(strands.offsets, ElementsAre(0, 2, 5, 7, 9));
  EXPECT_THAT(strands.group_names, ElementsAre("side", "tail"));
  EXPECT_THAT(strands.groups, ElementsAre(0, 0, 1, 1));
  EXPECT_EQ(strands.points[7], Vec3(4, 5, 6));
  EXPECT_EQ(strands.widths, std::vector<float>(9, 8e-5f));
  EXPECT_TRUE(strands.roots.empty());
}

TEST(GroomBuild, StoredRootsOfOneFileLeaveTheOthersNowhere) {
  const Folder folder;
  scene::Groom desc = scene_groom(folder.write("a.tfx", tfx3_file()));
  desc.skin = folder.write("a.tfxskin", skin_file());
  desc.more = {folder.write("b.tfx", tfx4_file())};
  const Strands strands = build(desc, kMetres, nullptr);
  ASSERT_EQ(strands.roots.size(), 4u);
  EXPECT_EQ(strands.roots[0].triangle, 7);
  EXPECT_EQ(strands.roots[2].triangle, -1);
}

std::vector<Vec3> sorted(std::vector<Vec3> points) {
  std::sort(points.begin(), points.end(), [](const Vec3& a, const Vec3& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  return points;
}

TEST(GroomRealData, CountsOfTheDataReadme) {
  if (!std::filesystem::exists(data("curly/harolongo.data"))) GTEST_SKIP() << "RINGLET_DATA is absent";
  const scene::Units centimetres{0.01, scene::Axis::kY};
  const auto strands_of = [&](const std::string& name) {
    return read(data(name), std::nullopt, {}, centimetres);
  };
  const Strands curly = strands_of("curly/harolongo.data");
  EXPECT_EQ(curly.size(), 7905u);
  EXPECT_EQ(curly.particles(), 166005);
  const Strands bear = strands_of("bear/bear.tfx");
  EXPECT_EQ(bear.size(), 48113u);
  EXPECT_EQ(bear.particles(), 192452);
  EXPECT_EQ(bear.roots.size(), 48113u);
  scene::Groom parts = scene_groom(data("ponytail/tail.tfx"));
  parts.more = {data("ponytail/front_top.tfx"), data("ponytail/side.tfx"), data("ponytail/back.tfx")};
  const Strands ponytail = build(parts, centimetres, nullptr), as_hair = strands_of("ponytail/ponytail.hair");
  EXPECT_EQ(ponytail.size(), 474u + 876 + 3066 + 517);
  EXPECT_EQ(ponytail.particles(), 78928);
  EXPECT_THAT(ponytail.group_names, ElementsAre("tail", "front_top", "side", "back"));
  EXPECT_EQ(as_hair.offsets, ponytail.offsets);
  EXPECT_EQ(sorted(as_hair.points), sorted(ponytail.points));  // the same strands, the parts in another order
}

}  // namespace
}  // namespace ringlet::groom::test
