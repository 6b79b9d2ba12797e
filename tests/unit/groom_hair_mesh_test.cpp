// Hair meshes: their measures against closed forms, what is refused, and files that come back as they were.
#include "groom/hair_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "core/error.h"
#include "unit/hair_mesh_support.h"

namespace ringlet::groom::test {
namespace {
using testing::AllOf;
using testing::HasSubstr;

std::string refusal(const HairMesh& mesh) {
  try {
    check(mesh, "mesh");
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return "no error";
}

// ---- Measures -------------------------------------------------------------------------------------------

TEST(HairMesh, BoxHasTheVolumesOfABox) {
  const HairMesh mesh = slab(3, 2, 4, 0.25, 0.5);
  EXPECT_EQ(mesh.vertices(), 12u);
  EXPECT_EQ(mesh.prisms(), 18u);
  EXPECT_NEAR(volume(mesh), 0.75 * 0.5 * 1.5, 1e-15);
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    EXPECT_NEAR(scalp_area(mesh, f), 0.0625, 1e-16);
    for (int k = 0; k < 3; ++k)
      for (int c = 0; c < 4; ++c)
        for (const bool top : {false, true})
          EXPECT_NEAR(corner_determinant(mesh, f, k, c, top), 0.25 * 0.25 * 0.5, 1e-16);
  }
}

// x = (u + a u v w, v, w) over the unit cube has the Jacobian 1 + a v w: its volume is 1 + a / 4, sides and
// all, which are bilinear and not flat.
TEST(HairMesh, VolumeIsThatOfBilinearSides) {
  HairMesh cube = slab(1, 1, 2, 1, 1);
  for (Vec3& x : cube.positions) x.x() += 0.7 * x.x() * x.y() * x.z();
  EXPECT_NEAR(volume(cube), 1 + 0.7 / 4, 1e-14);
}

// A quad lifted at one corner, z = h u v: its area is that of integral sqrt(1 + h^2 (u^2 + v^2)).
TEST(HairMesh, AreaOfAQuadThatIsNotFlat) {
  HairMesh mesh = slab(1, 1, 2, 1, 1);
  for (Vec3& x : mesh.positions) x.z() += 0.5 * x.x() * x.y();
  double area = 0;
  constexpr int kSteps = 2000;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j)
      area += std::sqrt(1 + 0.25 * (std::pow((i + 0.5) / kSteps, 2) + std::pow((j + 0.5) / kSteps, 2)));
  EXPECT_NEAR(scalp_area(mesh, 0), area / (kSteps * kSteps), 1e-5);
}

TEST(HairMesh, VolumeOfATriangularPrism) {
  const HairMesh mesh = fan(6, 3, 1, 0.5);  // a hexagon of unit radius in six triangles
  EXPECT_NEAR(volume(mesh), 1.5 * std::sqrt(3) * 1.0, 1e-14);
  EXPECT_NEAR(scalp_area(mesh, 2), std::sqrt(3) / 4, 1e-15);
}

// ---- Refusals -------------------------------------------------------------------------------------------

TEST(HairMesh, WholeMeshesPass) {
  EXPECT_NO_THROW(check(slab(3, 2, 4, 0.25, 0.5), ""));
  EXPECT_NO_THROW(check(fan(5, 2, 1, 0.5), ""));
  EXPECT_NO_THROW(check(random_mesh(1), ""));
}

TEST(HairMesh, ArraysAndIndices) {
  HairMesh mesh = slab(2, 1, 2, 1, 1);
  mesh.layers = 1;
  EXPECT_THAT(refusal(mesh), HasSubstr("mesh: has 1 layer, expected 2 or more"));
  mesh = slab(2, 1, 2, 1, 1);
  mesh.positions.resize(1'500'002);
  EXPECT_THAT(refusal(mesh), HasSubstr("has 1500002 vertices, expected 1500000 or fewer"));
  mesh = slab(2, 1, 2, 1, 1);
  mesh.positions.pop_back();
  EXPECT_THAT(refusal(mesh), HasSubstr("11 positions are not so many on each of 2 layers"));
  mesh = slab(2, 1, 2, 1, 1);
  mesh.faces[1][2] = 6;
  EXPECT_THAT(refusal(mesh), HasSubstr("face 1: vertex 6 does not exist, each layer has 6"));
  mesh = slab(2, 1, 2, 1, 1);
  mesh.faces[1][2] = mesh.faces[1][0];
  EXPECT_THAT(refusal(mesh),
              AllOf(HasSubstr("face 1: has a vertex twice"), HasSubstr("vertex 5 is of no face")));
  mesh.faces.clear();
  EXPECT_THAT(refusal(mesh), HasSubstr("the scalp has no faces"));
  mesh = slab(2, 1, 2, 1, 1);
  mesh.groups = {0};
  mesh.group_names = {"a"};
  EXPECT_THAT(refusal(mesh), HasSubstr("1 faces have a group, expected all 2 or none"));
}

TEST(HairMesh, NonManifoldScalps) {
  // A third face on the edge of vertices 1 and 4.
  HairMesh mesh = slab(2, 1, 2, 1, 1);
  mesh.faces.push_back({1, 4, 5, -1});
  EXPECT_THAT(refusal(mesh), HasSubstr("the edge of vertices 1 and 4 is of 3 faces: face 0, face 1, face 2"));
  // One of two faces turned round.
  mesh = slab(2, 1, 2, 1, 1);
  std::reverse(mesh.faces[1].begin(), mesh.faces[1].end());
  EXPECT_THAT(refusal(mesh),
              HasSubstr("face 0 and face 1 both go from vertex 1 to 4: one of them looks inward"));
  // Two triangles of a hexagon that meet in its middle alone.
  mesh = fan(6, 2, 1, 1);
  mesh.faces = {mesh.faces[0], mesh.faces[1], mesh.faces[3], mesh.faces[4]};
  EXPECT_THAT(refusal(mesh), HasSubstr("face 0 and face 2 meet in vertex 0 and in no edge there"));
}

TEST(HairMesh, NumbersHeightsAndAreas) {
  HairMesh mesh = slab(2, 1, 3, 1, 1);
  mesh.positions[6 + 4].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(mesh), HasSubstr("layer 1, vertex 4: found 1 nan 1, expected finite numbers"));
  mesh = slab(2, 1, 3, 1, 1);
  mesh.positions[2 * 6 + 5] = mesh.positions[6 + 5];
  const std::string flat = refusal(mesh);
  EXPECT_THAT(flat, HasSubstr("face 1, layer 2: vertex 5 lies on the one of layer 1"));
  EXPECT_THAT(flat, testing::Not(HasSubstr("inverted")));  // told once
  mesh = slab(2, 1, 3, 1, 1);
  for (int v = 0; v < 6; ++v) mesh.positions[v].y() = 0;
  EXPECT_THAT(refusal(mesh),
              AllOf(HasSubstr("face 0, layer 0: has no area"), HasSubstr("face 1, layer 0: has no area")));
}

