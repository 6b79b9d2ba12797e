// Strands through a hair mesh: against closed forms, under rigid and affine motion, collapsed.
#include "groom/hair_mesh_strands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "core/error.h"
#include "unit/hair_mesh_support.h"

namespace ringlet::groom::test {
namespace {
using testing::HasSubstr;

HairMeshStrandsDesc with_strands(int count, int points = 16) {
  HairMeshStrandsDesc desc;
  desc.strands = count;
  desc.points = points;
  return desc;
}

HairMeshStrandsDesc curly(int count) {
  HairMeshStrandsDesc desc = with_strands(count, 40);
  desc.curl_radius = 0.004;
  desc.curl_turns = 3;
  desc.noise = 0.001;
  return desc;
}

std::vector<Vec3> placed(const HairMeshStrands& strands, const std::vector<Vec3>& vertices) {
  std::vector<Vec3> points(strands.size() * static_cast<std::size_t>(strands.points()));
  strands.place(vertices, points);
  return points;
}

double largest_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

// ---- Curves ---------------------------------------------------------------------------------------------

TEST(HairMeshStrands, StraightMeshesGiveStraightStrandsOfEvenPoints) {
  for (const HairMesh& mesh :
       {slab(3, 2, 6, 0.02, 0.03), slab(3, 2, 2, 0.02, 0.15), slab(3, 2, 3, 0.02, 0.075)}) {
    const Strands strands = HairMeshStrands(mesh, with_strands(200, 11), "").strands();
    ASSERT_EQ(strands.size(), 200u);
    for (std::size_t s = 0; s < strands.size(); ++s) {
      const Vec3 root = strands.points[strands.offsets[s]];
      EXPECT_NEAR(root.z(), 0, 1e-17);
      for (int j = 0; j < 11; ++j)
        EXPECT_LE((strands.points[strands.offsets[s] + j] - root - Vec3(0, 0, 0.015 * j)).norm(), 1e-12);
    }
    EXPECT_EQ(strands.widths.size(), strands.points.size());
    EXPECT_FLOAT_EQ(strands.widths[0], 7e-5f);
    EXPECT_EQ(strands.group_names, std::vector<std::string>{"hair_mesh"});
    EXPECT_TRUE(strands.roots.empty());
  }
}

// Layers turned about an axis evenly: the strands are arcs of circles. Catmull-Rom is of third order in the
// layers' distance for the position.
TEST(HairMeshStrands, ArcsConvergeWithTheLayers) {
  const auto error = [](int layers) {
    HairMesh mesh = slab(2, 2, layers, 0.05, 1.0 / (layers - 1));
    for (Vec3& x : mesh.positions) {  // about the axis y = -1, z = 0
      const double angle = x.z(), radius = 1 + x.y();
      x = Vec3(x.x(), radius * std::cos(angle) - 1, radius * std::sin(angle));
    }
    const Strands strands = HairMeshStrands(mesh, with_strands(20, 200), "").strands();
    double worst = 0;
    for (std::size_t s = 0; s < strands.size(); ++s) {
      const double radius = strands.points[strands.offsets[s]].y() + 1;
      for (std::int64_t i = strands.offsets[s]; i < strands.offsets[s + 1]; ++i)
        worst =
            std::max(worst, std::abs(std::hypot(strands.points[i].y() + 1, strands.points[i].z()) - radius));
    }
    return worst;
  };
  const double coarse = error(5), fine = error(9), finer = error(17);
  EXPECT_LE(finer, 3e-5);
  EXPECT_GE(std::log2(coarse / fine), 2.7);
  EXPECT_GE(std::log2(fine / finer), 2.7);
}

TEST(HairMeshStrands, CurvesHaveNoCornerAndTheSameEndsHoweverFine) {
  const HairMesh mesh = random_mesh(3);
  const HairMeshStrands coarse(mesh, with_strands(50, 2), ""), fine(mesh, with_strands(50, 4001), "");
  const Strands curves = fine.strands(), ends = coarse.strands();
  for (std::size_t s = 0; s < curves.size(); ++s) {
    const auto* points = &curves.points[curves.offsets[s]];
    EXPECT_LE((ends.points[2 * s] - points[0]).norm(), 1e-15);
    EXPECT_LE((ends.points[2 * s + 1] - points[4000]).norm(), 1e-15);
    // Directions turn by an angle that goes with the step: no corner at a layer.
    for (int j = 1; j < 4000; ++j) {
      const Vec3 before = (points[j] - points[j - 1]).normalized(),
                 after = (points[j + 1] - points[j]).normalized();
      EXPECT_LE((after - before).norm(), 0.02);
    }
  }
}

// Each control point is the same combination of its layer's vertices, and the curve goes through it. One
// quad, whose weights follow from where the root is.
TEST(HairMeshStrands, ControlPointsHaveTheRootsWeights) {
  HairMesh mesh = slab(1, 1, 5, 1, 1);
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> noise(-0.1, 0.1);
  for (std::size_t i = 4; i < mesh.positions.size(); ++i)
    for (int k = 0; k < 3; ++k) mesh.positions[i][k] += noise(engine);
  const Strands strands = HairMeshStrands(mesh, with_strands(30, 2001), "").strands();
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const auto* points = &strands.points[strands.offsets[s]];
    const double u = points[0].x(), v = points[0].y();
    for (int k = 0; k < 5; ++k) {
      const auto layer = mesh.layer(k);
      const HairMesh::Face& f = mesh.faces[0];
      const Vec3 control = (1 - u) * (1 - v) * layer[f[0]] + u * (1 - v) * layer[f[1]] + u * v * layer[f[2]] +
                           (1 - u) * v * layer[f[3]];
      double nearest = 1;
      for (int j = 0; j < 2001; ++j) nearest = std::min(nearest, (points[j] - control).norm());
      EXPECT_LE(nearest, 1.5e-3);  // half a step, 4 / 2000 long
    }
  }
}

// ---- Roots ----------------------------------------------------------------------------------------------

// The quarters of a trapezoid's height hold shares of its area; binomial deviations are below five of their
// standard deviations.
TEST(HairMeshStrands, RootsAreUniformByArea) {
  HairMesh mesh = slab(1, 1, 2, 1, 1);
  for (int k = 0; k < 2; ++k) {  // the upper side
    mesh.positions[4 * k + 2].x() = 0.8;
    mesh.positions[4 * k + 3].x() = 0.9;
  }
  constexpr int kCount = 40000;
  const Strands strands = HairMeshStrands(mesh, with_strands(kCount, 2), "").strands();
  // Width at height y: 1 - 0.9 y, from x = 0.8 y to 1 - 0.1 y.
  std::array<int, 4> found{};
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const Vec3& root = strands.points[2 * s];
    EXPECT_TRUE(root.x() >= 0.8 * root.y() - 1e-12 && root.x() <= 1 - 0.1 * root.y() + 1e-12);
    ++found[std::min(3, static_cast<int>(root.y() * 4))];
  }
  for (int q = 0; q < 4; ++q) {
    const double low = q / 4.0, high = low + 0.25;
    const double share = ((high - low) - 0.45 * (high * high - low * low)) / 0.55;
    EXPECT_NEAR(found[q], share * kCount, 5 * std::sqrt(kCount * share * (1 - share)));
  }
}

