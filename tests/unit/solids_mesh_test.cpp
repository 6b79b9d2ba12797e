// Animated meshes against small computations by hand: nodes, skins, morph targets, sequences, keys, units,
// preroll.
#include <fmt/format.h>

#include "core/error.h"
#include "solids/mesh.h"
#include "unit/solids_fixtures.h"
#include "unit/solids_gltf.h"

namespace ringlet::solids {
namespace {

using Motion = AnimatedMesh::Motion;

std::vector<Vec3> sample(const AnimatedMesh& mesh, double time) {
  std::vector<Vec3> out(mesh.vertex_count());
  mesh.sample(time, out);
  return out;
}

void expect_near(const std::vector<Vec3>& a, const std::vector<Vec3>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_TRUE((a[i] - b[i]).norm() <= tolerance)
        << i << ": " << a[i].transpose() << " for " << b[i].transpose();
}

Mat3 turn_z(double degrees) {
  return Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3::UnitZ()).toRotationMatrix();
}

constexpr float kHalf = 0.70710678f;  // sin and cos of 45 degrees: a quarter turn as a quaternion

class MeshTest : public InDirectory {
 protected:
  const std::vector<Vec3> corners_{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<float> corner_floats_{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::vector<std::uint16_t> faces_{0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};

  // A tetrahedron on `pivot` at (1, 2, 3), which turns a quarter in the clip's first two seconds.
  std::filesystem::path turning_node() {
    GltfText gltf;
    const int p = gltf.floats("VEC3", 3, corner_floats_), i = gltf.indices(faces_);
    const int times = gltf.floats("SCALAR", 1, {0, 2});
    const int turns = gltf.floats("VEC4", 4, {0, 0, 0, 1, 0, 0, kHalf, kHalf});
    return write("turning.gltf", gltf.text(fmt::format(R"(
      "scene":0,"scenes":[{{"nodes":[0]}}],
      "nodes":[{{"name":"pivot","translation":[1,2,3],"children":[1]}},{{"name":"part","mesh":0,"scale":[2,2,2]}}],
      "meshes":[{{"name":"tetra","primitives":[{{"attributes":{{"POSITION":{}}},"indices":{}}}]}}],
      "animations":[{{"name":"turn","samplers":[{{"input":{},"output":{}}}],
        "channels":[{{"sampler":0,"target":{{"node":0,"path":"rotation"}}}}]}}])",
                                                       p, i, times, turns)));
  }

  std::vector<Vec3> turned(double degrees) const {
    std::vector<Vec3> result;
    for (const Vec3& v : corners_) result.push_back(Vec3(1, 2, 3) + turn_z(degrees) * (2 * v));
    return result;
  }
};

TEST_F(MeshTest, NodesTurnBySlerpAndHoldAtTheClipsEnd) {
  const AnimatedMesh mesh(mesh_desc(turning_node(), "turn"), kMetresYUp, {1, 97, 24, 0});
  EXPECT_EQ(mesh.motion(), Motion::kRigid);
  EXPECT_EQ(mesh.mesh_names(), std::vector<std::string>{"tetra"});
  expect_near(mesh.rest_vertices(), turned(0), 1e-6);
  for (const double t : {0.0, 0.3, 1.0, 1.7, 2.0}) expect_near(sample(mesh, t), turned(45 * t), 1e-6);
  expect_near(sample(mesh, 3.5), turned(90), 1e-6);
}

TEST_F(MeshTest, RigidPoseTakesRestToTheSample) {
  const AnimatedMesh mesh(mesh_desc(turning_node(), ""), kMetresYUp, kTwoSeconds);
  const Pose pose = mesh.pose(0.8);
  EXPECT_LE((pose.rotation - turn_z(36)).norm(), 1e-6);
  EXPECT_LE((pose.position - (Vec3(1, 2, 3) - turn_z(36) * Vec3(1, 2, 3))).norm(), 1e-5);
  for (std::size_t i = 0; i < mesh.vertex_count(); ++i)
    EXPECT_LE((pose.rotation * mesh.rest_vertices()[i] + pose.position - sample(mesh, 0.8)[i]).norm(), 1e-12);
  EXPECT_EQ(mesh.pose(0).rotation, Mat3::Identity());
  EXPECT_EQ(mesh.pose(0).position, Vec3::Zero());
}

TEST_F(MeshTest, ClipLoops) {
  scene::MeshDesc desc = mesh_desc(turning_node(), "turn");
  desc.animation.loop = true;
  const AnimatedMesh mesh(desc, kMetresYUp, {1, 200, 24, 0});
  expect_near(sample(mesh, 2.5), turned(22.5), 1e-6);
  expect_near(sample(mesh, 7.0), turned(45), 1e-6);
}

TEST_F(MeshTest, WithoutAnimationNothingMoves) {
  const AnimatedMesh mesh(mesh_desc(turning_node()), kMetresYUp, kTwoSeconds);
  EXPECT_EQ(mesh.motion(), Motion::kStill);
  EXPECT_EQ(sample(mesh, 1.3), mesh.rest_vertices());
  EXPECT_EQ(mesh.pose(1.3).rotation, Mat3::Identity());
  EXPECT_EQ(mesh.pose(1.3).position, Vec3::Zero());
}

TEST_F(MeshTest, ASkinThatMovesAsOneIsRigidAndABentOneDeforms) {
  GltfText gltf;
  const int p = gltf.floats("VEC3", 3, corner_floats_), i = gltf.indices(faces_);
  const int joints = gltf.joints({0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0});
  const std::vector<float> w{1, 0, 0, 0, 0.25f, 0.75f, 0, 0, 0.5f, 0.5f, 0, 0, 1, 0, 0, 0};
  const int weights = gltf.floats("VEC4", 4, w);
  // Joint 1 sits at (0, 1, 0) in joint 0, which sits at (5, 0, 0); bound where they are.
  std::vector<float> bind(32, 0.0f);
  for (const int k : {0, 5, 10, 15, 16, 21, 26, 31}) bind[static_cast<std::size_t>(k)] = 1;
  bind[12] = -5, bind[28] = -5, bind[29] = -1;
  const int inverse_bind = gltf.floats("MAT4", 16, bind);
  const int times = gltf.floats("SCALAR", 1, {0, 1});
  const int turns = gltf.floats("VEC4", 4, {0, 0, 0, 1, 0, 0, kHalf, kHalf});
  const auto file = [&](int node, const char* name) {
    return write(name, gltf.text(fmt::format(R"(
      "scene":0,"scenes":[{{"nodes":[0,1]}}],
      "nodes":[{{"name":"body","mesh":0,"skin":0,"translation":[9,9,9]}},
               {{"name":"root","translation":[5,0,0],"children":[2]}},{{"name":"tip","translation":[0,1,0]}}],
      "skins":[{{"joints":[1,2],"inverseBindMatrices":{}}}],
      "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"JOINTS_0":{},"WEIGHTS_0":{}}},"indices":{}}}]}}],
      "animations":[{{"name":"bend","samplers":[{{"input":{},"output":{}}}],
        "channels":[{{"sampler":0,"target":{{"node":{},"path":"rotation"}}}}]}}])",
                                             inverse_bind, p, joints, weights, i, times, turns, node)));
  };
  const AnimatedMesh bent(mesh_desc(file(2, "bent.gltf"), "bend"), kMetresYUp, kTwoSeconds);
  EXPECT_EQ(bent.motion(), Motion::kDeforming);
  expect_near(bent.rest_vertices(), corners_, 1e-6);  // a skin's vertices follow its joints, not the node
  // At the end the tip has turned a quarter about (5, 1, 0).
  const double of_tip[4] = {0, 0.75, 0.5, 1};
  std::vector<Vec3> expected;
  for (std::size_t v = 0; v < 4; ++v) {
    const Vec3 pivot(5, 1, 0), turned = pivot + turn_z(90) * (corners_[v] - pivot);
    expected.push_back((1 - of_tip[v]) * corners_[v] + of_tip[v] * turned);
  }
  expect_near(sample(bent, 1.0), expected, 2e-6);

