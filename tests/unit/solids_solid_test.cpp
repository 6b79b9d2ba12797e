// Solids as the stepping sees them: placement, velocities, blending, level sets kept on disk.
#include "solids/solid.h"

#include <fmt/format.h>

#include "core/error.h"
#include "solids/level_set_cache.h"
#include "unit/solids_fixtures.h"

namespace ringlet::solids {
namespace {

Vec3 in_world(const double* rotation, const double* translation, const float* vertex) {
  Vec3 result;
  for (int i = 0; i < 3; ++i) {
    result[i] = translation[i];
    for (int k = 0; k < 3; ++k) result[i] += rotation[3 * i + k] * vertex[k];
  }
  return result;
}

Vec3 vertex_before(const kernels::SolidView& view, std::size_t v) {
  return in_world(view.rotation_before, view.translation_before, view.vertices_before + 3 * v);
}
Vec3 vertex_now(const kernels::SolidView& view, std::size_t v) {
  return in_world(view.rotation, view.translation, view.vertices + 3 * v);
}

class SolidTest : public InDirectory {
 protected:
  AnimatedMesh spinning() {  // a ball far from the origin that turns about it, 1 rad a second
    write_obj(directory / "ball.obj", sphere(0.1, {2, 0, 0}, 16, 32));
    scene::MeshDesc desc = mesh_desc(directory / "ball.obj");
    desc.animation.interpolation = scene::Interpolation::kLinear;
    desc.animation.keys = {{1, Vec3::Zero(), Quat::Identity(), 1},
                           {49, Vec3::Zero(), Quat(Eigen::AngleAxisd(2.0, Vec3::UnitZ())), 1}};
    return AnimatedMesh(desc, kMetresYUp, kTwoSeconds);
  }