TEST(HairMeshStrands, DensityCountsOverTheScalp) {
  const HairMesh mesh = slab(4, 3, 2, 0.01, 0.1);
  HairMeshStrandsDesc desc;
  desc.density = 2e6;
  EXPECT_EQ(HairMeshStrands(mesh, desc, "").size(), 2400u);
  std::array<int, 12> of_face{};
  const Strands strands = HairMeshStrands(mesh, desc, "").strands();
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const Vec3& root = strands.points[strands.offsets[s]];
    ++of_face[4 * static_cast<int>(root.y() / 0.01) + static_cast<int>(root.x() / 0.01)];
  }
  for (const int count : of_face) EXPECT_NEAR(count, 200, 1);  // one in each equal part of the area
}

TEST(HairMeshStrands, GroupsAreTheFaces) {
  const HairMesh mesh = random_mesh(3);
  const Strands strands = HairMeshStrands(mesh, with_strands(500), "").strands();
  EXPECT_EQ(strands.group_names, mesh.group_names);
  EXPECT_EQ(strands.groups.size(), 500u);
  for (std::int32_t group = 0; group < 3; ++group)
    EXPECT_GT(std::count(strands.groups.begin(), strands.groups.end(), group), 20);
}

TEST(HairMeshStrands, SeedsAndThreads) {
  const HairMesh mesh = random_mesh(3);
  HairMeshStrandsDesc desc = curly(3000);
  const std::vector<Vec3> once = HairMeshStrands(mesh, desc, "").strands().points;
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    EXPECT_EQ(HairMeshStrands(mesh, desc, "").strands().points, once);
  }
  desc.seed = 1;
  EXPECT_NE(HairMeshStrands(mesh, desc, "").strands().points, once);
}