  const AnimatedMesh turned(mesh_desc(file(1, "turned.gltf"), "bend"), kMetresYUp, kTwoSeconds);
  EXPECT_EQ(turned.motion(), Motion::kRigid);
}

// A skin whose joint the file shows turned by 30 degrees: at rest it is as it was bound, with and without the
// clip, and the clip goes its own way.
TEST_F(MeshTest, ASkinRestsInItsBindPose) {
  GltfText gltf;
  const int p = gltf.floats("VEC3", 3, corner_floats_), i = gltf.indices(faces_);
  const int joints = gltf.joints({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  const int weights = gltf.floats("VEC4", 4, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  std::vector<float> bind(16, 0.0f);
  for (const int k : {0, 5, 10, 15}) bind[static_cast<std::size_t>(k)] = 1;
  bind[12] = -5;  // bound at (5, 0, 0)
  const int inverse_bind = gltf.floats("MAT4", 16, bind);
  const int times = gltf.floats("SCALAR", 1, {0, 1});
  const int turns = gltf.floats("VEC4", 4, {0, 0, 0, 1, 0, 0, kHalf, kHalf});
  const auto file =
      write("posed.gltf", gltf.text(fmt::format(R"(
      "scene":0,"scenes":[{{"nodes":[0,1]}}],
      "nodes":[{{"name":"body","mesh":0,"skin":0}},
               {{"name":"root","translation":[5,0,0],"rotation":[0,0,0.25881904510,0.96592582629]}}],
      "skins":[{{"joints":[1],"inverseBindMatrices":{}}}],
      "meshes":[{{"primitives":[{{"attributes":{{"POSITION":{},"JOINTS_0":{},"WEIGHTS_0":{}}},"indices":{}}}]}}],
      "animations":[{{"name":"turn","samplers":[{{"input":{},"output":{}}}],
        "channels":[{{"sampler":0,"target":{{"node":1,"path":"rotation"}}}}]}}])",
                                                inverse_bind, p, joints, weights, i, times, turns)));
  const AnimatedMesh still(mesh_desc(file), kMetresYUp, kTwoSeconds);
  EXPECT_EQ(still.motion(), Motion::kStill);
  expect_near(still.rest_vertices(), corners_, 1e-6);

  const AnimatedMesh mesh(mesh_desc(file, "turn"), kMetresYUp, {1, 49, 24, 12});
  expect_near(mesh.rest_vertices(), corners_, 1e-6);
  const auto turned = [&](double degrees) {
    std::vector<Vec3> result;
    for (const Vec3& v : corners_) result.push_back(Vec3(5, 0, 0) + turn_z(degrees) * (v - Vec3(5, 0, 0)));
    return result;
  };
  expect_near(sample(mesh, -0.5), corners_, 1e-6);
  expect_near(sample(mesh, 0), corners_, 1e-6);
  expect_near(sample(mesh, 1), turned(90), 1e-5);
}

TEST_F(MeshTest, MorphTargetsAddTheirWeightedDisplacements) {
  GltfText gltf;
  const int p = gltf.floats("VEC3", 3, corner_floats_), i = gltf.indices(faces_);
  const int up = gltf.floats("VEC3", 3, {0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0});
  const int out = gltf.floats("VEC3", 3, {0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, -1});
  const int times = gltf.floats("SCALAR", 1, {0, 1});
  const int weights = gltf.floats("SCALAR", 1, {0, 0.5f, 1, 0.25f});
  const auto file = write("morph.gltf", gltf.text(fmt::format(R"(
      "scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"name":"face","mesh":0}}],
      "meshes":[{{"weights":[0.2,0],"primitives":[{{"attributes":{{"POSITION":{}}},"indices":{},
        "targets":[{{"POSITION":{}}},{{"POSITION":{}}}]}}]}}],
      "animations":[{{"name":"talk","samplers":[{{"input":{},"output":{}}}],
        "channels":[{{"sampler":0,"target":{{"node":0,"path":"weights"}}}}]}}])",
                                                              p, i, up, out, times, weights)));
  const auto shaped = [&](double a, double b) {
    std::vector<Vec3> v = corners_;
    v[1] += a * Vec3(0, 1, 0) + b * Vec3(2, 0, 0);
    v[3] += b * Vec3(0, 0, -1);
    return v;
  };
  const AnimatedMesh mesh(mesh_desc(file, "talk"), kMetresYUp, {1, 49, 24, 24});
  EXPECT_EQ(mesh.motion(), Motion::kDeforming);
  expect_near(mesh.rest_vertices(), shaped(0.2, 0), 1e-6);
  expect_near(sample(mesh, 0), shaped(0, 0.5), 1e-6);
  expect_near(sample(mesh, 0.4), shaped(0.4, 0.4), 1e-6);
  expect_near(sample(mesh, 9), shaped(1, 0.25), 1e-6);
  // Preroll: one second from the rest pose, its middle half way.
  EXPECT_EQ(sample(mesh, -1), mesh.rest_vertices());
  expect_near(sample(mesh, -0.5), shaped(0.1, 0.25), 1e-6);
}

TEST_F(MeshTest, PrerollEasesNodesAndKeysFromRest) {
  scene::MeshDesc desc = mesh_desc(turning_node());
  desc.animation.keys = {{1, Vec3(0, 8, 0), Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitZ())), 1}};
  const AnimatedMesh mesh(desc, kMetresYUp, {1, 49, 24, 12});
  EXPECT_EQ(mesh.motion(), Motion::kRigid);
  EXPECT_EQ(sample(mesh, -0.5), mesh.rest_vertices());
  // A quarter of the way: ease(1/4) = 5/32.
  const double e = 5.0 / 32;
  std::vector<Vec3> expected;
  for (const Vec3& v : mesh.rest_vertices()) expected.push_back(turn_z(90 * e) * v + Vec3(0, 8 * e, 0));
  expect_near(sample(mesh, -0.375), expected, 1e-9);
}

