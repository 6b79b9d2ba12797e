// Attachment: nearest triangles against brute force over sampled points, poses against rigid motions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <limits>
#include <sstream>

#include "core/error.h"
#include "core/random.h"
#include "core/timer.h"
#include "groom/closest_triangle.h"
#include "unit/groom_support.h"

namespace ringlet::groom::test {
namespace {

scene::Groom nearest(double distance = 1.0) {
  scene::Groom desc{};
  desc.name = "hair";
  desc.pointer = "/groom";
  desc.attach = scene::Attach::kNearest;
  desc.attach_distance = distance;
  return desc;
}

Strands strands_at(const std::vector<Vec3>& roots) {
  Strands strands;
  for (const Vec3& root : roots) {
    strands.points.push_back(root);
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
  }
  strands.groups.assign(roots.size(), 0);
  return strands;
}

Vec3 random_vector(Random& random) {
  Vec3 v;
  for (int k = 0; k < 3; ++k) v[k] = random.symmetric();
  return v;
}

// The closest point of a triangle satisfies a variational inequality: no corner is nearer along any
// admissible direction, (p - q) . (corner - q) <= 0. This is exact and owes nothing to how q was found.
TEST(GroomAttachment, ClosestPointOnTriangleIsOptimal) {
  Random random(5, 0);
  for (int trial = 0; trial < 20000; ++trial) {
    const Vec3 a = random_vector(random), b = random_vector(random), c = random_vector(random),
               p = 2 * random_vector(random);
    if (is_degenerate(a, b, c)) continue;
    const ClosestPoint q = closest_on_triangle(p, a, b, c);
    ASSERT_TRUE((q.barycentric.array() >= 0).all() && std::abs(q.barycentric.sum() - 1) <= 1e-14);
    ASSERT_TRUE((q.barycentric[0] * a + q.barycentric[1] * b + q.barycentric[2] * c - q.point).norm() <=
                1e-14);
    ASSERT_TRUE(std::abs((p - q.point).squaredNorm() - q.squared_distance) <= 1e-14);
    for (const Vec3& corner : {a, b, c}) {
      const double slope = (p - q.point).dot(corner - q.point);
      ASSERT_TRUE(slope <= 1e-9) << slope;
    }
  }
}

TEST(GroomAttachment, TreeFindsWhatSearchingAllFinds) {
  const Head head = sphere(20, 30, 0.1);
  const ClosestTriangle tree(head.vertices, head.triangles);
  Random random(3, 0);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vec3 p = 0.2 * random_vector(random);
    ClosestPoint best{.squared_distance = std::numeric_limits<double>::infinity()};
    for (std::size_t t = 0; t < head.triangles.size(); ++t) {
      const auto [i, j, k] = head.triangles[t];
      if (is_degenerate(head.vertices[i], head.vertices[j], head.vertices[k])) continue;
      const ClosestPoint q = closest_on_triangle(p, head.vertices[i], head.vertices[j], head.vertices[k]);
      if (!(q.squared_distance < best.squared_distance)) continue;
      best = q;
      best.triangle = static_cast<std::int32_t>(t);
    }
    const ClosestPoint found = tree.find(p);
    ASSERT_EQ(found.squared_distance, best.squared_distance);
    ASSERT_EQ(found.triangle, best.triangle);
  }
}

TEST(GroomAttachment, TiesGoToTheLowestTriangle) {
  const Head head = sphere(20, 30, 0.1);
  const Attachment held = Attachment::to_head(strands_at(head.vertices), head.scalp(), nearest());
  for (std::size_t v = 30; v + 30 < head.vertices.size();
       ++v) {  // every vertex but the poles' touches six triangles
    std::int32_t lowest = -1;
    for (std::size_t t = 0; t < head.triangles.size() && lowest < 0; ++t) {
      const auto [i, j, k] = head.triangles[t];
      const bool touches = i == static_cast<int>(v) || j == static_cast<int>(v) || k == static_cast<int>(v);
      if (touches && !is_degenerate(head.vertices[i], head.vertices[j], head.vertices[k]))
        lowest = static_cast<std::int32_t>(t);
    }
    EXPECT_EQ(held.sites()[v].triangle, lowest);
  }
}

TEST(GroomAttachment, TrianglesWithoutAreaAreNeverChosen) {
  Head head;
  head.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0), Vec3(0, 0, 1)};
  head.triangles = {{0, 1, 2}, {1, 1, 1}, {0, 2, 3}};
  head.mesh_of_triangle = {0, 0, 0};
  const Strands strands = strands_at({Vec3(1, 0, 0)});
  EXPECT_EQ(Attachment::to_head(strands, head.scalp(), nearest()).sites()[0].triangle, 2);
  Strands stored = strands;
  stored.roots = {{0, Vec3(0, 1, 0)}};
  scene::Groom desc = nearest();
  desc.attach = scene::Attach::kStored;
  EXPECT_EQ(Attachment::to_head(stored, head.scalp(), desc).sites()[0].triangle, 2);
}

