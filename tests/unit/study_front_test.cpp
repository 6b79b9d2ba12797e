// What a study says about its runs, of points whose answers are known.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

#include "study/errors.h"
#include "study/front.h"
#include "study/reference.h"
#include "study/report.h"
#include "study/study.h"

namespace ringlet::study {
namespace {

using testing::ElementsAre;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(StudyFront, HoldsWhatNothingQuickerMatches) {
  const std::vector<Point> points = {{4, 0.1}, {1, 1}, {2, 1}, {2, 0.3}, {8, 0.1}, {3, 0.4}};
  const auto front = pareto_front(points);
  EXPECT_THAT(front, ElementsAre(1, 3, 0));
  EXPECT_EQ(dominating(points, front, 2), 3u) << "as quick, and more accurate";
  EXPECT_EQ(dominating(points, front, 4), 0u) << "quicker, and as accurate";
  EXPECT_EQ(dominating(points, front, 5), 3u);
  EXPECT_FALSE(dominating(points, front, 0));
}

TEST(StudyFront, HoldsNoErrorThatIsSmallerByLessThanItTells) {
  const std::vector<Point> points = {{1, 0.5}, {2, 0.4999999}, {3, 0.497}, {4, 0.4}};
  const auto front = pareto_front(points);
  EXPECT_THAT(front, ElementsAre(0, 3));
  EXPECT_EQ(dominating(points, front, 1), 0u);
  EXPECT_EQ(dominating(points, front, 2), 0u);
}

TEST(StudyFront, OfRandomPointsIsThatOfEveryPair) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(0.1, 10);
  std::vector<Point> points;
  for (int k = 0; k < 200; ++k) points.push_back({uniform(generator), uniform(generator)});
  std::vector<std::size_t> expected;
  for (std::size_t k = 0; k < points.size(); ++k) {
    bool beaten = false;
    for (const Point& other : points)
      beaten =
          beaten || (other.milliseconds < points[k].milliseconds && kGain * other.error <= points[k].error);
    if (!beaten) expected.push_back(k);
  }
  EXPECT_THAT(pareto_front(points), testing::UnorderedElementsAreArray(expected));
}

TEST(StudyFront, LeavesOutWhatIsNotFinite) {
  EXPECT_THAT(pareto_front({{kInfinity, 0.1}, {1, kNaN}, {2, 0.5}, {1, kInfinity}}), ElementsAre(2));
  EXPECT_THAT(pareto_front({}), ElementsAre());
}

TEST(StudyFront, BendsAtItsKnee) {
  // A digit for twice the time, then a digit for a hundred times.
  const std::vector<Point> bent = {{1, 1}, {2, 0.1}, {4, 0.01}, {400, 0.001}};
  EXPECT_EQ(knee(bent, pareto_front(bent)), 2u);
  const std::vector<Point> straight = {{1, 1}, {10, 0.1}, {100, 0.01}};
  EXPECT_FALSE(knee(straight, pareto_front(straight)));
  const std::vector<Point> bulging = {{1, 1}, {50, 0.9}, {100, 0.01}};
  EXPECT_FALSE(knee(bulging, pareto_front(bulging)));
  EXPECT_FALSE(knee({{1, 1}, {2, 0.1}}, {0, 1}));
}

TEST(StudyFront, ADigitOfAFirstOrderMethodCostsTenTimes) {
  const std::vector<Point> points = {{1, 1}, {2, 0.5}, {4, 0.25}, {8, 0.125}};
  EXPECT_NEAR(digit_cost(points, {0, 1, 2, 3}).value(), 10, 1e-9);
  EXPECT_NEAR(digit_cost({1, 1}, {2, 0.01}).value(), std::sqrt(2), 1e-12);
  EXPECT_FALSE(digit_cost(points, {0}));
  EXPECT_FALSE(digit_cost({1, 1}, {2, 0.99})) << "a hundredth of the error is no digit";
  EXPECT_FALSE(digit_cost({1, 0}, {2, 0}));
}

TEST(StudyFront, OrdersAreTheErrorsSlopes) {
  EXPECT_THAT(orders({1, 2, 4, 12}, {1, 0.5, 0.125, 0.125 / 27}),
              ElementsAre(testing::DoubleNear(1, 1e-12), testing::DoubleNear(2, 1e-12),
                          testing::DoubleNear(3, 1e-12)));
  EXPECT_TRUE(std::isnan(orders({1, 2}, {1, 0})[0]));
  EXPECT_TRUE(std::isnan(orders({2, 2}, {1, 0.5})[0]));
}

TEST(StudyFront, PicksTheQuickestWithinATargetAndTheMostAccurateWithinABudget) {
  const std::vector<Point> points = {{4, 0.1}, {1, 1}, {2, 0.3}, {8, 0.01}, {kInfinity, 0}, {3, kNaN}};
  EXPECT_EQ(pick(points, {{}, 0.5}), 2u);
  EXPECT_EQ(pick(points, {{}, 0.1}), 0u);
  EXPECT_EQ(pick(points, {5.0, {}}), 0u);
  EXPECT_EQ(pick(points, {100.0, {}}), 3u);
  EXPECT_EQ(pick(points, {5.0, 0.5}), 2u);
  EXPECT_FALSE(pick(points, {3.0, 0.1}));
  EXPECT_FALSE(pick(points, {0.5, {}}));
}

TEST(StudyErrors, SpreadsAreThoseOfTheSortedValues) {
  std::mt19937 generator(3);
  std::lognormal_distribution<double> lognormal(-9, 3);
  std::vector<double> values;
  SpreadOf spread;
  double squares = 0;
  for (int k = 0; k < 12345; ++k) {
    values.push_back(lognormal(generator));
    squares += values.back() * values.back();
    spread.add(values.back());
  }
  std::sort(values.begin(), values.end());
  const Spread found = spread.spread().value();
  EXPECT_NEAR(found.rms, std::sqrt(squares / 12345), 1e-12 * found.rms);
  const double p99 = values[(12345 * 99 + 99) / 100 - 1];
  EXPECT_NEAR(found.p99, p99, 0.0055 * p99);
}

TEST(StudyErrors, ZerosAreCountedAndInfinityIsNotHidden) {
  SpreadOf spread;
  EXPECT_FALSE(spread.spread());
  for (int k = 0; k < 99; ++k) spread.add(0);
  spread.add(3);
  EXPECT_EQ(spread.spread()->p99, 0);
  EXPECT_NEAR(spread.spread()->rms, 0.3, 1e-15);
  spread.add(kNaN);
  EXPECT_EQ(spread.spread()->rms, kInfinity);
  EXPECT_EQ(spread.spread()->p99, kInfinity);
}

TEST(StudyReference, DoublesToSixteenTimesTheFinestRun) {
  EXPECT_THAT(ladder(8, 1000), ElementsAre(16, 32, 64, 128));
  EXPECT_THAT(ladder(32, 1000), ElementsAre(64, 128, 256, 512));
  EXPECT_THAT(ladder(64, 1000), ElementsAre(64, 128, 256, 512)) << "1024 is over the cap";
  EXPECT_THAT(ladder(1, 1000), ElementsAre(2, 4, 8, 16));
  EXPECT_THAT(ladder(8, 4), ElementsAre(1, 2, 4));
  EXPECT_THAT(ladder(1, 1), ElementsAre(1));
}

// A study of two runs against a reference whose changes are these.
Study study_of(const std::vector<double>& changes) {
  Study study;
  study.length_unit = "m";
  study.complete = true;
  study.reference_substeps = 1 << changes.size();
  study.wanted.target = 1;
  for (std::size_t k = 0; k < changes.size(); ++k) {
    Level level{2 << k, false, Spread{changes[k], changes[k]}, {}};
    if (k > 0) level.order = std::log2(changes[k - 1] / changes[k]);
    study.levels.push_back(level);
  }
  for (const auto& [time, error] : {std::pair(1.0, 0.1), std::pair(2.0, 0.01)}) {
    Row& row = study.rows.emplace_back();
    row.status = Status::kOk;
    row.label = row.key = std::to_string(time);
    row.measured.errors.position = Spread{error, error};
    row.timed.emplace().milliseconds = time;
  }
  return study;
}

TEST(StudyAnswers, AreNoneWhereTheReferenceDoesNotConverge) {
  const Study growing = study_of({0.02, 0.01, 0.015});
  EXPECT_FALSE(reference_converges(growing));
  const Answers none = answer(growing);
  EXPECT_FALSE(none.digit_cost || none.knee || none.picked);
  EXPECT_THAT(none.front, ElementsAre());
  EXPECT_EQ(none.beaten.size(), 2u);
  const std::string page = report(growing);
  EXPECT_THAT(page, testing::HasSubstr("**The reference does not converge**"));
  EXPECT_THAT(page, testing::Not(testing::HasSubstr("times as long")));
  EXPECT_THAT(page, testing::Not(testing::HasSubstr("was reached")));

  const Study falling = study_of({0.02, 0.01, 0.007});
  EXPECT_TRUE(reference_converges(falling));
  EXPECT_EQ(answer(falling).picked, 0u);
  EXPECT_THAT(report(falling), testing::HasSubstr("a tenth of the error takes 2 times as long"));
  EXPECT_THAT(report(falling), testing::HasSubstr("was reached"));

  Study noise = study_of({2e-8, 1e-8, 1.5e-8});
  noise.resolution = 2e-8;
  EXPECT_TRUE(reference_converges(noise)) << "single precision shows no smaller change";
}

}  // namespace
}  // namespace ringlet::study
