// The study's reference against an independent solve: the same strand's equations of motion, written by the
// oracle, integrated by Runge and Kutta's explicit method of fourth order.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cache/reader.h"
#include "oracle/ams_reference.h"
#include "study/study.h"

namespace ringlet::study {
namespace {

namespace fs = std::filesystem;

constexpr int kParticles = 12, kLastFrame = 5;
constexpr double kRate = 24, kDrag = 0.5;
const oracle::Stiffness kStiffness{2000, 1000, 500, 50, 20};

class StudySingleStrand : public testing::Test {
 protected:
  StudySingleStrand() {
    fs::create_directories(folder_);
    std::ofstream groom(folder_ / "curl.data", std::ios::binary);
    const auto write = [&](auto value) { groom.write(reinterpret_cast<const char*>(&value), sizeof value); };
    write(std::int32_t{1}), write(std::int32_t{kParticles});
    for (int i = 0; i < kParticles; ++i)
      for (int c = 0; c < 3; ++c) {
        const float x = static_cast<float>(c == 0   ? 0.02 * std::cos(0.8 * i)
                                           : c == 1 ? 0.02 * std::sin(0.8 * i)
                                                    : 0.01 * i);
        write(x);
        rest_(c, i) = static_cast<double>(x);
      }
    const nlohmann::json scene = {{"name", "curl"},
                                  {"frames", {{"last", kLastFrame}, {"fps", kRate}}},
                                  {"groom", {{"file", "curl.data"}, {"attach", "fixed"}}},
                                  {"model",
                                   {{"stiffness",
                                     {{"edge", kStiffness.edge},
                                      {"bend", kStiffness.bend},
                                      {"twist", kStiffness.twist},
                                      {"integrity", kStiffness.integrity},
                                      {"angular", kStiffness.angular}}},
                                    {"drag", kDrag},
                                    {"material_damping", 0},
                                    {"preload", false}}},
                                  {"effects", {{"gravity", {0, -9.81, 0}}}}};
    std::ofstream(folder_ / "curl.json") << scene;
  }
  ~StudySingleStrand() override { fs::remove_all(folder_); }

  // Positions after `seconds`, by so many steps.
  oracle::Points integrate(double seconds, int steps) const {
    oracle::Strand strand = oracle::make_strand(rest_, kStiffness);
    strand.gravity = {0, -9.81, 0}, strand.drag = kDrag;
    const oracle::RootPose pose{oracle::Mat3::Identity(), rest_.col(0)};
    const auto acceleration = [&](const oracle::Points& x, const oracle::Points& v) {
      oracle::Points a = oracle::spring_force(strand, x) + oracle::integrity_force(strand, x, pose) +
                         oracle::angular_force(strand, x, pose) - kDrag * v;
      a.colwise() += strand.gravity;
      a.col(0).setZero();  // held
      return a;
    };
    oracle::Points x = rest_, v = oracle::Points::Zero(3, kParticles);
    const double h = seconds / steps;
    for (int n = 0; n < steps; ++n) {
      const oracle::Points x1 = v, v1 = acceleration(x, v);
      const oracle::Points x2 = v + h / 2 * v1, v2 = acceleration(x + h / 2 * x1, x2);
      const oracle::Points x3 = v + h / 2 * v2, v3 = acceleration(x + h / 2 * x2, x3);
      const oracle::Points x4 = v + h * v3, v4 = acceleration(x + h * x3, x4);
      x += h / 6 * (x1 + 2 * x2 + 2 * x3 + x4);
      v += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    }
    return x;
  }

  const fs::path folder_ = fs::path(testing::TempDir()) / ("ringlet_study_" + std::to_string(getpid()));
  oracle::Points rest_{3, kParticles};
};

// A method of first order whose last doubling changed it by d is still d away from the solution.
TEST_F(StudySingleStrand, ReferenceIsAsFarFromTheSolutionAsItsLastChangeSays) {
  Options options;
  options.base.file = folder_ / "curl.json";
  options.axes = {parse_axis("/model/substeps=8,16")};
  options.directory = folder_ / "study";
  options.common.frames = {kLastFrame, kLastFrame};
  options.common.repeats = 1;
  const Study study = run_study(options);
  ASSERT_TRUE(study.complete);
  ASSERT_TRUE(study.reference_converged);
  EXPECT_EQ(study.reference_substeps, 256);
  EXPECT_NEAR(study.levels.back().order.value(), 1, 0.05);

  const double seconds = (kLastFrame - 1) / kRate;
  const oracle::Points solution = integrate(seconds, 4000);
  ASSERT_LT((integrate(seconds, 2000) - solution).norm(), 1e-9) << "the independent solve has converged";
  const cache::CacheReader reader(options.directory / "reference" / "256");
  const state::Frame frame = reader.read(kLastFrame);
  double squares = 0, moved = 0;
  for (int i = 0; i < kParticles; ++i) {
    const float* x = frame.position.data() + 3 * i;
    squares += (oracle::Vec3(x[0], x[1], x[2]) - solution.col(i)).squaredNorm();
    moved += (rest_.col(i) - solution.col(i)).squaredNorm();
  }
  const double error = std::sqrt(squares / kParticles), change = study.levels.back().change->rms;
  EXPECT_GT(std::sqrt(moved / kParticles), 100 * error) << "the strand has gone somewhere";
  EXPECT_NEAR(error, change, 0.1 * change);

  // The runs' orders, and that their errors are those against the solution.
  const std::vector<Order> orders = orders_of(study);
  ASSERT_EQ(orders.size(), 1u);
  EXPECT_NEAR(orders[0].orders[0], 1, 0.1);
}

}  // namespace
}  // namespace ringlet::study