struct Moving {
  Head head = sphere(20, 30, 0.1);
  std::vector<Vec3> roots;
  std::vector<Pose> poses;
  Moving() {
    Random random(9, 0);
    for (int i = 0; i < 500; ++i)
      roots.push_back(random_vector(random).normalized() * (0.1 + 0.01 * random.symmetric()));
    poses.resize(roots.size());
  }
};

TEST(GroomAttachment, UnmovedVerticesGiveExactlyTheIdentity) {
  Moving m;
  Attachment::to_head(strands_at(m.roots), m.head.scalp(), nearest()).pose(m.head.vertices, m.poses);
  for (std::size_t i = 0; i < m.roots.size(); ++i) {
    ASSERT_EQ(m.poses[i].rotation, Mat3::Identity());
    ASSERT_EQ(m.poses[i].position, m.roots[i]);
  }
}

TEST(GroomAttachment, RigidMotionIsFollowed) {
  Moving m;
  const Attachment held = Attachment::to_head(strands_at(m.roots), m.head.scalp(), nearest());
  const Mat3 turn = Eigen::AngleAxisd(2.2, Vec3(1, 2, -3).normalized()).toRotationMatrix();
  const Vec3 shift(0.3, -0.7, 5);
  std::vector<Vec3> moved;
  for (const Vec3& v : m.head.vertices) moved.push_back(turn * v + shift);
  held.pose(moved, m.poses);
  for (std::size_t i = 0; i < m.roots.size(); ++i) {
    const double turned = (m.poses[i].rotation - turn).norm(),
                 at = (m.poses[i].position - (turn * m.roots[i] + shift)).norm();
    ASSERT_TRUE(turned <= 1e-12 && at <= 1e-13) << turned << " " << at;
  }
}

// Snapped strands keep their shapes, and their roots lie on the head, moved or not.
TEST(GroomAttachment, SnappedRootsLieOnTheHead) {
  Moving m;
  Random random(31, 0);
  Strands strands;
  for (const Vec3& root : m.roots) {
    for (int i = 0; i < 3; ++i) strands.points.push_back(root + 0.01 * i * random_vector(random));
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
  }
  strands.groups.assign(m.roots.size(), 0);
  scene::Groom desc = nearest();
  Strands kept = strands;
  Attachment::to_head(kept, m.head.scalp(), desc).place(kept);
  EXPECT_EQ(kept.points, strands.points);

  desc.root_offset = scene::RootOffset::kSnap;
  const Attachment held = Attachment::to_head(strands, m.head.scalp(), desc);
  Strands snapped = strands;
  held.place(snapped);
  double farthest = 0;
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const auto first = strands.offsets[s];
    const Vec3 shift = snapped.points[first] - strands.points[first];
    farthest = std::max(farthest, shift.norm());
    for (auto i = first; i < strands.offsets[s + 1]; ++i)
      ASSERT_TRUE((snapped.points[i] - strands.points[i] - shift).norm() <= 1e-15);
  }
  EXPECT_GT(farthest, 0.005);
  std::vector<Vec3> bent;
  for (const Vec3& v : m.head.vertices) bent.emplace_back(v.x() + 0.3 * v.y(), v.y(), v.z() * 1.2);
  for (const auto& vertices : {m.head.vertices, bent}) {
    held.pose(vertices, m.poses);
    for (std::size_t s = 0; s < strands.size(); ++s) {
      const RootSite& site = held.sites()[s];
      const Triangle& t = m.head.triangles[site.triangle];
      const Vec3 on_head = site.barycentric[0] * vertices[t[0]] + site.barycentric[1] * vertices[t[1]] +
                           site.barycentric[2] * vertices[t[2]];
      ASSERT_TRUE((m.poses[s].position - on_head).norm() <= 1e-14);
    }
  }
}