TEST_F(MeshTest, KeysMoveTheWholeMeshAboutTheScenesOrigin) {
  const Shape box = sphere(0.5, {3, 0, 0}, 6, 8);
  write_obj(directory / "ball.obj", box);
  scene::MeshDesc desc = mesh_desc(directory / "ball.obj");
  desc.animation.interpolation = scene::Interpolation::kLinear;
  desc.animation.keys = {{1, Vec3::Zero(), Quat::Identity(), 1},
                         {25, Vec3(0, 0, 2), Quat(Eigen::AngleAxisd(1.0, Vec3::UnitY())), 3}};
  const AnimatedMesh mesh(desc, kMetresYUp, kTwoSeconds);
  EXPECT_EQ(mesh.motion(), Motion::kDeforming);  // it grows
  std::vector<Vec3> expected;
  for (const Vec3& v : mesh.rest_vertices())
    expected.push_back(Eigen::AngleAxisd(0.5, Vec3::UnitY()) * Vec3(2 * v) + Vec3(0, 0, 1));
  expect_near(sample(mesh, 0.5), expected, 1e-9);
}

TEST_F(MeshTest, NumberedFilesAreFramesFromTheFirst) {
  const auto at = [](double x) { return sphere(1, {x, 0, 0}, 6, 8); };
  for (const auto& [number, x] : {std::pair{"0998", 0.0}, {"0999", 1.0}, {"1000", 5.0}})
    write_obj(directory / (std::string("ball.") + number + ".obj"), at(x));
  const scene::MeshDesc desc = mesh_desc(directory / "ball.####.obj");
  const AnimatedMesh mesh(desc, kMetresYUp, {1, 10, 24, 0});
  EXPECT_EQ(mesh.motion(), Motion::kRigid);
  const auto moved = [&](double x) {
    std::vector<Vec3> v = mesh.rest_vertices();
    for (Vec3& p : v) p.x() += x;
    return v;
  };
  expect_near(sample(mesh, 0.5 / 24), moved(0.5), 1e-6);
  expect_near(sample(mesh, 1.75 / 24), moved(4), 1e-6);
  expect_near(sample(mesh, 9.0 / 24), moved(5), 1e-6);
  scene::MeshDesc looped = desc;
  looped.animation.loop = true;
  expect_near(sample(AnimatedMesh(looped, kMetresYUp, {1, 10, 24, 0}), 2.5 / 24), moved(2.5), 1e-6);
}

