// Two segments: closest points, crossings and their times against brute force in double.
#include <gtest/gtest.h>

#include <random>

#include "kernels/contact/segment_pair.h"
#include "oracle/segment_crossings.h"

namespace ringlet::kernels_testing {
namespace {

using kernels::PairContact;
using kernels::SegmentPair;
using Vec3 = Eigen::Vector3d;

using Ends = oracle::SegmentEnds;
using Motion = oracle::SegmentMotion;

template <class T>
SegmentPair<T> as_pair(const Motion& motion) {
  const auto vector = [](const Vec3& v) {
    return kernels::Vector3<T>{static_cast<T>(v.x()), static_cast<T>(v.y()), static_cast<T>(v.z())};
  };
  const auto segment = [&](const Ends& ends, int which) {
    return kernels::Segment<T>{vector(ends[which]), vector(ends[which + 1])};
  };
  return {segment(motion.start, 0), segment(motion.start, 2), segment(motion.end, 0), segment(motion.end, 2)};
}
template <class T>
PairContact<T> contact_of(const Motion& motion, double reach = 0) {
  return kernels::find_contact(as_pair<T>(motion), static_cast<T>(reach), T(0));
}
template <class T>
Vec3 normal_of(const PairContact<T>& contact) {
  return {contact.normal.x, contact.normal.y, contact.normal.z};
}

constexpr int kSteps = 4000;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double symmetric() { return uniform_(engine_); }
  Vec3 vector(double size) { return size * Vec3(symmetric(), symmetric(), symmetric()); }
  Ends ends(double size) { return {vector(size), vector(size), vector(size), vector(size)}; }