// ---- Motion ---------------------------------------------------------------------------------------------

TEST(HairMeshStrands, RigidMotionCarriesStrandsRigidly) {
  const HairMesh mesh = random_mesh(4);
  const Mat3 turn = Eigen::AngleAxisd(2.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
  const Vec3 shift(0.3, -1.2, 0.7);
  std::vector<Vec3> moved = mesh.positions;
  for (Vec3& x : moved) x = turn * x + shift;
  for (const HairMeshStrandsDesc& desc : {with_strands(300), curly(300)}) {
    const HairMeshStrands strands(mesh, desc, "");
    std::vector<Vec3> expected = strands.strands().points;
    for (Vec3& x : expected) x = turn * x + shift;
    EXPECT_LE(largest_distance(placed(strands, moved), expected), 1e-14);
  }
}

// Any affine map does the same: strands do not swim in the mesh.
TEST(HairMeshStrands, AffineMapsCarryStrandsAlong) {
  const HairMesh mesh = random_mesh(4);
  Mat3 map;
  map << 1.2, 0.3, 0, -0.1, 0.7, 0.4, 0.2, 0, 1.5;
  std::vector<Vec3> moved = mesh.positions;
  for (Vec3& x : moved) x = map * x;
  const HairMeshStrands strands(mesh, curly(300), "");
  std::vector<Vec3> expected = strands.strands().points;
  for (Vec3& x : expected) x = map * x;
  EXPECT_LE(largest_distance(placed(strands, moved), expected), 1e-14);
}

TEST(HairMeshStrands, LinearInTheVertices) {
  const HairMesh a = random_mesh(4), b = random_mesh(5);
  std::vector<Vec3> sum(a.positions.size());
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] = a.positions[i] + 0.5 * b.positions[i];
  const HairMeshStrands strands(a, curly(100), "");
  std::vector<Vec3> expected = placed(strands, a.positions);
  const std::vector<Vec3> other = placed(strands, b.positions);
  for (std::size_t i = 0; i < expected.size(); ++i) expected[i] += 0.5 * other[i];
  EXPECT_LE(largest_distance(placed(strands, sum), expected), 1e-14);
}

TEST(HairMeshStrands, CollapsedMeshesGiveFinitePoints) {
  const HairMesh mesh = random_mesh(4);
  std::vector<Vec3> collapsed = mesh.positions;
  for (std::size_t i = 0; i < collapsed.size(); ++i) collapsed[i] = mesh.positions[i % mesh.vertices()];
  for (const Vec3& x : placed(HairMeshStrands(mesh, curly(300), ""), collapsed)) EXPECT_TRUE(x.allFinite());
  const std::vector<Vec3> plain = placed(HairMeshStrands(mesh, with_strands(300), ""), collapsed);
  const std::vector<Vec3> rest = HairMeshStrands(mesh, with_strands(300), "").strands().points;
  for (std::size_t i = 0; i < plain.size(); ++i) EXPECT_LE((plain[i] - rest[i - i % 16]).norm(), 1e-15);
}

// ---- Curl and noise -------------------------------------------------------------------------------------