// Clips, sequences, the asset's keys and the scene's, with preroll before them: all at once so many times as
// fast, and over so much sooner.
TEST_F(MeshTest, SpeedRunsEveryKindOfMotionAlike) {
  for (int number = 1; number <= 40; ++number)
    write_obj(directory / fmt::format("ball{}.obj", number), sphere(1, {0.1 * number * number, 0, 0}, 6, 8));
  scene::MeshDesc clip = mesh_desc(turning_node(), "turn"), sequence = mesh_desc(directory / "ball#.obj");
  for (scene::MeshDesc* desc : {&clip, &sequence})
    for (const bool loop : {false, true}) {
      desc->animation.loop = loop;
      desc->animation.keys = {{1, Vec3(1, 0, 0), Quat::Identity(), 1},
                              {9, Vec3(0, 2, 0), Quat::Identity(), 2}};
      desc->animation.carrier = {{1, Vec3::Zero(), Quat::Identity(), 1},
                                 {25, Vec3(0, 0, 9), Quat(Eigen::AngleAxisd(1.0, Vec3::UnitX())), 1},
                                 {31, Vec3::Zero(), Quat::Identity(), 1}};
      desc->animation.speed = 1;
      const AnimatedMesh slow(*desc, kMetresYUp, {1, 97, 24, 12});
      for (const double speed : {0.5, 3.0, 10.0}) {
        desc->animation.speed = speed;
        const AnimatedMesh fast(*desc, kMetresYUp, {1, 97, 24, 12});
        for (const double time : {0.0, 0.01, 0.137, 0.3, 0.77, 1.9})
          expect_near(sample(fast, time), sample(slow, speed * time), 1e-9);
        for (const double time : {-0.5, -0.3}) expect_near(sample(fast, time), sample(slow, time), 1e-12);
        EXPECT_NEAR(fast.duration(), slow.duration() / speed, 1e-12);
      }
    }
}