 private:
  std::mt19937 engine_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

template <class T>
class ContactPair : public testing::Test {
 protected:
  static constexpr bool kDouble = sizeof(T) == 8;
  static constexpr double kTolerance = kDouble ? 1e-14 : 3e-8;  // [m], for segments of some centimetres
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(ContactPair, Precisions);

TYPED_TEST(ContactPair, FindsTheDistanceOfSegmentsInAnyPlace) {
  Random random(1);
  for (int k = 0; k < 20000; ++k) {
    Ends e = random.ends(0.02);
    if (k % 5 == 1) e[3] = e[2] + 0.7 * (e[1] - e[0]);                                // parallel
    if (k % 5 == 2) e[1] = e[0];                                                      // a point
    if (k % 5 == 3) e[2] = e[0] + 0.3 * (e[1] - e[0]);                                // touching
    if (k % 20 == 4) e[1] = e[0], e[3] = e[2];                                        // two points
    if (k % 20 == 9) e[2] = e[1] + random.vector(1e-6), e[3] = e[2] + (e[1] - e[0]);  // end to end
    const auto contact = contact_of<TypeParam>({e, e});
    const double brute = oracle::segment_distance(e);
    EXPECT_FALSE(contact.crossed) << k;  // nothing moved
    EXPECT_NEAR(contact.distance, brute, this->kTolerance) << k;
    EXPECT_TRUE(contact.s >= 0 && contact.s <= 1 && contact.u >= 0 && contact.u <= 1) << k;
    const Vec3 apart = e[0] + contact.s * (e[1] - e[0]) - e[2] - contact.u * (e[3] - e[2]);
    EXPECT_NEAR(apart.norm(), brute, this->kTolerance * 10) << k;
    if (brute > 1e-3) {
      EXPECT_NEAR(normal_of(contact).dot(apart), apart.norm(), this->kTolerance * 10) << k;
    }
  }
}

TYPED_TEST(ContactPair, SeesEveryCrossingAndNoOther) {
  Random random(2);
  int crossed = 0, seen = 0, decided = 0;
  for (int k = 0; k < 4000; ++k) {
    // Of neighbours that move by about their distance.
    Motion motion{random.ends(0.01), {}};
    for (int end = 0; end < 4; ++end) motion.end[end] = motion.start[end] + random.vector(0.008);
    const oracle::SegmentCrossings brute = oracle::segment_crossings(motion, kSteps);
    if (!brute.clear) continue;
    const auto contact = contact_of<TypeParam>(motion);
    const bool turned =
        (oracle::tetrahedron_volume(motion.start) < 0) != (oracle::tetrahedron_volume(motion.end) < 0);
    if (brute.count == 1 && turned) ++crossed, seen += contact.crossed;
    // A crossing and a return is none, and so is one that was undone round a tip.
    if (brute.count == 0 || !turned) {
      EXPECT_FALSE(contact.crossed) << k;
    }
    ++decided;
    if (!contact.crossed || brute.count != 1) continue;
    EXPECT_NEAR(contact.later, 1 - brute.last, 2e-3) << k;
    // The normal is the common perpendicular of that time, on a's side of the start.
    const Ends e = motion.after(1 - contact.later);
    const Vec3 normal = normal_of(contact);
    EXPECT_NEAR(normal.norm(), 1, 1e-5) << k;
    EXPECT_NEAR(normal.dot((e[1] - e[0]).normalized()), 0, 1e-3) << k;
    EXPECT_NEAR(normal.dot((e[3] - e[2]).normalized()), 0, 1e-3) << k;
  }
  EXPECT_GT(decided, 3000);
  EXPECT_GT(crossed, 200);
  EXPECT_GE(seen, crossed - crossed / 200) << "of " << crossed;  // a cubic with three roots may hide one
}

TYPED_TEST(ContactPair, PutsTheNormalOnTheSideOfTheStart) {
  Motion motion{{Vec3(-1, 0, 0.2), Vec3(1, 0, 0.2), Vec3(0, -1, 0), Vec3(0, 1, 0)}, {}};
  motion.end = motion.start;
  for (int k = 0; k < 2; ++k) motion.end[k].z() = -0.3;
  const auto contact = contact_of<TypeParam>(motion);
  EXPECT_TRUE(contact.crossed);
  EXPECT_NEAR(contact.normal.z, 1, 1e-6);
  EXPECT_NEAR(contact.distance, -0.3, 1e-6);
  EXPECT_NEAR(contact.later, 0.6, 1e-5);
  EXPECT_NEAR(contact.s, 0.5, 1e-6);
  EXPECT_NEAR(contact.u, 0.5, 1e-6);
}

TYPED_TEST(ContactPair, DoesNotMindWhatMovesBothAlike) {
  Random random(3);
  for (int k = 0; k < 500; ++k) {
    Motion motion{random.ends(0.01), {}};
    for (int end = 0; end < 4; ++end) motion.end[end] = motion.start[end] + random.vector(0.008);
    if (!oracle::segment_crossings(motion, kSteps).clear) continue;
    Motion carried = motion;
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.5 * random.symmetric(), random.vector(1).normalized()).toRotationMatrix();
    const Vec3 shift = random.vector(0.1);
    for (Vec3& end : carried.end) end = turn * end + shift;
    const auto contact = contact_of<TypeParam>(motion), same = contact_of<TypeParam>(carried);
    // The path between may differ, not what lies on which side: what has crossed is only ever missed where
    // the way of one goes round a tip.
    if (contact.crossed && same.crossed) {
      const Vec3 normal = turn * normal_of(contact);
      EXPECT_GT(normal.dot(normal_of(same)), 0) << k;
    }
  }
}

TYPED_TEST(ContactPair, IsTheSameFromBothSides) {
  Random random(4);
  for (int k = 0; k < 500; ++k) {
    Motion motion{random.ends(0.01), {}};
    for (int end = 0; end < 4; ++end) motion.end[end] = motion.start[end] + random.vector(0.008);
    if (!oracle::segment_crossings(motion, kSteps).clear) continue;
    Motion other;
    for (int end = 0; end < 4; ++end)
      other.start[end] = motion.start[(end + 2) % 4], other.end[end] = motion.end[(end + 2) % 4];
    const auto one = contact_of<TypeParam>(motion), two = contact_of<TypeParam>(other);
    EXPECT_EQ(one.crossed, two.crossed) << k;
    EXPECT_NEAR(one.distance, two.distance, 1e-5) << k;
    if (std::abs(one.distance) < 1e-4) continue;
    EXPECT_NEAR((normal_of(one) + normal_of(two)).norm(), 0, 1e-3) << k;
  }
}

TYPED_TEST(ContactPair, ParallelSegmentsCrossWhereTheyMeetOnTheWay) {
  const auto moved = [](double dy, double aside) {
    Motion motion{{Vec3(0, 0.01, 0), Vec3(0.02, 0.01, 0), Vec3(0.005, 0, aside), Vec3(0.025, 0, aside)}, {}};
    motion.end = motion.start;
    for (int k = 0; k < 2; ++k) motion.end[k].y() += dy;
    return motion;
  };
  const double reach = 1e-4;
  const auto through = contact_of<TypeParam>(moved(-0.03, 0), reach);
  EXPECT_TRUE(through.crossed);
  EXPECT_NEAR(through.normal.y, 1, 1e-6);
  EXPECT_NEAR(through.distance, -0.02, 1e-6);
  EXPECT_NEAR(through.later, 2.0 / 3, 1e-5);
  EXPECT_NEAR(through.s, 0.625, 1e-6);  // the middle of where they lie side by side
  EXPECT_FALSE(contact_of<TypeParam>(moved(-0.03, 0.001), reach).crossed);  // past one another
  EXPECT_FALSE(contact_of<TypeParam>(moved(-0.005, 0), reach).crossed);     // not there yet
  EXPECT_FALSE(contact_of<TypeParam>(moved(0.03, 0), reach).crossed);       // away
}

TYPED_TEST(ContactPair, JointsDoNotLeak) {
  // A straight strand's joint falls on a segment's inside, in places that make either decide.
  Random random(5);
  for (int k = 0; k < 2000; ++k) {
    const Vec3 joint(0.01 * random.symmetric(), 0.005, 0), along(0, 0, 0.01);
    const Vec3 fall(1e-3 * random.symmetric(), -0.01, random.symmetric() * 1e-9);
    const Ends one = {joint - along, joint, Vec3(-0.02, 0, 0), Vec3(0.02, 0, 0)};
    const Ends two = {joint, joint + along, one[2], one[3]};
    const auto falls = [&](Ends e) { return Motion{e, {e[0] + fall, e[1] + fall, e[2], e[3]}}; };
    EXPECT_TRUE(contact_of<TypeParam>(falls(one)).crossed || contact_of<TypeParam>(falls(two)).crossed) << k;
  }
}

TYPED_TEST(ContactPair, SegmentsWithoutLengthDoNotCross) {
  Motion motion{{Vec3(0, 1, 0), Vec3(0, 1, 0), Vec3(-1, 0, 0), Vec3(1, 0, 0)}, {}};
  motion.end = motion.start;
  motion.end[0].y() = motion.end[1].y() = -1;
  const auto contact = contact_of<TypeParam>(motion, 1e-3);
  EXPECT_NEAR(std::abs(contact.distance), 1, 1e-6);
  EXPECT_TRUE(std::isfinite(contact.s) && std::isfinite(contact.u) && normal_of(contact).allFinite());
  motion.start.fill(Vec3::Zero()), motion.end.fill(Vec3::Zero());
  const auto nothing = contact_of<TypeParam>(motion);
  EXPECT_FALSE(nothing.crossed);
  EXPECT_EQ(normal_of(nothing), Vec3::Zero());
}

}  // namespace
}  // namespace ringlet::kernels_testing
