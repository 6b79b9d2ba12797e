// Guides and followers: who is a guide, weights, and what linear hair skinning keeps exactly.
#include <gmock/gmock.h>

#include <numeric>

#include "core/error.h"
#include "core/random.h"
#include "groom/interpolation.h"

namespace ringlet::groom {
namespace {

// Curls of 4 to 12 particles whose roots are scattered over a disc; strands 3 and 5 share a root.
Strands curls(int count) {
  Strands strands;
  for (int s = 0; s < count; ++s) {
    Random random(11, static_cast<std::uint64_t>(s == 5 ? 3 : s));
    const Vec3 root(0.1 * random.symmetric(), 0, 0.1 * random.symmetric());
    const int n = 4 + s % 9;
    for (int i = 0; i < n; ++i) {
      const double t = 0.02 * i, a = 0.9 * i + s;
      strands.points.push_back(
          root + Vec3(0.01 * (std::cos(a) - std::cos(s)), -t, 0.01 * (std::sin(a) - std::sin(s))));
    }
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
    strands.groups.push_back(s % 2);
  }
  strands.group_names = {"even", "odd", "none"};
  return strands;
}

std::vector<Vec3> roots_of(const Strands& strands) {
  std::vector<Vec3> roots;
  for (std::size_t s = 0; s < strands.size(); ++s) roots.push_back(strands.points[strands.offsets[s]]);
  return roots;
}

scene::Interpolate by_count(int count, int neighbours = 3) {
  return {count, std::nullopt, {}, neighbours, "/groom/interpolate"};
}

std::string error_of(const Strands& strands, const scene::Interpolate& interpolate) {
  try {
    choose_guides(strands, interpolate);
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    return error.what();
  }
  return "no error";
}

double deviation(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double distance = (a[i] - b[i]).norm();
    if (!(distance <= most)) most = distance;  // NaN too
  }
  return most;
}

TEST(Guides, AreSpreadOverTheRootsByNumber) {
  const Strands strands = curls(200);
  const auto marks = choose_guides(strands, by_count(20));
  EXPECT_EQ(std::accumulate(marks.begin(), marks.end(), 0), 20);
  // Farthest-point sampling: no strand is farther from its nearest guide than guides are from each other.
  const std::vector<Vec3> roots = roots_of(strands);
  double cover = 0, apart = 1e9;
  for (std::size_t s = 0; s < roots.size(); ++s) {
    double nearest = 1e9;
    for (std::size_t g = 0; g < roots.size(); ++g)
      if (marks[g] && g != s) nearest = std::min(nearest, (roots[s] - roots[g]).norm());
    if (marks[s])
      apart = std::min(apart, nearest);
    else
      cover = std::max(cover, nearest);
  }
  EXPECT_LE(cover, apart);
  EXPECT_EQ(choose_guides(strands, by_count(200)), std::vector<unsigned char>(200, 1))
      << "coinciding roots too";
}

TEST(Guides, AreChosenByGroupOrByNumber) {
  const Strands strands = curls(7);
  EXPECT_THAT(choose_guides(strands, {0, "odd", {}, 3, ""}), testing::ElementsAre(0, 1, 0, 1, 0, 1, 0));
  EXPECT_THAT(choose_guides(strands, {0, std::nullopt, {6, 0}, 3, ""}),
              testing::ElementsAre(1, 0, 0, 0, 0, 0, 1));
}

TEST(Guides, ThatDoNotExistAreAnError) {
  const Strands strands = curls(7);
  EXPECT_EQ(
      error_of(strands, by_count(8)),
      "/groom/interpolate/count: found 8, expected at most the groom's 7 strands (guides are strands of the "
      "groom itself)");
  EXPECT_EQ(error_of(strands, {0, "fringe", {}, 3, "/groom/interpolate"}),
            "/groom/interpolate/group: found \"fringe\", expected a group of the groom with strands in it: "
            "even, odd, "
            "none (guides are strands of the groom itself)");
  EXPECT_THAT(error_of(strands, {0, "none", {}, 3, ""}), testing::StartsWith("/group: found \"none\""));
  EXPECT_EQ(
      error_of(strands, {0, std::nullopt, {2, 7}, 3, "/groom/interpolate"}),
      "/groom/interpolate/strands/1: found 7, expected a strand of the groom, 0 to 6 (guides are strands of "
      "the groom itself)");
}

class Following : public testing::Test {
 protected:
  static constexpr int kStrands = 60, kNeighbours = 3;

  Following() : interpolation_(kNeighbours) {
    marks_ = choose_guides(strands_, by_count(10));
    marks_[3] = 1, marks_[5] = 0;  // strand 5 has the root of a guide
    guides_ = select(strands_, marks_);
    interpolation_.add(strands_, marks_, kNeighbours);
  }

