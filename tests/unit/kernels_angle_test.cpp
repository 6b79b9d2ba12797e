// The kernels' arctangent against the standard library's, over all directions and many magnitudes.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "kernels/backend/vector.h"

namespace ringlet {
namespace {

template <class T>
class KernelAngle : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(KernelAngle, Reals);

TYPED_TEST(KernelAngle, IsTheArctangent) {
  using T = TypeParam;
  const double stated = sizeof(T) == 8 ? 1e-15 : 3e-7;
  double worst = 0;
  const auto compare = [&](T sine, T cosine) {
    const double expected = std::atan2(static_cast<double>(sine), static_cast<double>(cosine));
    const double error = std::abs(kernels::angle_between(sine, cosine) - expected) / expected;
    if (!(error <= worst)) worst = error;
  };
  constexpr int kSteps = 200000;
  for (int k = 1; k < kSteps; ++k) {
    const double angle = std::numbers::pi * k / kSteps;
    for (const double size : {1e-9, 1.0, 3e4})
      compare(static_cast<T>(size * std::sin(angle)), static_cast<T>(size * std::cos(angle)));
  }
  for (double tiny = 1e-15; tiny < 1; tiny *= 1.1) compare(static_cast<T>(tiny), T(1));
  EXPECT_TRUE(worst <= stated) << "relative error " << worst;
}

TYPED_TEST(KernelAngle, HasItsLimits) {
  using T = TypeParam;
  const double pi = std::numbers::pi, rounding = std::numeric_limits<T>::epsilon() * 4;
  EXPECT_EQ(kernels::angle_between(T(0), T(0)), T(0));
  EXPECT_EQ(kernels::angle_between(T(0), T(2)), T(0));
  EXPECT_NEAR(kernels::angle_between(T(0), T(-2)), pi, rounding);
  EXPECT_NEAR(kernels::angle_between(T(2), T(0)), pi / 2, rounding);
  EXPECT_NEAR(kernels::angle_between(T(3), T(3)), pi / 4, rounding);
}

TYPED_TEST(KernelAngle, HandsNaNOn) {
  const TypeParam nan = std::numeric_limits<TypeParam>::quiet_NaN();
  EXPECT_TRUE(std::isnan(kernels::angle_between(nan, TypeParam(1))));
  EXPECT_TRUE(std::isnan(kernels::angle_between(TypeParam(1), nan)));
}

}  // namespace
}  // namespace ringlet