  AnimatedMesh growing() {  // a ball that doubles in the second frame interval and then holds
    for (const auto& [frame, radius] : {std::pair{1, 0.1}, {2, 0.1}, {3, 0.2}, {4, 0.2}, {5, 0.2}})
      write_obj(directory / fmt::format("ball{}.obj", frame), sphere(radius, {1, 0, 0}, 16, 32));
    return AnimatedMesh(mesh_desc(directory / "ball#.obj"), kMetresYUp, {1, 5, 24, 0});
  }
};

TEST_F(SolidTest, ARigidOneMovesOneLevelSet) {
  const AnimatedMesh mesh = spinning();
  ASSERT_EQ(mesh.motion(), AnimatedMesh::Motion::kRigid);
  Solid solid(solid_desc(40), mesh, kTwoSeconds, 0, {});
  const double t0 = 0.31, t1 = 0.33;
  const kernels::SolidView& view = solid.at(t0, t1);
  EXPECT_EQ(view.level_set[0].distance, view.level_set[1].distance);
  EXPECT_EQ(view.vertices, view.vertices_before);
  EXPECT_EQ(view.blend, 0);
  EXPECT_FLOAT_EQ(view.friction, 0.25f);
  EXPECT_FLOAT_EQ(view.offset, 0.001f);
  EXPECT_NEAR(view.level_set[0].voxel_size, 0.2 / 40, 1e-6);
  for (std::size_t v = 0; v < mesh.vertex_count(); v += 17) {
    const Vec3 rest = mesh.rest_vertices()[v];
    const Vec3 before = Eigen::AngleAxisd(t0, Vec3::UnitZ()) * rest,
               now = Eigen::AngleAxisd(t1, Vec3::UnitZ()) * rest;
    EXPECT_LE((vertex_before(view, v) - before).norm(), 1e-7);
    EXPECT_LE((vertex_now(view, v) - now).norm(), 1e-7);
    // Both ends share the vertex's rounding: the velocity is cleaner than the place.
    EXPECT_LE((vertex_now(view, v) - vertex_before(view, v) - (now - before)).norm(), 1e-8);
  }
}

TEST_F(SolidTest, AStillOneStaysExactly) {
  write_obj(directory / "ball.obj", sphere(0.1, {2, 0, 0}, 16, 32));
  const AnimatedMesh mesh(mesh_desc(directory / "ball.obj"), kMetresYUp, kTwoSeconds);
  Solid solid(solid_desc(40), mesh, kTwoSeconds, 0, {});
  const kernels::SolidView& view = solid.at(0.5, 0.6);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(view.rotation[i], i % 4 == 0 ? 1 : 0);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(view.translation[i], view.translation_before[i]);
  for (std::size_t v = 0; v < mesh.vertex_count(); v += 17)
    EXPECT_LE((vertex_now(view, v) - mesh.rest_vertices()[v]).norm(), 1e-8);
}

TEST_F(SolidTest, ADeformingOneBlendsTheFramesAroundTheSubstep) {
  const AnimatedMesh mesh = growing();
  ASSERT_EQ(mesh.motion(), AnimatedMesh::Motion::kDeforming);
  Solid solid(solid_desc(40), mesh, {1, 5, 24, 0}, 0, {});
  const auto radius =
      [](const kernels::LevelSetView& level_set) {  // from the distance at the voxel in the middle
        return 0.1 * level_set.tile_count[0];       // grows with the ball
      };
  const kernels::SolidView& view = solid.at(1.25 / 24, 1.5 / 24);
  EXPECT_FLOAT_EQ(view.blend, 0.5f);
  EXPECT_LT(radius(view.level_set[0]), radius(view.level_set[1]));
  for (std::size_t v = 0; v < mesh.vertex_count(); v += 17) {
    const Vec3 centre(1, 0, 0), out = (mesh.rest_vertices()[v] - centre).normalized();
    EXPECT_LE((vertex_before(view, v) - centre - 0.125 * out).norm(), 1e-6);
    EXPECT_LE((vertex_now(view, v) - centre - 0.15 * out).norm(), 1e-6);
  }
  EXPECT_FLOAT_EQ(solid.at(1.5 / 24, 2.0 / 24).blend, 1.0f);
  const kernels::SolidView& next = solid.at(2.0 / 24, 2.25 / 24);
  EXPECT_FLOAT_EQ(next.blend, 0.25f);
  // From the third file on the ball holds: its frames share one level set.
  EXPECT_EQ(next.level_set[0].distance, next.level_set[1].distance);
  const std::size_t bytes = solid.bytes();
  solid.at(3.0 / 24, 3.5 / 24);
  EXPECT_EQ(solid.bytes(), bytes);
}

// The scene's motion, ten times as fast, over what the asset does itself: at a substep's two ends every
// vertex is where the keys say, so that its velocity is the finite difference of theirs. What a deforming one
// keeps in its own axes is its deformation alone.
TEST_F(SolidTest, ACarrierGivesItsVelocityToRigidAndDeformingOnes) {
  const scene::Frames frames{1, 25, 24, 0};
  constexpr double kSpeed = 10, kEnd = 1.0 / kSpeed;  // [s] of the ride
  const auto ride = [&](const std::filesystem::path& file) {
    scene::MeshDesc desc = mesh_desc(file);
    desc.animation.carrier_interpolation = scene::Interpolation::kLinear;
    desc.animation.carrier = {{1, Vec3::Zero(), Quat::Identity(), 1},
                              {25, Vec3(40, -8, 3), Quat(Eigen::AngleAxisd(2.0, Vec3::UnitZ())), 1}};
    desc.animation.speed = kSpeed;
    return AnimatedMesh(desc, kMetresYUp, frames);
  };
  write_obj(directory / "rigid.obj", sphere(0.1, {1, 0, 0}, 16, 32));
  for (int number = 1; number <= 60; ++number)
    write_obj(directory / fmt::format("ball{}.obj", number),
              sphere(0.1 + 0.002 * (number % 2), {1, 0, 0}, 16, 32));
  for (const char* name : {"rigid.obj", "ball#.obj"}) {
    const AnimatedMesh mesh = ride(directory / name);
    const bool deforms = std::string(name) != "rigid.obj";
    ASSERT_EQ(mesh.motion(), deforms ? AnimatedMesh::Motion::kDeforming : AnimatedMesh::Motion::kRigid);
    Solid solid(solid_desc(40), mesh, frames, 0, {});
    const auto place = [&](double time, const Vec3& rest) -> Vec3 {
      const double told = std::min(kSpeed * time, 1.0), frame = 24 * kSpeed * time,
                   part = frame - std::floor(frame);
      const auto radius = [](double number) { return 0.1 + 0.002 * (std::fmod(number + 1, 2) == 1); };
      const double now =
          deforms ? radius(std::floor(frame)) * (1 - part) + radius(std::floor(frame) + 1) * part : 0.1;
      const Vec3 centre(1, 0, 0), own = centre + now * (rest - centre).normalized();
      return Eigen::AngleAxisd(2.0 * told, Vec3::UnitZ()) * own + told * Vec3(40, -8, 3);
    };
    for (const double t0 : {0.013, 0.0417, 0.071}) {
      const double t1 = t0 + 1.0 / 1920;
      ASSERT_LT(t1, kEnd);
      const kernels::SolidView& view = solid.at(t0, t1);
      for (std::size_t v = 0; v < mesh.vertex_count(); v += 17) {
        const Vec3 before = place(t0, mesh.rest_vertices()[v]), now = place(t1, mesh.rest_vertices()[v]);
        EXPECT_LE((vertex_before(view, v) - before).norm(), 2e-7) << name;
        EXPECT_LE((vertex_now(view, v) - now).norm(), 2e-7) << name;
        EXPECT_LE((vertex_now(view, v) - vertex_before(view, v) - (now - before)).norm(), 2e-8) << name;
        EXPECT_LT(Eigen::Map<const Eigen::Vector3f>(view.vertices + 3 * v).norm(), 0.11f) << name;
      }
    }
  }
}

TEST_F(SolidTest, SubstepsMeet) {
  const AnimatedMesh mesh = growing();
  Solid solid(solid_desc(24), mesh, {1, 5, 24, 0}, 0, {});
  Vec3 end = vertex_now(solid.at(0, 0.4 / 24), 5);
  for (int i = 1; i < 8; ++i) {
    const kernels::SolidView& view = solid.at(0.4 * i / 24, 0.4 * (i + 1) / 24);
    EXPECT_EQ(vertex_before(view, 5), end);
    end = vertex_now(view, 5);
  }
}

// The ball doubles: its voxels are a share of the largest it becomes.
TEST_F(SolidTest, VoxelsMeasureTheMeshAsItMoves) {
  const AnimatedMesh mesh = growing();
  Solid solid(solid_desc(40), mesh, {1, 5, 24, 0}, 0, {});
  EXPECT_NEAR(solid.at(0, 0.01).level_set[0].voxel_size, 0.4 / 40, 1e-4);
  Solid prolonged(solid_desc(40), mesh, {1, 500, 24, 12}, -0.5, {});
  EXPECT_EQ(prolonged.at(0, 0.01).level_set[0].voxel_size, solid.at(0, 0.01).level_set[0].voxel_size);
}

TEST_F(SolidTest, GivenVoxelCountsAndFlatSurfacesAreAllowed) {
  write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
  const AnimatedMesh mesh(mesh_desc(directory / "sheet.obj"), kMetresYUp, kTwoSeconds);
  scene::Solid desc = solid_desc(10);
  desc.voxel = 0.05;
  Solid solid(desc, mesh, kTwoSeconds, 0, {});
  EXPECT_FLOAT_EQ(solid.at(0, 0.1).level_set[0].voxel_size, 0.05f);
}

// ---- On disk ---------------------------------------------------------------------------------------

class LevelSetCacheTest : public InDirectory {
 protected:
  LevelSetCacheTest() {
    const Shape ball = sphere(0.1, {0, 0, 0}, 16, 32);
    surface_ = close_surface("ball", ball.vertices, ball.triangles);
    for (const Vec3& v : ball.vertices) vertices_.push_back(v.cast<float>());
  }
  std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> result;
    for (const auto& entry : std::filesystem::directory_iterator(directory)) result.push_back(entry.path());
    return result;
  }