  std::vector<Vec3> follow(const std::vector<Vec3>& guides, const Mat3& rotation,
                           const std::vector<Vec3>& roots) {
    const std::vector<Mat3> rotations(guides_.size(), rotation);
    std::vector<Vec3> out(strands_.points.size(), Vec3::Constant(1e9));
    interpolation_.follow({guides, rotations}, roots, out);
    return out;
  }

  Strands strands_ = curls(kStrands), guides_;
  std::vector<unsigned char> marks_;
  Interpolation interpolation_;
};

TEST_F(Following, TakesTheNearestGuidesWithWeightsThatSumToOne) {
  const std::vector<Vec3> roots = roots_of(strands_);
  for (int s = 0; s < kStrands; ++s) {
    const auto guide = interpolation_.guide().subspan(s * kNeighbours, kNeighbours);
    const auto weight = interpolation_.weight().subspan(s * kNeighbours, kNeighbours);
    EXPECT_NEAR(std::accumulate(weight.begin(), weight.end(), 0.0), 1, 1e-15);
    if (marks_[s]) {
      EXPECT_EQ(interpolation_.guides()[guide[0]], s);
      EXPECT_EQ(weight[0], 1);
      EXPECT_EQ(guide[1], -1);
      continue;
    }
    std::vector<double> distances;
    for (const std::int32_t g : interpolation_.guides()) distances.push_back((roots[g] - roots[s]).norm());
    std::sort(distances.begin(), distances.end());
    for (int k = 0; k < kNeighbours; ++k) {
      const double own = (roots[interpolation_.guides()[guide[k]]] - roots[s]).norm();
      EXPECT_EQ(own, distances[k]);
      if (s != 5) {
        EXPECT_NEAR(weight[k] / weight[0], std::pow(distances[0] / own, 2), 1e-12);
      }
    }
  }
  EXPECT_THAT(interpolation_.weight().subspan(5 * kNeighbours, kNeighbours), testing::ElementsAre(1, 0, 0));
}

TEST_F(Following, KeepsTheRestShapeAtRest) {
  EXPECT_LE(deviation(follow(guides_.points, Mat3::Identity(), roots_of(strands_)), strands_.points), 1e-15);
}

TEST_F(Following, PassesRigidMotionOnExactly) {
  const Mat3 turn = Quat(0.3, -0.5, 0.7, 0.4).normalized().toRotationMatrix();
  const Vec3 shift(3, -2, 1);
  const auto moved = [&](std::vector<Vec3> points) {
    for (Vec3& x : points) x = turn * x + shift;
    return points;
  };
  const std::vector<Vec3> followed = follow(moved(guides_.points), turn, moved(roots_of(strands_)));
  EXPECT_LE(deviation(followed, moved(strands_.points)), 4e-15);  // rounding of coordinates of some 4 m
}

TEST_F(Following, CopiesGuidesBitForBit) {
  std::vector<Vec3> bent = guides_.points;
  Random random(3, 0);
  for (Vec3& x : bent) x += 0.03 * Vec3(random.symmetric(), random.symmetric(), random.symmetric());
  const std::vector<Vec3> all = follow(bent, Mat3::Identity(), roots_of(strands_));
  std::size_t first = 0;
  for (const std::int32_t s : interpolation_.guides())
    for (auto i = strands_.offsets[s]; i < strands_.offsets[s + 1]; ++i) EXPECT_EQ(all[i], bent[first++]);
  EXPECT_EQ(first, bent.size());
}

TEST_F(Following, HoldsEveryRootWhereItIsTold) {
  std::vector<Vec3> roots = roots_of(strands_);
  for (std::size_t s = 0; s < roots.size(); ++s)
    if (!marks_[s]) roots[s] += Vec3(0.001, 0.002, -0.001);  // skin that deforms
  const std::vector<Vec3> all = follow(guides_.points, Mat3::Identity(), roots);
  for (std::size_t s = 0; s < roots.size(); ++s) {
    EXPECT_EQ(all[strands_.offsets[s]], roots[s]);
    for (auto i = strands_.offsets[s]; i < strands_.offsets[s + 1] && !marks_[s]; ++i)
      EXPECT_LE((all[i] - strands_.points[i] - Vec3(0.001, 0.002, -0.001)).norm(), 1e-15);
  }
}

// One straight guide that is bent into a quarter circle in the plane; a parallel follower beside it keeps its
// distance to the guide's tangent frame: closed form, a concentric arc, to the order of the segments.
TEST(OneGuide, BentToAnArcTakesItsFollowerToTheConcentricOne) {
  double before = 0;
  for (const int n : {9, 17, 33}) {
    Strands strands;
    const double length = 0.3, beside = 0.02, radius = length / (0.5 * M_PI);
    for (const double x : {0.0, beside}) {
      for (int i = 0; i < n; ++i) strands.points.emplace_back(x, -length * i / (n - 1), 0);
      strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
    }
    Interpolation interpolation(1);
    interpolation.add(strands, std::vector<unsigned char>{1, 0}, 1);
    std::vector<Vec3> bent, expected;
    for (int i = 0; i < n; ++i) {
      const double a = 0.5 * M_PI * i / (n - 1);
      bent.emplace_back(radius * (1 - std::cos(a)), -radius * std::sin(a), 0);
    }
    for (int i = 0; i < n; ++i) {
      const double a = 0.5 * M_PI * i / (n - 1);
      expected.emplace_back(radius - (radius - beside) * std::cos(a), -(radius - beside) * std::sin(a), 0);
    }
    std::vector<Vec3> out(2 * n);
    interpolation.follow({bent, std::vector<Mat3>{Mat3::Identity()}},
                         std::vector<Vec3>{Vec3::Zero(), {beside, 0, 0}}, out);
    const double error = deviation({out.begin() + n, out.end()}, expected);
    if (before > 0) {
      EXPECT_LE(error, 0.6 * before) << "at least first order";
    }
    before = error;
  }
  EXPECT_LE(before, 1e-3);
}

// The same guide and a follower a fifth as long: it lies along the arc's beginning and keeps its length.
TEST(OneGuide, ThatIsLongerCarriesAShortFollowerByItsBeginning) {
  constexpr int kGuide = 61, kFollower = 13;
  const double length = 0.3, beside = 0.02, radius = length / (0.5 * M_PI);
  Strands strands;
  const auto grow = [&](double x, int n, double of) {
    for (int i = 0; i < n; ++i) strands.points.emplace_back(x, -of * i / (n - 1), 0);
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
  };
  grow(0, kGuide, length), grow(beside, kFollower, length / 5);
  Interpolation interpolation(1);
  interpolation.add(strands, std::vector<unsigned char>{1, 0}, 1);
  const auto arc = [&](double r, double angle) {
    return Vec3(radius - r * std::cos(angle), -r * std::sin(angle), 0);
  };
  std::vector<Vec3> bent, expected;
  for (int i = 0; i < kGuide; ++i) bent.push_back(arc(radius, 0.5 * M_PI * i / (kGuide - 1)));
  for (int i = 0; i < kFollower; ++i)
    expected.push_back(arc(radius - beside, 0.1 * M_PI * i / (kFollower - 1)));
  std::vector<Vec3> out(kGuide + kFollower);
  interpolation.follow({bent, std::vector<Mat3>{Mat3::Identity()}},
                       std::vector<Vec3>{Vec3::Zero(), {beside, 0, 0}}, out);
  EXPECT_LE(deviation({out.begin() + kGuide, out.end()}, expected), 5e-4);
}

TEST(OneGuide, ThatIsShorterCarriesWhatIsBeyondItsTipRigidly) {
  Strands strands;
  for (const int n : {3, 6}) {
    for (int i = 0; i < n; ++i) strands.points.emplace_back(0, -0.1 * i, 0);
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
  }
  Interpolation interpolation(1);
  interpolation.add(strands, std::vector<unsigned char>{1, 0}, 1);
  const std::vector<Vec3> bent = {
      {0, 0, 0}, {0, -0.1, 0}, {0.1, -0.1, 0}};  // its last segment by a right angle
  std::vector<Vec3> out(9);
  interpolation.follow({bent, std::vector<Mat3>{Mat3::Identity()}}, std::vector<Vec3>(2, Vec3::Zero()), out);
  for (int i = 0; i < 4; ++i) EXPECT_LE((out[5 + i] - Vec3(0.1 + 0.1 * i, -0.1, 0)).norm(), 1e-15) << i;
}

TEST(OneGuide, OfAnyKindOfStrandIsFollowedWithoutNaN) {
  Strands strands;
  const std::vector<std::vector<Vec3>> shapes = {
      {{0, 0, 0}},                                      // a root alone
      {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}},                // no length
      {{2, 0, 0}, {2, -1, 0}, {2, -1, 0}, {2, -2, 0}},  // a doubled point
      {{3, 0, 0}, {3, -1, 0}, {3, 0, 0}}};              // there and back
  for (const auto& shape : shapes) {
    strands.points.insert(strands.points.end(), shape.begin(), shape.end());
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
  }
  for (std::size_t guide = 0; guide < shapes.size(); ++guide) {
    std::vector<unsigned char> marks(shapes.size(), 0);
    marks[guide] = 1;
    Interpolation interpolation(3);
    interpolation.add(strands, marks, 3);
    std::vector<Vec3> now = shapes[guide];
    std::reverse(now.begin(), now.end());  // half a turn: directions opposed
    std::vector<Vec3> out(strands.points.size());
    interpolation.follow({now, std::vector<Mat3>{Mat3::Identity()}}, roots_of(strands), out);
    for (const Vec3& x : out) EXPECT_TRUE(x.allFinite());
  }
}

}  // namespace
}  // namespace ringlet::groom