TEST(GroomAttachment, DeformationKeepsRotationsOrthonormal) {
  Moving m;
  const Attachment held = Attachment::to_head(strands_at(m.roots), m.head.scalp(), nearest());
  std::vector<Vec3> moved;
  for (const Vec3& v : m.head.vertices)
    moved.emplace_back(v.x() + 0.5 * v.y(), v.y() * (1 + 3 * v.x()), 0.3 * v.z());
  held.pose(moved, m.poses);
  for (const Pose& pose : m.poses) {
    ASSERT_TRUE((pose.rotation * pose.rotation.transpose() - Mat3::Identity()).norm() <= 1e-13);
    ASSERT_TRUE(std::abs(pose.rotation.determinant() - 1) <= 1e-13);
  }
}

TEST(GroomAttachment, CollapsedTrianglesKeepAFiniteRotation) {
  Moving m;
  const Attachment held = Attachment::to_head(strands_at(m.roots), m.head.scalp(), nearest());
  const auto expect_rotations = [&](const std::function<Vec3(const Vec3&)>& collapse) {
    std::vector<Vec3> moved;
    for (const Vec3& v : m.head.vertices) moved.push_back(collapse(v));
    held.pose(moved, m.poses);
    for (const Pose& pose : m.poses) {
      ASSERT_TRUE((pose.rotation * pose.rotation.transpose() - Mat3::Identity()).norm() <= 1e-12);
      ASSERT_TRUE(pose.position.allFinite());
    }
  };
  expect_rotations([](const Vec3&) { return Vec3(1, 2, 3); });        // to a point
  expect_rotations([](const Vec3& v) { return Vec3(v.x(), 0, 0); });  // to a line
  expect_rotations([](const Vec3& v) { return Vec3(0, 0, v.y() * 1e-30); });
}

TEST(GroomAttachment, StoredSites) {
  const Head head = sphere(20, 30, 0.1);
  const Triangle& t = head.triangles[600];
  const Vec3 a = head.vertices[t[0]], b = head.vertices[t[1]], c = head.vertices[t[2]];
  const Vec3 root = 0.2 * a + 0.3 * b + 0.5 * c, lifted = root * 1.05;
  Strands strands = strands_at({root, lifted, root});
  strands.roots = {{600, Vec3(0.2, 0.3, 0.5)}, {600, Vec3(0.2, 0.3, 0.5)}, {600, Vec3(0.5, 0.3, 0.2)}};
  scene::Groom desc = nearest();
  desc.attach = scene::Attach::kStored;
  const Attachment held = Attachment::to_head(strands, head.scalp(), desc);
  EXPECT_EQ(held.sites()[0].barycentric, Vec3(0.2, 0.3, 0.5));
  EXPECT_EQ(held.sites()[1].barycentric, Vec3(0.2, 0.3, 0.5));  // as good as can be: kept
  EXPECT_TRUE((held.sites()[2].barycentric - Vec3(0.2, 0.3, 0.5)).norm() <=
              1e-12);  // in another order: mended
}

