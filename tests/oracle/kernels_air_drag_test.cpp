// Drag of the air: the step's system against a dense one, and closed forms of motion.
#include <gtest/gtest.h>

#include "kernels_support.h"
#include "oracle/helix.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

// Over the linear density: normal and tangential, linear [1/s] and quadratic [1/m].
struct Law {
  double normal[2], tangential[2];
};
constexpr Law kHair = {{46, 9.6}, {22, 0.1}};

template <class T>
kernels::Air<T> air(const Law& law) {
  kernels::Air<T> air{};
  for (int k = 0; k < 2; ++k)
    air.normal[k] = static_cast<T>(law.normal[k]), air.tangential[k] = static_cast<T>(law.tangential[k]);
  return air;
}

// Adds what the segments' drag does to the system of `random`, every segment's drag shared by its ends by
// length.
void add_drag(const oracle::RandomStrand& random, const Law& law, const Vec3& wind,
              oracle::LinearSystem& system) {
  const auto& [strand, state, step] = random;
  const int n = strand.size(), held = std::min(strand.clamped, n);
  const auto rest = [&](int s) {
    return s < 0 || s + 1 >= n ? 0.0 : (strand.rest.col(s + 1) - strand.rest.col(s)).norm();
  };
  for (int s = 0; s + 1 < n; ++s) {
    const Vec3 t = (state.position.col(s + 1) - state.position.col(s)).normalized();
    const Vec3 u = wind - 0.5 * (state.velocity.col(s) + state.velocity.col(s + 1));
    const Mat3 along = t * t.transpose(), across = Mat3::Identity() - along;
    const Mat3 drag = (law.tangential[0] + law.tangential[1] * (along * u).norm()) * along +
                      (law.normal[0] + law.normal[1] * (across * u).norm()) * across;
    for (const int i : {s, s + 1}) {
      if (i < held) continue;
      const double share = rest(s) / (rest(i - 1) + rest(i));
      system.matrix.block<3, 3>(3 * (i - held), 3 * (i - held)) += step.h * share * drag;
      system.rhs.segment<3>(3 * (i - held)) += step.h * share * drag * wind;
    }
  }
}

template <class Machine>
class KernelAirDrag : public OnMachine<Machine> {
 protected:
  using T = typename Machine::T;

  // A free straight strand along `direction`, without springs that matter, in a wind.
  static Vec3 final_velocity(const Vec3& direction, const Vec3& gravity, const Vec3& wind, double h,
                             int steps) {
    oracle::Points rest(3, 12);
    for (int i = 0; i < 12; ++i) rest.col(i) = 0.01 * i * direction;
    oracle::Strand strand = oracle::make_strand(rest, {1e6, 1e6, 1e6, 0, 0}, 1);
    strand.gravity = gravity, strand.clamped = 0;
    StrandRun<Machine> run({strand}, {RootPose{}}, false);
    run.blow(wind, air<T>(kHair));
    for (int step = 0; step < steps; ++step) run.step({RootPose{}}, h);
    const oracle::State end = run.get(0);
    EXPECT_TRUE((end.velocity.colwise() - end.velocity.col(5)).norm() < 1e-3);  // it stays straight
    return end.velocity.col(5);
  }
  // Where a v + b v^2 = g.
  static double terminal(const double (&law)[2], double g) {
    return (-law[0] + std::sqrt(law[0] * law[0] + 4 * law[1] * g)) / (2 * law[1]);
  }
};
TYPED_TEST_SUITE(KernelAirDrag, Machines, MachineNames);

TYPED_TEST(KernelAirDrag, FallsAtTheTerminalVelocity) {
  const double g = 9.81;
  const double across = this->final_velocity(Vec3::UnitX(), {0, -g, 0}, Vec3::Zero(), 1.0 / 240, 300).y();
  EXPECT_NEAR(across, -this->terminal(kHair.normal, g), this->either(1e-10, 2e-5));
  const double along = this->final_velocity(Vec3::UnitY(), {0, -g, 0}, Vec3::Zero(), 1.0 / 240, 300).y();
  EXPECT_NEAR(along, -this->terminal(kHair.tangential, g), this->either(1e-10, 2e-5));
}

TYPED_TEST(KernelAirDrag, IsCarriedAtTheSpeedOfAUniformWind) {
  const Vec3 wind(3, -1, 2), g(0, -9.81, 0);
  const Vec3 freed = this->final_velocity(Vec3(1, 2, 3).normalized(), Vec3::Zero(), wind, 1.0 / 240, 300);
  // 4 m from its root float positions round by 2.4e-7 m, and the lengths win that back in one step.
  EXPECT_LT((freed - wind).norm(), this->either(1e-6, 1e-4));
  const Vec3 fallen =
      this->final_velocity(Vec3::UnitX(), g, wind, 1.0 / 240, 300);  // falls through moving air
  EXPECT_NEAR(fallen.y() - wind.y(), -this->terminal(kHair.normal, 9.81), this->either(1e-9, 3e-5));
}

TYPED_TEST(KernelAirDrag, NeverOutrunsTheWindHoweverLongTheStep) {
  for (const double h : {1e-3, 0.1, 1.0, 100.0})
    for (const double speed : {1.0, 300.0}) {
      const Vec3 once = this->final_velocity(Vec3::UnitX(), Vec3::Zero(), {0, 0, speed}, h, 1);
      EXPECT_TRUE(once.z() > 0 && once.z() <= speed * (1 + this->either(1e-12, 1e-6))) << once.z();
    }
}

TYPED_TEST(KernelAirDrag, SolvesTheReferencesSystem) {
  std::mt19937 generator(6);
  for (int count = 1; count <= 40; ++count) {
    oracle::RandomStrand random = oracle::random_strand(generator, count, count % 3);
    random.strand = rounded<typename TypeParam::T>(random.strand);
    random.strand.preload.setZero();
    oracle::preload_gravity(random.strand, random.step.before);
    StrandRun<TypeParam> run({random.strand}, {random.step.before}, true);
    run.set(0, random.state);
    random.state = run.get(0);
    random.step.h = static_cast<typename TypeParam::T>(random.step.h);
    const Vec3 wind(4, 0.5, -2);
    run.blow(wind, air<typename TypeParam::T>(kHair));
    oracle::LinearSystem system = assemble(random.strand, random.state, random.step);
    add_drag(random, kHair, wind, system);
    run.step({random.step.after}, random.step.h);
    const int held = std::min(random.strand.clamped, count);
    const Eigen::VectorXd solution = run.get(0).velocity.rightCols(count - held).reshaped();
    const double backward = oracle::backward_error(system, solution);
    EXPECT_TRUE(backward <= this->either(1e-13, 2e-6)) << count << " particles: " << backward;
  }
}

// Still air only takes energy away.
TYPED_TEST(KernelAirDrag, StillAirDamps) {
  oracle::Strand strand = oracle::helix_strand({});
  double energy[2];
  for (int with = 0; with < 2; ++with) {
    StrandRun<TypeParam> run({strand}, {RootPose{}}, true);
    oracle::State start = oracle::rest_state(strand);
    start.velocity.row(2).setConstant(1);
    run.set(0, start);
    if (with) run.blow(Vec3::Zero(), air<typename TypeParam::T>(kHair));
    for (int step = 0; step < 24; ++step) run.step({RootPose{}}, 1.0 / 240);
    energy[with] = run.get(0).velocity.squaredNorm();
  }
  EXPECT_LT(energy[1], 0.1 * energy[0]);
  EXPECT_GT(energy[1], 0);
}

}  // namespace
}  // namespace ringlet::kernels_testing