TEST(HairMesh, InvertedPrismsNameFaceLayerAndVertex) {
  HairMesh mesh = slab(2, 1, 3, 1, 1);
  mesh.groups = {0, 1};
  mesh.group_names = {"left", "right"};
  mesh.positions[2 * 6 + 5].z() = 0.4;  // below its layer 1
  const std::string message = refusal(mesh);
  EXPECT_THAT(message, HasSubstr("face 1 (group right), layers 1 to 2: the prism is inverted at rest"));
  EXPECT_THAT(message, AllOf(HasSubstr("at vertex 5 of layer"), testing::Not(HasSubstr("layers 0 to 1"))));
}

TEST(HairMesh, ManyProblemsAreCounted) {
  HairMesh mesh = slab(10, 1, 2, 1, 1);
  for (std::size_t v = 0; v < mesh.vertices(); ++v) mesh.positions[mesh.vertices() + v] = mesh.positions[v];
  EXPECT_THAT(refusal(mesh), AllOf(HasSubstr("face 7, layer 1"), HasSubstr("and 2 more problems"),
                                   testing::Not(HasSubstr("face 8"))));
}

TEST(HairMesh, FacesThatAllLookInwardAreTurned) {
  HairMesh mesh = fan(6, 3, 1, 0.5), quads = slab(2, 2, 2, 1, 1);
  EXPECT_FALSE(orient_outward(mesh, "mesh"));
  for (HairMesh* each : {&mesh, &quads}) {
    const HairMesh whole = *each;
    for (HairMesh::Face& face : each->faces)
      std::reverse(face.begin(), face.begin() + HairMesh::corners(face));
    EXPECT_THAT(refusal(*each), HasSubstr("inverted at rest"));
    testing::internal::CaptureStderr();
    EXPECT_TRUE(orient_outward(*each, "mesh"));
    EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("mesh: all "));
    EXPECT_NO_THROW(check(*each, ""));
    EXPECT_NEAR(volume(*each), volume(whole), 1e-15);
  }
}

// ---- Files ----------------------------------------------------------------------------------------------

