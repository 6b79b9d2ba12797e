// The order of the grid's pressure as a study measures it, and the problem that it measures it on.
#include "study/pressure_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "study/manufactured_pressure.h"

namespace ringlet::study {
namespace {

TEST(StudyPressureOrder, IsTwo) {
  std::vector<PressureLevel> levels;
  for (const int edge : {8, 16, 32, 64}) levels.push_back(pressure_level(edge, kPressureResidual, {}));
  for (const PressureLevel& level : levels) {
    EXPECT_LE(level.residual, kPressureResidual);
    EXPECT_GT(level.iterations, 3);
    EXPECT_LT(level.rms, level.largest);
    // An octant of the ball.
    EXPECT_NEAR(static_cast<double>(level.cells) / std::pow(level.edge, 3), M_PI / 6, 0.05);
  }
  const PressureOrders orders = pressure_orders(levels);
  ASSERT_EQ(orders.rms.size(), 3u);
  for (const std::vector<double>& of : {orders.rms, orders.largest})
    for (const double order : of) {
      EXPECT_GT(order, kPressureOrder - 0.1);
      EXPECT_LT(order, kPressureOrder + 0.1);
    }
  EXPECT_LT(levels.back().largest, 2e-4);
}

// The error is the operator's: a solve that goes on changes none of its digits that the report shows.
TEST(StudyPressureOrder, IsNotOfTheResidual) {
  const PressureLevel level = pressure_level(32, kPressureResidual, {}),
                      further = pressure_level(32, 1e-12, {});
  EXPECT_GT(further.iterations, level.iterations);
  EXPECT_NEAR(further.rms, level.rms, 1e-4 * level.rms);
  EXPECT_NEAR(further.largest, level.largest, 1e-4 * level.largest);
}

TEST(StudyPressureOrder, IsTheSameOnEveryMachine) {
  Machine one, other;
  one.threads = 1, one.options.instruction_set = "generic";
  other.threads = 3;
  const PressureLevel a = pressure_level(16, kPressureResidual, one),
                      b = pressure_level(16, kPressureResidual, other);
  EXPECT_EQ(a.iterations, b.iterations);
  EXPECT_NEAR(a.rms, b.rms, 1e-9 * a.rms);
}

// The order is measured of errors, not known beforehand: of a solve that stops early it is another.
TEST(StudyPressureOrder, IsLessWhereTheSolveStopsEarly) {
  std::vector<PressureLevel> levels;
  for (const int edge : {16, 32, 64}) levels.push_back(pressure_level(edge, 1e-2, {}));
  EXPECT_LT(pressure_orders(levels).rms.back(), 1.5);
}

// f is -div(k grad p), which the sum over a cell's faces comes near to; and the problem is of tiles, of which
// some are full and some are not, between walls and air.
TEST(StudyManufacturedPressure, IsWhatItIsCalled) {
  const ManufacturedPressure<double> manufactured(32);
  const kernels::PressureProblem<double> problem = manufactured.problem();
  double residual = 0, most = 0;
  int separating = 0;
  for (int i = 0; i < problem.cells; ++i) {
    ASSERT_TRUE(i == 0 || problem.key[i - 1] < problem.key[i]);
    double sum = problem.open[i] * manufactured.exact()[i], faces = 0;
    for (int d = 0; d < kernels::kDirections; ++d) {
      const int other = problem.neighbour[d * problem.cells + i];
      const double c = problem.face[d * problem.cells + i];
      faces += c, sum -= c * manufactured.exact()[other];
      ASSERT_EQ(other == i, c == 0);
      if (other == i) continue;
      ASSERT_EQ(problem.neighbour[(d ^ 1) * problem.cells + other], i);
      ASSERT_EQ(problem.face[(d ^ 1) * problem.cells + other], c) << "symmetric";
    }
    EXPECT_GT(manufactured.exact()[i], 0);
    EXPECT_GE(problem.open[i], faces * (1 - 1e-15));
    separating += problem.right[i] < 0 ? 1 : 0;
    residual = std::max(residual, std::abs(sum - problem.right[i]));
    most = std::max(most, std::abs(problem.right[i]));
  }
  // h^2 f to the fourth order of h.
  EXPECT_LT(residual, 1e-3 * most);
  EXPECT_GT(separating, 0);
  std::vector<int> filled;
  for (int i = 0; i < problem.cells; ++i) {
    if (i == 0 || problem.key[i] >> 6 != problem.key[i - 1] >> 6) filled.push_back(0);
    ++filled.back();
  }
  EXPECT_LT(filled.size(), 8u * 8 * 8) << "tiles";
  EXPECT_EQ(*std::max_element(filled.begin(), filled.end()), kernels::kTileCells);
  EXPECT_LT(*std::min_element(filled.begin(), filled.end()), kernels::kTileCells);
}

}  // namespace
}  // namespace ringlet::study
