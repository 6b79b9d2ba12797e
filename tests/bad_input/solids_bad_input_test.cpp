// Meshes that cannot be used end in one typed error that says what is wrong.
#include <gmock/gmock.h>

#include <cstring>
#include <functional>

#include "core/error.h"
#include "solids/mesh.h"
#include "solids/solid.h"
#include "unit/solids_fixtures.h"
#include "unit/solids_gltf.h"

namespace ringlet::solids {
namespace {

using testing::HasSubstr;

class BadMesh : public InDirectory {
 protected:
  void expect_refused(const scene::MeshDesc& desc, const std::string& words) const {
    try {
      AnimatedMesh mesh(desc, kMetresYUp, kTwoSeconds);
      FAIL() << "accepted " << desc.file;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      EXPECT_THAT(error.what(), HasSubstr(words));
      EXPECT_THAT(error.what(), HasSubstr(desc.file.filename().string().substr(0, 4)));
    }
  }
  static constexpr const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

  // A glTF triangle with these coordinates; `changed` may edit the text.
  std::filesystem::path gltf(std::vector<float> coordinates,
                             const std::function<void(std::string&)>& change = nullptr) const {
    GltfText gltf;
    gltf.floats("VEC3", 3, coordinates);
    gltf.indices({0, 1, 2});
    std::string text = gltf.text(
        R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":
        {"POSITION":0},"indices":1}]}],"animations":[{"name":"nod","samplers":[],"channels":[]}])");
    if (change) change(text);
    return write("mesh.gltf", text);
  }
};

TEST_F(BadMesh, MissingFile) { expect_refused(mesh_desc(directory / "none.obj"), "no such file"); }

TEST_F(BadMesh, EmptyOrForeignFile) {
  expect_refused(mesh_desc(write("empty.obj", "")), "cannot read the mesh");
  expect_refused(mesh_desc(write("text.glb", "this is no mesh")), "cannot read the mesh");
}

TEST_F(BadMesh, NoTriangles) {
  expect_refused(mesh_desc(write("lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n")), "no triangles");
}

TEST_F(BadMesh, NonFiniteVertices) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  expect_refused(mesh_desc(gltf({0, 0, 0, 1, nan, 0, 0, 1, 0})), "vertex 1 is not finite");
  expect_refused(mesh_desc(gltf({0, 0, 0, 1, 0, 0, 0, 1, -inf})), "vertex 2 is not finite");
}

TEST_F(BadMesh, UnknownClipNamesTheKnownOnes) {
  expect_refused(mesh_desc(gltf({0, 0, 0, 1, 0, 0, 0, 1, 0}), "shake"),
                 "no clip \"shake\" (the file's clips: \"nod\")");
  expect_refused(mesh_desc(write("mesh.obj", kTriangle), "shake"), "the file has no clips");
}

TEST_F(BadMesh, TruncatedGlb) {
  const std::filesystem::path whole = data_file("curly/head_shake.glb");
  if (whole.empty()) GTEST_SKIP() << "no RINGLET_DATA";
  std::ifstream in(whole, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (const std::size_t size : {std::size_t{8}, std::size_t{100}, bytes.size() / 2, bytes.size() - 4})
    expect_refused(mesh_desc(write("head.glb", bytes.substr(0, size))), "cannot read the mesh");
}

TEST_F(BadMesh, LyingCounts) {
  const auto replace = [](const std::string& from, const std::string& to) {
    return [=](std::string& text) { text.replace(text.find(from), from.size(), to); };
  };
  expect_refused(mesh_desc(gltf({0, 0, 0, 1, 0, 0, 0, 1, 0},
                                replace("\"VEC3\",\"count\":3", "\"VEC3\",\"count\":4000000000"))),
                 "cannot read the mesh");
  expect_refused(mesh_desc(gltf({0, 0, 0, 1, 0, 0, 0, 1, 0},
                                replace("\"SCALAR\",\"count\":3", "\"SCALAR\",\"count\":4000000000"))),
                 "");
}

TEST_F(BadMesh, Sequences) {
  expect_refused(mesh_desc(directory / "walk.##.obj"), "no file of this pattern");
  write("walk.01.obj", kTriangle);
  write("walk.02.obj", kTriangle);
  write("walk.04.obj", kTriangle);
  expect_refused(mesh_desc(directory / "walk.##.obj"), "frame 3 is missing");
  write("walk.03.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 1\nf 1 2 3\nf 2 3 4\n");
  try {
    AnimatedMesh mesh(mesh_desc(directory / "walk.##.obj"), kMetresYUp, kTwoSeconds);
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("walk.03.obj: its triangles are not those"));
  }
  expect_refused(mesh_desc(directory / "walk.##.obj", "walk"), "has no clips");
  expect_refused(mesh_desc(directory / "walk.#.#.obj"), "more than one run of #");
}

TEST_F(BadMesh, SolidOfTooManyVoxelsOrNoSize) {
  const AnimatedMesh mesh(mesh_desc(write("mesh.obj", kTriangle)), kMetresYUp, kTwoSeconds);
  scene::Solid desc = solid_desc(64);
  desc.pointer = "/effects/solids/0";
  desc.voxel = 1e-6;
  EXPECT_THROW(Solid(desc, mesh, kTwoSeconds, 0, {}), Error);
  const AnimatedMesh point(mesh_desc(write("dot.obj", "v 1 1 1\nf 1 1 1\n")), kMetresYUp, kTwoSeconds);
  desc.voxel.reset();
  EXPECT_THROW(Solid(desc, point, kTwoSeconds, 0, {}), Error);
}

}  // namespace
}  // namespace ringlet::solids