// On a straight strand the curl is a helix of a radius that grows with the length.
TEST(HairMeshStrands, CurlIsAHelixThatGrows) {
  HairMeshStrandsDesc desc = with_strands(50, 101);
  desc.curl_radius = 0.01;
  desc.curl_turns = 4;
  const HairMesh mesh = slab(3, 2, 6, 0.02, 0.03);
  const Strands curled = HairMeshStrands(mesh, desc, "").strands();
  desc.curl_turns = 0;
  const Strands plain = HairMeshStrands(mesh, desc, "").strands();
  for (std::size_t s = 0; s < curled.size(); ++s) {
    double turned = 0;
    for (int j = 0; j <= 100; ++j) {
      const Vec3 offset = curled.points[101 * s + j] - plain.points[101 * s + j];
      EXPECT_NEAR(offset.norm(), 0.01 * j / 100, 1e-9);
      EXPECT_NEAR(offset.z(), 0, 1e-9);
      if (j < 2) continue;
      const Vec3 before = curled.points[101 * s + j - 1] - plain.points[101 * s + j - 1];
      turned += std::atan2(before.cross(offset).z(), before.dot(offset));
    }
    EXPECT_NEAR(turned / (2 * M_PI), 4 * 99 / 100.0, 1e-4);
  }
}

// A lean of the whole mesh leaves offsets as they are until its prisms are nearly flat; then there are none,
// and what the mesh does throws no point far.
TEST(HairMeshStrands, OffsetsFadeWherePrismsAreNearlyFlat) {
  HairMeshStrandsDesc plain, curly;
  plain.strands = curly.strands = 50;
  curly.curl_radius = 0.002, curly.curl_turns = 2;
  const auto most_apart = [&](double lean, double straightened) {
    HairMesh mesh = slab(2, 2, 4, 0.02, 0.03);
    for (Vec3& x : mesh.positions) x.x() += lean * x.z();
    const HairMeshStrands with(mesh, curly, ""), without(mesh, plain, "");
    for (Vec3& x : mesh.positions) x.x() -= straightened * x.z();
    std::vector<Vec3> a(50 * with.points()), b(a.size());
    with.place(mesh.positions, a), without.place(mesh.positions, b);
    double most = 0;
    for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
    return most;
  };
  EXPECT_NEAR(most_apart(0, 0), 0.002, 2e-6);
  EXPECT_NEAR(most_apart(2, 0), 0.002, 2e-6);
  EXPECT_EQ(most_apart(20, 0), 0);
  for (const double lean : {2.0, 3.0, 5.0, 8.0, 20.0}) EXPECT_LT(most_apart(lean, lean), 3 * 0.002) << lean;
}

TEST(HairMeshStrands, NoiseHasItsRootMeanSquare) {
  HairMeshStrandsDesc desc = with_strands(4000, 8);
  const HairMesh mesh = slab(3, 2, 6, 0.02, 0.03);
  const Strands plain = HairMeshStrands(mesh, desc, "").strands();
  desc.noise = 0.002;
  const Strands noisy = HairMeshStrands(mesh, desc, "").strands();
  double sum = 0;
  for (std::size_t s = 0; s < noisy.size(); ++s) {
    EXPECT_EQ(noisy.points[8 * s], plain.points[8 * s]);
    sum += (noisy.points[8 * s + 7] - plain.points[8 * s + 7]).squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(sum / 4000), 0.002, 0.0001);
}

// ---- Bad numbers ----------------------------------------------------------------------------------------

TEST(HairMeshStrands, NumbersOutOfRange) {
  const HairMesh mesh = slab(1, 1, 2, 0.01, 0.1);
  const auto refusal = [&](auto change) {
    HairMeshStrandsDesc desc = with_strands(10);
    change(desc);
    try {
      HairMeshStrands(mesh, desc, "/groom");
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(refusal([](auto& d) { d.points = 1; }),
              HasSubstr("/groom: points: found 1, expected 2 to 10000"));
  EXPECT_THAT(refusal([](auto& d) { d.width = 0; }), HasSubstr("width: found 0, expected a number above 0"));
  EXPECT_THAT(refusal([](auto& d) { d.noise = NAN; }), HasSubstr("noise: found nan"));
  EXPECT_THAT(refusal([](auto& d) { d.curl_turns = 1e9; }), HasSubstr("curl turns: found"));
  EXPECT_THAT(refusal([](auto& d) { d.strands = 0, d.density = 1; }),
              HasSubstr("1 strands for each m^2 on a scalp of 0.0001 m^2 are 0, expected 1 to"));
}

}  // namespace
}  // namespace ringlet::groom::test