std::string error_of(const Strands& strands, const Head& head, const scene::Groom& desc) {
  try {
    Attachment::to_head(strands, head.scalp(), desc);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return "no error";
}

TEST(GroomAttachment, Errors) {
  using testing::AllOf;
  using testing::HasSubstr;
  const Head head = sphere(20, 30, 0.1);
  const Strands far = strands_at({Vec3(0.1, 0, 0), Vec3(0.4, 0, 0), Vec3(0.2, 0, 0)});
  EXPECT_THAT(error_of(far, head, nearest(0.02)),
              AllOf(HasSubstr("/groom: "), HasSubstr("strand 1 is 0.3"), HasSubstr("at most 0.02 m"),
                    HasSubstr("2 of 3 strands"), HasSubstr("units")));
  EXPECT_THAT(error_of(far, Head{}, nearest()), HasSubstr("no triangle with an area"));
  scene::Groom stored = nearest();
  stored.attach = scene::Attach::kStored;
  EXPECT_THAT(error_of(far, head, stored), HasSubstr("stores no roots"));
  Strands wrong = far;
  wrong.roots = {{0, Vec3(1, 0, 0)}, {1200, Vec3(1, 0, 0)}, {0, Vec3(1, 0, 0)}};
  EXPECT_THAT(error_of(wrong, head, stored),
              HasSubstr("strand 1 is rooted on triangle 1200, the head has triangles 0 to 1199"));
}

// The bear's size: 48,113 roots on 21 thousand triangles. Generous bounds, for busy machines; the figures are
// printed.
TEST(GroomAttachment, IsFastEnough) {
#if defined(__SANITIZE_ADDRESS__) || !defined(NDEBUG)
  GTEST_SKIP() << "only an optimised build says anything about speed";
#endif
  const Head head = sphere(103, 103, 1.0);
  Random random(1, 1);
  std::vector<Vec3> roots;
  for (int i = 0; i < 48113; ++i)
    roots.push_back(random_vector(random).normalized() * (1 + 0.02 * random.symmetric()));
  const Strands strands = strands_at(roots);
  const Timer attach;
  const Attachment held = Attachment::to_head(strands, head.scalp(), nearest());
  const double attach_seconds = attach.seconds();
  std::vector<Pose> poses(roots.size());
  double pose_seconds = 1;
  for (int repeat = 0; repeat < 10; ++repeat) {
    const Timer pose;
    held.pose(head.vertices, poses);
    pose_seconds = std::min(pose_seconds, pose.seconds());
  }
  RecordProperty("attach_ms", static_cast<int>(attach_seconds * 1e3));
  std::printf("attach %.0f ms, pose %.2f ms\n", attach_seconds * 1e3, pose_seconds * 1e3);
  EXPECT_TRUE(attach_seconds <= 5) << attach_seconds;
  EXPECT_TRUE(pose_seconds <= 0.05) << pose_seconds;
}

// Vertices and fan-triangulated faces of an OBJ file: enough for the test data.
Head read_obj(const std::filesystem::path& path, double scale) {
  Head head;
  std::ifstream stream(path);
  for (std::string line; std::getline(stream, line);) {
    std::istringstream words(line);
    std::string kind, word;
    words >> kind;
    if (kind == "v") {
      Vec3 v;
      words >> v.x() >> v.y() >> v.z();
      head.vertices.push_back(v * scale);
    } else if (kind == "f") {
      std::vector<std::int32_t> face;
      while (words >> word) face.push_back(std::stoi(word) - 1);
      for (std::size_t i = 2; i < face.size(); ++i) head.triangles.push_back({face[0], face[i - 1], face[i]});
    }
  }
  head.mesh_of_triangle.assign(head.triangles.size(), 0);
  return head;
}

TEST(GroomRealData, PonytailSitsOnItsHead) {
  if (!std::filesystem::exists(data("ponytail/head.obj"))) GTEST_SKIP() << "RINGLET_DATA is absent";
  const Head head = read_obj(data("ponytail/head.obj"), 0.0027);
  const Strands strands = read(data("ponytail/ponytail.hair"), std::nullopt, {0.0027, {}}, kMetres);
  const Attachment held = Attachment::to_head(strands, head.scalp(), nearest(0.05));
  EXPECT_EQ(held.sites().size(), 4933u);
}

}  // namespace
}  // namespace ringlet::groom::test
