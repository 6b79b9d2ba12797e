// Grooming operations on a real groom: curls of some four segments a turn, uneven as hair is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "groom/edit.h"
#include "groom/measure.h"
#include "unit/groom_support.h"

namespace ringlet::groom::test {
namespace {

constexpr scene::Units kCentimetres{0.01, scene::Axis::kY};
constexpr std::int64_t kTail = 10;  // segments

class RealCurls : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(data("curly/harolongo.data"))) GTEST_SKIP() << "RINGLET_DATA is absent";
    strands = read(data("curly/harolongo.data"), {}, {}, kCentimetres);
  }
  static scene::GroomingOperation lengthen_by(double metres) {
    scene::Lengthen lengthen{};
    lengthen.by = metres;
    lengthen.mode = scene::Lengthening::kExtend;
    return {0, "", lengthen, "lengthen"};
  }
  Strands strands;
};

// The angle between the strand's end, as it was, and what was added [degrees].
double turn_at(const Strands& before, const Strands& after, std::size_t s) {
  const std::int64_t tip = before.count(s) - 1;
  const Vec3* points = &after.points[static_cast<std::size_t>(after.offsets[s])];
  const Vec3 end = points[tip] - points[tip - kTail], added = points[after.count(s) - 1] - points[tip];
  return std::acos(std::clamp(end.normalized().dot(added.normalized()), -1.0, 1.0)) * 180 / M_PI;
}

TEST_F(RealCurls, LengthenedTheyKeepTheirDirectionAndTheirCurl) {
  Strands longer = strands;
  edit(longer, lengthen_by(0.1));
  ASSERT_EQ(longer.size(), strands.size());
  std::vector<double> turns;
  for (std::size_t s = 0; s < strands.size(); ++s) turns.push_back(turn_at(strands, longer, s));
  std::sort(turns.begin(), turns.end());
  EXPECT_LE(turns[turns.size() / 2], 6);        // measured: 5.3; from step to step 6.1
  EXPECT_LE(turns[turns.size() * 9 / 10], 12);  // measured: 10.9; from step to step 24.8
  const Measures was = measure(strands), now = measure(longer);
  EXPECT_NEAR(now.length->mean, was.length->mean + 0.1, 1e-9);
  EXPECT_NEAR(now.curvature->mean, was.curvature->mean, 0.1 * was.curvature->mean);
}

TEST_F(RealCurls, ResampledTheyKeepTheirLength) {
  const Strands fine = resample(strands, {}, 0.002);
  const Measures was = measure(strands), now = measure(fine);
  EXPECT_NEAR(now.segment->mean, 0.002, 1e-4);
  EXPECT_GE(now.length->mean, was.length->mean);         // arcs are longer than their chords
  EXPECT_LE(now.length->mean, 1.02 * was.length->mean);  // measured: 1.0098
}

}  // namespace
}  // namespace ringlet::groom::test