// Four times as fast every frame of the run, and the middle between any two, shows an even file.
TEST_F(MeshTest, ASequenceThatDeformsBetweenFramesDeforms) {
  for (int number = 0; number < 20; ++number)
    write_obj(directory / fmt::format("ball{}.obj", number), sphere(number % 2 ? 1.1 : 1, {3, 0, 0}, 6, 8));
  scene::MeshDesc desc = mesh_desc(directory / "ball#.obj");
  desc.animation.speed = 4;
  EXPECT_EQ(AnimatedMesh(desc, kMetresYUp, {1, 5, 24, 0}).motion(), Motion::kDeforming);
}

TEST_F(MeshTest, SequenceKeepsApartWhatOnlyStartsTogether) {
  // Two quads that touch in the first file along an edge whose ends have two vertices each, and part in the
  // second.
  const auto file = [](double gap) {
    return fmt::format(
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv {0} 0 0\nv {1} 0 0\nv {1} 1 0\nv {0} 1 0\n"
        "f 1 2 3 4\nf 5 6 7 8\n",
        1 + gap, 2 + gap);
  };
  write("lips1.obj", file(0));
  write("lips2.obj", file(0.5));
  const AnimatedMesh mesh(mesh_desc(directory / "lips#.obj"), kMetresYUp, {1, 2, 24, 0});
  EXPECT_EQ(mesh.vertex_count(), 8u);
  EXPECT_EQ(mesh.motion(), Motion::kDeforming);
}

TEST_F(MeshTest, SeamsAreWeldedAndTrianglesKeepTheirOrder) {
  // A cube with normals and texture coordinates of its own on each side: 24 vertices in the file, 8 in space;
  // its last triangle is degenerate.
  std::string obj;
  const double corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  for (const auto& c : corners) obj += fmt::format("v {} {} {}\n", c[0], c[1], c[2]);
  const int sides[6][4] = {{1, 4, 3, 2}, {5, 6, 7, 8}, {1, 2, 6, 5},
                           {2, 3, 7, 6}, {3, 4, 8, 7}, {4, 1, 5, 8}};
  obj += "vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 1 0 0\nvn 0 1 0\nvn -1 0 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  for (int s = 0; s < 6; ++s)
    for (const auto& [a, b, c] : {std::array{0, 1, 2}, {0, 2, 3}})
      obj += fmt::format("f {}/{}/{} {}/{}/{} {}/{}/{}\n", sides[s][a], a + 1, s + 1, sides[s][b], b + 1,
                         s + 1, sides[s][c], c + 1, s + 1);
  obj += "f 1/1/1 2/2/2 2/3/3\n";
  const AnimatedMesh mesh(mesh_desc(write("cube.obj", obj)), kMetresYUp, kTwoSeconds);
  EXPECT_EQ(mesh.vertex_count(), 8u);
  ASSERT_EQ(mesh.triangles().size(), 13u);
  for (int s = 0; s < 6; ++s)
    for (int k = 0; k < 2; ++k)
      for (int c = 0; c < 3; ++c) {
        const int corner = sides[s][c == 0 ? 0 : c + k] - 1;
        const Triangle& t = mesh.triangles()[static_cast<std::size_t>(2 * s + k)];
        const Vec3& v = mesh.rest_vertices()[static_cast<std::size_t>(t[static_cast<std::size_t>(c)])];
        EXPECT_EQ(v, Vec3(corners[corner][0], corners[corner][1], corners[corner][2]));
      }
}

