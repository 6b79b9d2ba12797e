// Hair that is through hair when an application ends: it is known, and put back in the next.
#include <gtest/gtest.h>

#include "contact_support.h"

namespace ringlet::kernels_testing {
namespace {

constexpr double kRadius = 4e-5;

// A strand along x, and one along z that came down through it by 2 mm, unanswered.
template <class T>
class StandingCrossing : public testing::Test {
 protected:
  static constexpr int kParticles = 5;

  StandingCrossing()
      : run_({straight_strand(Vec3::Zero(), Vec3(0.04, 0, 0), kParticles, Vec3::Zero()),
              straight_strand(Vec3(0.003, 0.001, 0.004), Vec3(0, 0, 0.04), kParticles, Vec3::Zero())},
             kRadius, 0) {
    run_.remember();
    shift(1, Vec3(0, -0.003, 0));
    run_.passes = 0;
    run_.collide(HairRun<T>::kFrame);
  }

  void shift(std::size_t strand, const Vec3& by) {
    for (int i = 0; i < kParticles; ++i) run_.set_position(strand, i, run_.position(strand, i) + by);
  }
  int known() {
    run_.remember();
    return run_.contacts->kept();
  }
  // Of the second over the first, after one more application in which nothing moves by itself.
  double above_after(int passes) {
    run_.passes = passes;
    run_.collide(HairRun<T>::kFrame);
    return run_.position(1, 2).y() - run_.position(0, 2).y();
  }

  HairRun<T> run_;
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(StandingCrossing, Precisions);

TYPED_TEST(StandingCrossing, IsPutBackInTheNextApplication) {
  EXPECT_EQ(this->known(), 1);
  EXPECT_GE(this->above_after(8), 2 * kRadius * (1 - 2e-2));
  EXPECT_EQ(this->known(), 0);
}

TYPED_TEST(StandingCrossing, IsKnownWhereItHasSlidAlongTheStrands) {
  this->shift(1, Vec3(0.01, 0, 0));  // to the next segment
  EXPECT_EQ(this->known(), 1);
  const double before = this->run_.position(1, 2).y();
  this->above_after(16);
  EXPECT_GT(this->run_.position(1, 2).y(), before);
  EXPECT_EQ(this->known(), 0);  // a side is only right or wrong where they lie across one another
}

TYPED_TEST(StandingCrossing, EndsWhereOneLeavesTheOther) {
  this->shift(1, Vec3(0.03, 0, 0));  // past the end
  EXPECT_EQ(this->known(), 0);
  const double before = this->run_.position(1, 2).y();
  this->above_after(8);
  EXPECT_EQ(this->run_.position(1, 2).y(), before);
}

TYPED_TEST(StandingCrossing, IsForgottenByNobodyWhoIsToldOfIt) {
  ASSERT_EQ(this->known(), 1);
  std::uint64_t kept = 0;
  this->run_.contacts->copy_kept(&kept);
  this->run_.contacts =
      kernels::make_hair_contacts<TypeParam>(kernels::best_instruction_set(), {run_with_tbb, nullptr});
  this->run_.contacts->begin(this->run_.contact_step());
  EXPECT_TRUE(this->run_.contacts->keep(&kept, 1));
  EXPECT_GE(this->above_after(8), 2 * kRadius * (1 - 2e-2));
}

TYPED_TEST(StandingCrossing, IsKnownWhereItSlidesAfterwards) {
  ASSERT_EQ(this->known(), 1);
  this->shift(1, Vec3(0.01, 0, 0));  // to the next segment, with nobody to answer
  this->above_after(0);
  EXPECT_EQ(this->known(), 1);
  this->above_after(16);
  EXPECT_EQ(this->known(), 0);
}

// So near that the pair is found afresh too, with the side that it is on now.
TYPED_TEST(StandingCrossing, IsPutBackHoweverShallow) {
  for (const double reaches : {0.5, 1.0, 2.0})
    for (const int passes : {7, 8}) {
      const double above = this->run_.position(1, 2).y() - this->run_.position(0, 2).y();
      this->run_.contacts->keep(nullptr, 0);
      this->shift(1, Vec3(0, 0.001 - above, 0));  // over it, and then through
      this->run_.remember();
      this->shift(1, Vec3(0, -0.001 - reaches * 2 * kRadius, 0));
      this->above_after(0);
      ASSERT_EQ(this->known(), 1) << reaches;
      EXPECT_GE(this->above_after(passes), 2 * kRadius * (1 - 2e-2)) << reaches << ", " << passes;
      EXPECT_EQ(this->known(), 0) << reaches << ", " << passes;
    }
}

TYPED_TEST(StandingCrossing, RefusesWhatNamesNoPair) {
  std::uint64_t nothing = ~std::uint64_t{0};
  EXPECT_FALSE(this->run_.contacts->keep(&nothing, 1));
  nothing = 0;  // a segment with itself
  EXPECT_FALSE(this->run_.contacts->keep(&nothing, 1));
}

TYPED_TEST(StandingCrossing, WithoutItHairStaysThrough) {
  this->known();
  this->run_.contacts->keep(nullptr, 0);
  EXPECT_LT(this->above_after(8), -0.0019);
}

// Thick hair elsewhere is no matter to thin hair.
TYPED_TEST(StandingCrossing, RadiiAreThoseOfThePair) {
  const auto contacts_with = [](double thick) {
    HairRun<TypeParam> run({straight_strand(Vec3::Zero(), Vec3(0.04, 0, 0), 5, Vec3::Zero()),
                            straight_strand(Vec3(0, 0.0005, 0), Vec3(0, 0, 0.04), 5, Vec3::Zero()),
                            straight_strand(Vec3(0, 0.05, 0), Vec3(0, 0, 0.04), 5, Vec3::Zero())},
                           kRadius, 0);
    run.set_radius(2, thick);
    run.passes = 1;
    run.remember();
    return run.collide(HairRun<TypeParam>::kFrame);
  };
  EXPECT_EQ(contacts_with(kRadius).contacts, 0);
  EXPECT_EQ(contacts_with(0.005).contacts, 0);
  EXPECT_GT(contacts_with(0.0501).contacts, 0);  // as thick as it is far
}

}  // namespace
}  // namespace ringlet::kernels_testing