  ClosedSurface surface_;
  std::vector<Eigen::Vector3f> vertices_;
  LevelSetOptions options_{0.005f, 3, directory, "ball"};
};

TEST_F(LevelSetCacheTest, AHitIsWhatWasBuilt) {
  const auto built = cached_level_set(surface_, vertices_, options_);
  ASSERT_EQ(files().size(), 1u);
  const auto written = std::filesystem::last_write_time(files().front());
  const auto found = cached_level_set(surface_, vertices_, options_);
  EXPECT_TRUE(*found == *built);
  EXPECT_EQ(std::filesystem::last_write_time(files().front()), written);
}

TEST_F(LevelSetCacheTest, EverythingThatMattersIsInTheKey) {
  std::set<std::string> keys{content_key(surface_, vertices_, options_)};
  LevelSetOptions other = options_;
  other.voxel_size *= 1.0001f;
  keys.insert(content_key(surface_, vertices_, other));
  other = options_;
  other.half_width = 4;
  keys.insert(content_key(surface_, vertices_, other));
  auto moved = vertices_;
  moved[20].y() += 1e-6f;
  keys.insert(content_key(surface_, moved, options_));
  ClosedSurface turned = surface_;
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  keys.insert(content_key(turned, vertices_, options_));
  ClosedSurface hollow = surface_;
  hollow.bounds_cavity[7] = true;
  keys.insert(content_key(hollow, vertices_, options_));
  EXPECT_EQ(keys.size(), 6u);
}

TEST_F(LevelSetCacheTest, BadFilesAreBuiltAnew) {
  const auto built = cached_level_set(surface_, vertices_, options_);
  const std::filesystem::path file = files().front();
  const auto whole = std::filesystem::file_size(file);
  for (const std::uintmax_t size : {std::uintmax_t{0}, std::uintmax_t{100}, whole / 2, whole - 1}) {
    std::filesystem::resize_file(file, size);
    EXPECT_TRUE(*cached_level_set(surface_, vertices_, options_) == *built) << size;
    EXPECT_EQ(std::filesystem::file_size(file), whole);
  }
  std::ofstream(file, std::ios::binary) << std::string(5000, 'x');
  EXPECT_TRUE(*cached_level_set(surface_, vertices_, options_) == *built);
  // Another surface's file under this one's name: it refers to triangles that do not exist here.
  ClosedSurface smaller = surface_;
  smaller.triangles.resize(10);
  EXPECT_THROW(read_level_set(file, smaller.triangles.size()), Error);
}

TEST_F(LevelSetCacheTest, ADirectoryThatCannotBeWrittenIsDoneWithout) {
  options_.directory = write("a_file", "") / "below";  // not even root may
  EXPECT_TRUE(cached_level_set(surface_, vertices_, options_)->encloses_volume());
}

}  // namespace
}  // namespace ringlet::solids