// ---- Units -----------------------------------------------------------------------------------------

std::string collada(const std::string& asset) {
  return R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
    <asset>)" +
         asset + R"(</asset><library_geometries><geometry id="g" name="g"><mesh>
    <source id="p"><float_array id="pa" count="12">0 0 0 1 0 0 0 2 0 0 0 3</float_array><technique_common>
    <accessor source="#pa" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
    <param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 1 2 3 0 3 2</p></triangles>
    </mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="s"><node id="n">
    <instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene>
    <instance_visual_scene url="#s"/></scene></COLLADA>)";
}

Vec3 upper_corner(const AnimatedMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : mesh.rest_vertices()) box.extend(v);
  return box.max();
}
Vec3 lower_corner(const AnimatedMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : mesh.rest_vertices()) box.extend(v);
  return box.min();
}

TEST_F(MeshTest, ColladaDeclaresItsUnits) {
  const auto file =
      write("box.dae", collada(R"(<unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis>)"));
  const AnimatedMesh in_y_up(mesh_desc(file), kMetresYUp, kTwoSeconds);  // (x, y, z) becomes (x, z, -y)
  EXPECT_LE((upper_corner(in_y_up) - Vec3(0.01, 0.03, 0)).norm(), 1e-9);
  EXPECT_LE((lower_corner(in_y_up) - Vec3(0, 0, -0.02)).norm(), 1e-9);
  const AnimatedMesh in_z_up(mesh_desc(file), {0.1, scene::Axis::kZ}, kTwoSeconds);
  EXPECT_LE((upper_corner(in_z_up) - Vec3(0.01, 0.02, 0.03)).norm(), 1e-9);
  scene::MeshDesc overridden = mesh_desc(file);
  overridden.units = {1.0, scene::Axis::kY};
  const AnimatedMesh obeyed(overridden, kMetresYUp, kTwoSeconds);
  EXPECT_LE((upper_corner(obeyed) - Vec3(1, 2, 3)).norm(), 1e-6);
}

TEST_F(MeshTest, ColladaSaysMetresYUpBySilence) {
  const auto file = write("box.dae", collada(""));
  const AnimatedMesh mesh(mesh_desc(file), {0.01, scene::Axis::kZ},
                          kTwoSeconds);  // (x, y, z) becomes (x, -z, y)
  EXPECT_LE((upper_corner(mesh) - Vec3(1, 0, 2)).norm(), 1e-6);
  EXPECT_LE((lower_corner(mesh) - Vec3(0, -3, 0)).norm(), 1e-6);
}

// A tetrahedron, z up, in inches, that its clip lifts by 4 in a second.
constexpr const char* kFbx = R"(; FBX 7.3.0 project file
FBXHeaderExtension:  {
  FBXHeaderVersion: 1003
  FBXVersion: 7300
}
GlobalSettings:  {
  Version: 1000
  Properties70:  {
    P: "UpAxis", "int", "Integer", "",2
    P: "UpAxisSign", "int", "Integer", "",1
    P: "UnitScaleFactor", "double", "Number", "",2.54
    P: "TimeMode", "enum", "", "",11
  }
}
Objects:  {
  Geometry: 100, "Geometry::part", "Mesh" {
    Vertices: *12 {
      a: 0,0,0,1,0,0,0,2,0,0,0,3
    }
    PolygonVertexIndex: *12 {
      a: 0,2,-2,0,1,-4,1,2,-4,0,3,-3
    }
    GeometryVersion: 124
  }
  Model: 200, "Model::part", "Mesh" {
    Version: 232
    Properties70:  {
      P: "Lcl Translation", "Lcl Translation", "", "A",0,0,10
    }
  }
  AnimationStack: 300, "AnimStack::lift", "" {
    Properties70:  {
      P: "LocalStop", "KTime", "Time", "",46186158000
      P: "ReferenceStop", "KTime", "Time", "",46186158000
    }
  }
  AnimationLayer: 400, "AnimLayer::base", "" {
  }
  AnimationCurveNode: 500, "AnimCurveNode::T", "" {
    Properties70:  {
      P: "d|X", "Number", "", "A",0
      P: "d|Y", "Number", "", "A",0
      P: "d|Z", "Number", "", "A",10
    }
  }
  AnimationCurve: 600, "AnimCurve::", "" {
    Default: 0
    KeyVer: 4008
    KeyTime: *2 {
      a: 0,46186158000
    }
    KeyValueFloat: *2 {
      a: 10,14
    }
    KeyAttrFlags: *1 {
      a: 260
    }
    KeyAttrDataFloat: *4 {
      a: 0,0,0,0
    }
    KeyAttrRefCount: *1 {
      a: 2
    }
  }
}
Connections:  {
  C: "OO",200,0
  C: "OO",100,200
  C: "OO",400,300
  C: "OO",500,400
  C: "OP",500,200, "Lcl Translation"
  C: "OP",600,500, "d|Z"
}
)";

