// Drag of the air: the step's system against a dense one, and closed forms of motion.
#include <gtest/gtest.h>

#include "kernels_support.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

// Adds what the segments' drag does to the system of `random`, every segment's drag shared by its ends by
// length.
void add_drag(const oracle::RandomStrand& random, const AirLaw& law, const Vec3& wind,
              oracle::LinearSystem& system) {
  const auto& [strand, state, step] = random;
  const int n = strand.size(), held = std::min(strand.clamped, n);
  const auto rest = [&](int s) {
    return s < 0 || s + 1 >= n ? 0.0 : (strand.rest.col(s + 1) - strand.rest.col(s)).norm();
  };
  for (int s = 0; s + 1 < n; ++s) {
    const Mat3 drag = law.of_segment(state.position.col(s + 1) - state.position.col(s),
                                     wind - 0.5 * (state.velocity.col(s) + state.velocity.col(s + 1)));
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

  // The velocity of a free straight strand along `direction` after so many steps in a wind.
  static Vec3 final_velocity(const AirLaw& law, Springs springs, const Vec3& direction, const Vec3& gravity,
                             const Vec3& wind, double h, int steps) {
    oracle::Points rest(3, 12);
    for (int i = 0; i < 12; ++i) rest.col(i) = 0.01 * i * direction;
    oracle::Strand strand = oracle::make_strand(rest, {1e4, 1e4, 1e4, 0, 0}, 1);
    for (auto* stiffness : {&strand.edge, &strand.bend, &strand.twist}) stiffness->resize(12, 1e4);
    strand.gravity = gravity, strand.clamped = 0;
    StrandRun<Machine> run({strand}, {RootPose{}}, false, springs);
    run.blow(wind, law.as<T>());
    for (int step = 1; step <= steps; ++step)  // the root travels along, so that float counts from near by
      run.step({RootPose{Mat3::Identity(), step * h * wind}}, h);
    const oracle::State end = run.get(0);
    const double bent = (end.velocity.colwise() - end.velocity.col(5)).norm();
    EXPECT_LT(bent, (OnMachine<Machine>::either(1e-6, 3e-2)));  // it stays straight
    return end.velocity.rowwise().mean();
  }
  // Where a v + b v^2 = g.
  static double terminal(const double (&law)[2], double g) {
    if (law[1] == 0) return g / law[0];
    return (-law[0] + std::sqrt(law[0] * law[0] + 4 * law[1] * g)) / (2 * law[1]);
  }
  // What the speed u relative to the air has become after a time: u' = -(a + b u) u.
  static double decayed(const double (&law)[2], double u, double time) {
    const double linear = law[0] > 0 ? -std::expm1(-law[0] * time) / law[0] : time;
    return u * std::exp(-law[0] * time) / (1 + law[1] * u * linear);
  }
};
TYPED_TEST_SUITE(KernelAirDrag, Machines, MachineNames);

// The air's velocity plus the terminal velocities across and along the strand, each by its own law.
TYPED_TEST(KernelAirDrag, FallsAtTheTerminalVelocity) {
  constexpr AirLaw kLinear{{46, 0}, {22, 0}}, kQuadratic{{0, 60}, {0, 30}};
  const Vec3 gravity(0, -9.81, 0), calm = Vec3::Zero(), wind(3, -1, 2);
  const std::pair<AirLaw, Vec3> airs[] = {
      {kLinear, calm}, {kLinear, wind}, {kQuadratic, calm}, {kHairInAir, calm}, {kHairInAir, wind}};
  for (const Springs springs : {Springs::kAms, Springs::kMassSpring})
    for (const auto& [law, air] : airs)
      for (const Vec3& along : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0.6, -0.8, 0)}) {
        const Vec3 pull = along.dot(gravity) * along, push = gravity - pull;
        const Vec3 expected = air + this->terminal(law.tangential, pull.norm()) * pull.normalized() +
                              this->terminal(law.normal, push.norm()) * push.normalized();
        // Straight hair that falls is unsteady, as a leaf is, and quadratic drag is quick: stop in time.
        const int steps = law.normal[0] > 0 ? 300 : 150;
        const Vec3 fallen = this->final_velocity(law, springs, along, gravity, air, 1.0 / 240, steps);
        EXPECT_LT((fallen - expected).norm(), this->either(1e-8, 3e-4))
            << "along " << along.transpose() << " in " << air.transpose();
      }
}

TYPED_TEST(KernelAirDrag, IsCarriedAtTheSpeedOfAUniformWind) {
  const Vec3 wind(3, -1, 2), along = Vec3(1, 2, 3).normalized();
  const Vec3 carried =
      this->final_velocity(kHairInAir, Springs::kAms, along, Vec3::Zero(), wind, 1.0 / 240, 300);
  EXPECT_LT((carried - wind).norm(), this->either(1e-8, 3e-5));
}

// The speed relative to the air decays by its law: at first order in the step, and of a purely quadratic law
// exactly, since 1 / u grows by h b in a step.
TYPED_TEST(KernelAirDrag, SpeedRelativeToTheAirDecaysByTheLaw) {
  constexpr AirLaw kLinear{{46, 0}, {22, 0}}, kQuadratic{{0, 60}, {0, 30}};
  constexpr double kTime = 0.05, kSpeed = 3;  // [s], [m/s]
  for (const Springs springs : {Springs::kAms, Springs::kMassSpring})
    for (const AirLaw& law : {kLinear, kQuadratic, kHairInAir})
      for (const bool across : {true, false}) {
        const Vec3 wind(0, 0, kSpeed), along = across ? Vec3::UnitX() : Vec3::UnitZ();
        const auto& its = across ? law.normal : law.tangential;
        double error[3];
        for (int k = 0; k < 3; ++k) {
          const int steps = 12 << k;
          const Vec3 moved =
              this->final_velocity(law, springs, along, Vec3::Zero(), wind, kTime / steps, steps);
          error[k] = (wind - moved - this->decayed(its, kSpeed, kTime) * wind.normalized()).norm();
        }
        if (its[0] == 0) {
          EXPECT_LT(error[0], this->either(1e-12, 1e-5));
        } else {
          EXPECT_LT(error[0], 0.1);
          EXPECT_NEAR(error[0] / error[1], 2, 0.2);
          EXPECT_NEAR(error[1] / error[2], 2, 0.1);
        }
      }
}

TYPED_TEST(KernelAirDrag, NeverOutrunsTheWindHoweverLongTheStep) {
  for (const double h : {1e-3, 0.1, 1.0, 100.0})
    for (const double speed : {1.0, 300.0}) {
      const Vec3 once =
          this->final_velocity(kHairInAir, Springs::kAms, Vec3::UnitX(), Vec3::Zero(), {0, 0, speed}, h, 1);
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
    run.blow(wind, kHairInAir.as<typename TypeParam::T>());
    oracle::LinearSystem system = assemble(random.strand, random.state, random.step);
    add_drag(random, kHairInAir, wind, system);
    run.step({random.step.after}, random.step.h);
    const int held = std::min(random.strand.clamped, count);
    const Eigen::VectorXd solution = run.get(0).velocity.rightCols(count - held).reshaped();
    const double backward = oracle::backward_error(system, solution);
    EXPECT_TRUE(backward <= this->either(1e-13, 2e-6)) << count << " particles: " << backward;
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
