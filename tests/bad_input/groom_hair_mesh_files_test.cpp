// Damaged and lying hair mesh files: always a typed error that says where, never a crash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "unit/hair_mesh_support.h"

namespace ringlet::groom::test {
namespace {
using testing::AllOf;
using testing::HasSubstr;

std::string read_error(const std::string& name, const std::string& text) {
  const Folder folder;
  const auto file = folder.file(name);
  std::ofstream(file, std::ios::binary) << text;
  try {
    read_hair_mesh(file, {}, kMetres);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_THAT(error.what(), HasSubstr(file.string()));
    return error.what();
  }
  return "no error";
}

std::string json_of(const HairMesh& mesh) {
  const Folder folder;
  write_hair_mesh_json(folder.file("a.json"), mesh, scene::Axis::kY);
  std::ifstream stream(folder.file("a.json"));
  return {std::istreambuf_iterator<char>(stream), {}};
}

// A whole file of two quads and two layers with one text in it replaced.
std::string json_error(const std::string& from, const std::string& to) {
  std::string text = json_of(slab(2, 1, 2, 1, 1));
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return read_error("a.json", text.replace(at, from.size(), to));
}

TEST(HairMeshBadJson, SyntaxHasLineAndColumn) {
  EXPECT_THAT(json_error("[0, 1, 4, 3]", "[0, 1, 4 3]"), HasSubstr("a.json:6:14: "));
  EXPECT_THAT(json_error("\"version\": 1", "\"version\": 1e999"), HasSubstr("a.json"));
  EXPECT_THAT(json_error("\"version\": 1", "\"version\": 1, \"version\": 1"),
              HasSubstr("#/version: the key is given twice"));
  EXPECT_THAT(read_error("a.json", "{\"format\": " + std::string(100000, '[')),
              HasSubstr("nested deeper than"));
  EXPECT_THAT(read_error("a.json", "{"), HasSubstr("a.json:1:"));
}

TEST(HairMeshBadJson, TruncationsAreRefused) {
  const std::string whole = json_of(slab(2, 1, 2, 1, 1));
  for (std::size_t length = 1; length + 2 < whole.size(); length += 7)
    EXPECT_THAT(read_error("a.json", whole.substr(0, length)), testing::Not(HasSubstr("no error"))) << length;
}

TEST(HairMeshBadJson, HeaderUnitsAndUnknownKeys) {
  EXPECT_THAT(json_error("ringlet-hair-mesh", "ringlet-groom"),
              AllOf(HasSubstr("a.json#/format: found \"ringlet-groom\", expected \"ringlet-hair-mesh\""),
                    HasSubstr("this is no hair mesh")));
  EXPECT_THAT(json_error("\"version\": 1", "\"version\": 2"),
              HasSubstr("#/version: found 2, this program reads 1"));
  EXPECT_THAT(json_error("\"version\": 1,", ""), HasSubstr("\"version\" is missing"));
  EXPECT_THAT(json_error("\"version\": 1", "\"version\": 1, \"widths\": []"),
              AllOf(HasSubstr("unknown key \"widths\""), HasSubstr("known are")));
  EXPECT_THAT(json_error("\"length\": \"m\"", "\"length\": \"ell\""),
              HasSubstr("#/units/length: found \"ell\", expected m, cm, mm, in, ft or"));
  EXPECT_THAT(json_error("\"length\": \"m\"", "\"length\": 0"), HasSubstr("#/units/length: found 0"));
  EXPECT_THAT(json_error("\"up\": \"y\"", "\"up\": \"w\""), HasSubstr("#/units/up: found \"w\""));
  EXPECT_THAT(json_error("\"up\"", "\"down\""), HasSubstr("#/units: unknown key \"down\""));
}

TEST(HairMeshBadJson, FacesLayersAndGroups) {
  EXPECT_THAT(json_error("[0, 1, 4, 3]", "[0, 1]"),
              HasSubstr("#/faces/0: found [0,1], expected three or four"));
  EXPECT_THAT(json_error("[0, 1, 4, 3]", "[0, 1, 4.5, 3]"), HasSubstr("#/faces/0"));
  EXPECT_THAT(json_error("[0, 1, 4, 3]", "[0, 1, -4, 3]"), HasSubstr("#/faces/0"));
  EXPECT_THAT(json_error("[0, 1, 4, 3]", "[0, 1, 4000000000, 3]"), HasSubstr("#/faces/0"));
  EXPECT_THAT(json_error("[0, 1, 4, 3]", "[0, 1, 99, 3]"), HasSubstr("face 0: vertex 99 does not exist"));
  EXPECT_THAT(json_error("[0, 1, 4, 3]", "[0, 1, 4, 1]"), HasSubstr("face 0: has a vertex twice"));
  EXPECT_THAT(json_error("[0, 0, 1],", ""), HasSubstr("#/layers/1: layer 1 has 5 vertices, layer 0 has 6"));
  EXPECT_THAT(json_error("[0, 0, 1]", "[0, null, 1]"),
              HasSubstr("#/layers/1/0: found [0,null,1], expected three numbers"));
  EXPECT_THAT(json_error("\"layers\": [", "\"layers\": 7, \"x\": ["),
              HasSubstr("#/layers: found 7, expected a list"));
  EXPECT_THAT(json_error("\"layers\"", "\"groups\": [0, 2], \"group_names\": [\"a\"], \"layers\""),
              HasSubstr("#/groups/1: found 2, expected a number below the 1 of group_names"));
  EXPECT_THAT(json_error("\"layers\"", "\"groups\": [0, 0], \"layers\""),
              HasSubstr("\"group_names\" is missing"));
  EXPECT_THAT(json_error("\"layers\"", "\"group_names\": [\"a\"], \"layers\""),
              HasSubstr("\"groups\" is missing"));
  EXPECT_THAT(json_error("\"layers\"", "\"groups\": [0, 1], \"group_names\": [\"a\", \"a\"], \"layers\""),
              HasSubstr("#/group_names/0: found \"a\", expected a name given once"));
}

// Several problems at once.
TEST(HairMeshBadJson, AllProblemsAreTold) {
  const std::string message = read_error(
      "a.json",
      "{\"format\": \"ringlet-hair-mesh\", \"version\": 1, \"faces\": [[0], 5], \"layers\": [[1]], "
      "\"units\": {\"up\": 1}}");
  for (const char* pointer : {"#/units/up", "#/faces/0", "#/faces/1", "#/layers/0/0"})
    EXPECT_THAT(message, HasSubstr(pointer));
}

TEST(HairMeshBadJson, WhatCheckFindsNamesFaceAndLayer) {
  HairMesh mesh = slab(2, 1, 3, 1, 1);
  mesh.positions[6 + 5] = mesh.positions[5];
  EXPECT_THAT(read_error("a.json", json_of(mesh)), HasSubstr("a.json: face 1, layer 1: vertex 5 lies on"));
  mesh = slab(2, 1, 3, 1, 1);
  mesh.positions[12 + 5].z() = 0.5;
  EXPECT_THAT(read_error("a.json", json_of(mesh)), HasSubstr("face 1, layers 1 to 2: the prism is inverted"));
}

// ---- OBJ ------------------------------------------------------------------------------------------------

const char* const kScalp = "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";  // lines 1 to 5

TEST(HairMeshBadObj, StatementsHaveTheirLine) {
  const auto error = [](const std::string& more) { return read_error("a.obj", kScalp + more); };
  EXPECT_THAT(error("v 0 0\n"), HasSubstr("a.obj:6: a vertex of 2 numbers, expected three"));
  EXPECT_THAT(error("\nv 0 x 0\n"), HasSubstr("a.obj:7: found `x`, expected a number"));
  EXPECT_THAT(error("v 0 1.5m 0\n"), HasSubstr("found `1.5m`"));
  EXPECT_THAT(error("f 1 2\n"), HasSubstr("a.obj:6: a face of 2 vertices, expected three or four"));
  EXPECT_THAT(error("f 1 2 3 1 2\n"), HasSubstr("a face of 5 vertices"));
  EXPECT_THAT(error("f 0 1 2\n"), AllOf(HasSubstr("found `0`"), HasSubstr("numbered from 1")));
  EXPECT_THAT(error("f 1 2 -9\n"), HasSubstr("vertex -9 does not exist: 3 come before"));
  EXPECT_THAT(error("f 1 2 9\n"),
              HasSubstr("a.obj:6: face 1 of layer 0 (object a) has vertex 9, the layer's are 1 to 3"));
  EXPECT_THAT(error("curv 1\n"), HasSubstr("a.obj:6: unknown statement `curv`"));
  EXPECT_THAT(read_error("a.obj", "v 0 0 0\n"), HasSubstr("a.obj:1: a vertex before the first object"));
  EXPECT_THAT(read_error("a.obj", "# nothing\n"), HasSubstr("no object in the file"));
}

TEST(HairMeshBadObj, LayersOfDifferentTopology) {
  const auto error = [](const std::string& more) { return read_error("a.obj", kScalp + more); };
  EXPECT_THAT(error(""), HasSubstr("has 1 layer, expected 2 or more"));
  EXPECT_THAT(error("o b\nv 0 0 1\nv 1 0 1\nv 0 1 1\n"),
              HasSubstr("a.obj:6: layer 1 (object b) has no faces"));
  EXPECT_THAT(error("o b\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\nf 4 5 6\n"),
              HasSubstr("a.obj:6: layer 1 (object b) has 4 vertices, layer 0 has 3"));
  EXPECT_THAT(error("o b\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 4 5 6\nf 4 5 6\n"),
              HasSubstr("layer 1 (object b) has 2 faces, layer 0 has 1"));
  EXPECT_THAT(error("o b\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 5 6 4\n"),
              HasSubstr("a.obj:10: face 0 of layer 1 (object b) is not that of layer 0"));
  EXPECT_THAT(error("o b\nv 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3\n"),
              HasSubstr("a.obj:10: face 0 of layer 1 (object b) has vertex 1, the layer's are 4 to 6"));
}

TEST(HairMeshBadFiles, OtherContents) {
  EXPECT_THAT(read_error("a.json", ""), HasSubstr("the file is empty"));
  EXPECT_THAT(read_error("a.obj", std::string("o a\0b", 5)), HasSubstr("byte 3: is no text"));
  EXPECT_THAT(read_error("a.json", "[]"), HasSubstr("unknown statement `[]`"));
  const Folder folder;
  EXPECT_THROW(read_hair_mesh(folder.file("none.json"), {}, kMetres), Error);
}

}  // namespace
}  // namespace ringlet::groom::test