TEST_F(MeshTest, FbxDeclaresItsUnitsAndMoves) {
  const AnimatedMesh mesh(mesh_desc(write("part.fbx", kFbx), "lift"), kMetresYUp, kTwoSeconds);
  EXPECT_EQ(mesh.vertex_count(), 4u);
  EXPECT_EQ(mesh.motion(), Motion::kRigid);
  EXPECT_LE((upper_corner(mesh) - 0.0254 * Vec3(1, 13, 0)).norm(), 1e-6);  // (x, y, z) becomes (x, z, -y)
  EXPECT_LE((lower_corner(mesh) - 0.0254 * Vec3(0, 10, -2)).norm(), 1e-6);
  EXPECT_LE((mesh.pose(0.5).position - Vec3(0, 2 * 0.0254, 0)).norm(), 1e-6);
  EXPECT_LE((mesh.pose(1.7).position - Vec3(0, 4 * 0.0254, 0)).norm(), 1e-6);
}

TEST_F(MeshTest, GltfIsMetresUnlessTheSceneSaysOtherwise) {
  const AnimatedMesh declared(mesh_desc(turning_node()), {0.01, scene::Axis::kY}, kTwoSeconds);
  expect_near(declared.rest_vertices(), turned(0), 1e-6);
  scene::MeshDesc centimetres = mesh_desc(turning_node());
  centimetres.units.metres_per_unit = 0.01;
  const AnimatedMesh overridden(centimetres, kMetresYUp, kTwoSeconds);
  EXPECT_LE((upper_corner(overridden) - Vec3(0.03, 0.04, 0.05)).norm(), 1e-8);
}

TEST_F(MeshTest, SilentFormatsAreInTheScenesUnits) {
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 2 3\nf 1 2 3\n";
  const AnimatedMesh obj(mesh_desc(write("t.obj", triangle)), {0.01, scene::Axis::kZ}, kTwoSeconds);
  EXPECT_LE((upper_corner(obj) - Vec3(0.01, 0.02, 0.03)).norm(), 1e-9);
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 2 3\n3 0 1 2\n";
  const AnimatedMesh from_ply(mesh_desc(write("t.ply", ply)), {0.01, scene::Axis::kY}, kTwoSeconds);
  EXPECT_LE((upper_corner(from_ply) - Vec3(0.01, 0.02, 0.03)).norm(), 1e-9);
  const std::string stl =
      "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 2 3\n"
      "endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 2 3\n"
      "vertex -1 0 0\nendloop\nendfacet\nendsolid s\n";
  const AnimatedMesh from_stl(mesh_desc(write("t.stl", stl)), {0.01, scene::Axis::kY}, kTwoSeconds);
  EXPECT_EQ(from_stl.vertex_count(), 4u);
  EXPECT_LE((upper_corner(from_stl) - Vec3(0.01, 0.02, 0.03)).norm(), 1e-9);
  scene::MeshDesc upright = mesh_desc(directory / "t.obj");
  upright.units.up = scene::Axis::kX;  // (x, y, z) becomes (-y, x, z)
  EXPECT_LE((upper_corner(AnimatedMesh(upright, kMetresYUp, kTwoSeconds)) - Vec3(0, 1, 3)).norm(), 1e-9);
}

}  // namespace
}  // namespace ringlet::solids