TEST(HairMeshFiles, BothFormsComeBackBitForBit) {
  const Folder folder;
  const HairMesh mesh = random_mesh(7);
  write_hair_mesh_json(folder.file("a.json"), mesh, scene::Axis::kY);
  write_hair_mesh_obj(folder.file("a.obj"), mesh);
  for (const char* name : {"a.json", "a.obj"}) {
    const HairMesh read = read_hair_mesh(folder.file(name), {}, kMetres);
    EXPECT_EQ(read.faces, mesh.faces) << name;
    EXPECT_EQ(read.layers, mesh.layers) << name;
    EXPECT_EQ(read.positions, mesh.positions) << name;
    EXPECT_EQ(read.groups, mesh.groups) << name;
    EXPECT_EQ(read.group_names, mesh.group_names) << name;
    EXPECT_TRUE(is_hair_mesh(folder.file(name))) << name;
  }
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.json.part")));
}

TEST(HairMeshFiles, UnitsAndAxes) {
  const Folder folder;
  const HairMesh mesh = random_mesh(2);
  write_hair_mesh_json(folder.file("z.json"), mesh, scene::Axis::kZ);
  EXPECT_EQ(declared_hair_mesh_units(folder.file("z.json")).up, scene::Axis::kZ);
  EXPECT_EQ(declared_hair_mesh_units(folder.file("z.json")).metres_per_unit, 1.0);
  const HairMesh turned = read_hair_mesh(folder.file("z.json"), {}, kMetres);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3& x = mesh.positions[i];
    EXPECT_EQ(turned.positions[i], Vec3(x.x(), x.z(), -x.y()));
  }
  const HairMesh small = read_hair_mesh(folder.file("z.json"), {0.01, scene::Axis::kY}, kMetres);
  EXPECT_EQ(small.positions[5], Vec3(mesh.positions[5] * 0.01));
  write_hair_mesh_obj(folder.file("cm.obj"), mesh);
  const HairMesh scene_units = read_hair_mesh(folder.file("cm.obj"), {}, {0.01, scene::Axis::kY});
  EXPECT_EQ(scene_units.positions[5], Vec3(mesh.positions[5] * 0.01));
  EXPECT_FALSE(declared_hair_mesh_units(folder.file("cm.obj")).up.has_value());
}

// Comments, blank lines, other statements, every form of an index, a carriage return.
TEST(HairMeshFiles, ObjAsExportersWriteIt) {
  const Folder folder;
  std::ofstream(folder.file("a.obj"))
      << "# from somewhere\nmtllib a.mtl\n\no Layer 0\nv 0 0 0\r\nv 1 0 0 # corner\n"
         "v 1 1 0 1.0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ns off\nusemtl hair\nf 1/1 2/1/1 3//1 4\n"
         "o top\nv +0 0 1\nv 1 0 1e0\nv 1 1 1\nv 0 1 1\nf -4 -3 -2 -1\n";
  const HairMesh mesh = read_hair_mesh(folder.file("a.obj"), {}, kMetres);
  EXPECT_EQ(mesh.faces, (std::vector<HairMesh::Face>{{0, 1, 2, 3}}));
  EXPECT_EQ(mesh.layers, 2);
  EXPECT_EQ(mesh.positions[2], Vec3(1, 1, 0));
  EXPECT_TRUE(mesh.groups.empty());
  EXPECT_NEAR(volume(mesh), 1, 1e-15);
}

TEST(HairMeshFiles, FacesThatLookInwardAreTurnedOnReading) {
  const Folder folder;
  HairMesh mesh = slab(2, 2, 3, 1, 1);
  const std::vector<HairMesh::Face> outward = mesh.faces;
  for (HairMesh::Face& face : mesh.faces) std::reverse(face.begin() + 1, face.end());
  write_hair_mesh_json(folder.file("a.json"), mesh, scene::Axis::kY);
  testing::internal::CaptureStderr();
  EXPECT_EQ(read_hair_mesh(folder.file("a.json"), {}, kMetres).faces, outward);
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("a.json: all 4 faces looked inward"));
}

TEST(HairMeshFiles, OtherFilesAreNone) {
  const Folder folder;
  EXPECT_FALSE(is_hair_mesh(folder.file("none.json")));
  std::ofstream(folder.file("scene.json")) << "{\"name\": \"a scene\"}";
  EXPECT_FALSE(is_hair_mesh(folder.file("scene.json")));
  EXPECT_FALSE(is_hair_mesh(RINGLET_SOURCE_DIR "/scenes/assets/head.obj"));
}

TEST(HairMeshFiles, AFolderThatIsNotThere) {
  const Folder folder;
  try {
    write_hair_mesh_json(folder.file("no/a.json"), slab(1, 1, 2, 1, 1), scene::Axis::kY);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kIo);
    EXPECT_THAT(error.what(), HasSubstr("no/a.json: cannot be written"));
  }
}

}  // namespace
}  // namespace ringlet::groom::test
