// The projection of lengths by itself: what it moves, what it keeps, whom it calls diverged.
#include <gtest/gtest.h>

#include <limits>

#include "kernels_support.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

using oracle::Points;
using oracle::State;
using oracle::Strand;

constexpr double kStep = 1.0 / 60;

template <class Machine>
class KernelLengthStep : public OnMachine<Machine> {
 protected:
  using T = typename Machine::T;

  // A strand with its particles but the clamped ones displaced by up to `size` [m] per axis, in motion.
  std::pair<Strand, State> displaced(int count, int clamped, double size) {
    const Strand strand = rounded<T>(oracle::random_strand(generator_, count, clamped).strand);
    State state{strand.rest, oracle::random_points(generator_, count, 0.5)};
    state.position.rightCols(count - clamped) += oracle::random_points(generator_, count - clamped, size);
    return {strand, state};
  }

  StrandRun<Machine> run_of(const std::vector<Strand>& strands, const std::vector<State>& states) {
    StrandRun<Machine> run(strands, std::vector<RootPose>(strands.size()), false);
    for (std::size_t k = 0; k < states.size(); ++k) run.set(k, states[k]);
    return run;
  }

  void hold(StrandRun<Machine>& run, double tolerance, int iterations = 8) {
    figures_.assign(
        static_cast<std::size_t>(run.model.layout.batches()) * kernels::kLengthFigures * kernels::kLanes,
        T(-1));
    const kernels::LengthStep<T> step{run.model.view(),
                                      run.state.view(),
                                      T(kStep),
                                      run.parameters.clamped,
                                      iterations,
                                      static_cast<T>(tolerance),
                                      figures_.data(),
                                      T(1),
                                      T(50)};
    Machine::kernels().length_step(step, 0, run.model.layout.batches(), run.scratch.data());
  }
  double figure(const StrandRun<Machine>& run, std::size_t strand, kernels::LengthFigure which) const {
    return figures_[run.model.layout.at_strand(strand, kernels::kLengthFigures, which)];
  }

  std::mt19937 generator_{11};
  state::AlignedVector<T> figures_;
};
TYPED_TEST_SUITE(KernelLengthStep, Machines, MachineNames);

TYPED_TEST(KernelLengthStep, BringsEdgesWithinTheToleranceByTheReferencesProjection) {
  for (const int count : {1, 2, 3, 15, 64})
    for (const int clamped : {0, 1, 2}) {
      if (clamped >= count) continue;
      const auto [strand, displaced] = this->displaced(count, clamped, 0.001);
      auto run = this->run_of({strand}, {displaced});
      const State begin = run.get(0);
      this->hold(run, 1e-4);
      const State end = run.get(0);
      int iterations = 0;
      const Points expected =
          oracle::project_lengths_successively(strand, begin.position, 1e-4, 8, &iterations);
      const double apart = (end.position - expected).norm(),
                   strain = oracle::worst_edge_strain(strand, end.position);
      EXPECT_TRUE(apart <= this->either(1e-13, 1e-6)) << count << " particles: " << apart << " m apart";
      EXPECT_TRUE(strain <= 1.01e-4) << count << " particles: strain " << strain;
      EXPECT_NEAR(this->figure(run, 0, kernels::kLengthStrain), strain, this->either(1e-12, 2e-6));
      EXPECT_EQ(this->figure(run, 0, kernels::kLengthIterations), iterations);
      EXPECT_EQ(this->figure(run, 0, kernels::kLengthDiverged), 0);
      EXPECT_NEAR(this->figure(run, 0, kernels::kLengthSpeed), end.velocity.colwise().norm().maxCoeff(),
                  this->either(1e-12, 1e-5));
      EXPECT_EQ((end.position - begin.position).leftCols(clamped).norm(), 0) << "a clamped particle moved";
      const double off = (end.velocity - begin.velocity - (end.position - begin.position) / kStep).norm();
      EXPECT_TRUE(off <= this->either(1e-12, 2e-4)) << "velocities are " << off << " m/s off";
    }
}

TYPED_TEST(KernelLengthStep, KeepsTheMomentumOfAFreeStrand) {
  for (const int count : {2, 3, 9, 40}) {
    const auto [strand, displaced] = this->displaced(count, 0, 0.002);
    auto run = this->run_of({strand}, {displaced});
    const State begin = run.get(0);
    this->hold(run, this->either(1e-12, 1e-5));
    const State end = run.get(0);
    EXPECT_GT((end.position - begin.position).norm(), 1e-4);
    const double drift = (end.position - begin.position).rowwise().sum().norm();
    const double push = (end.velocity - begin.velocity).rowwise().sum().norm();
    EXPECT_TRUE(drift <= this->either(1e-15, 1e-7) * count) << "sum of displacements " << drift << " m";
    EXPECT_TRUE(push <= this->either(1e-12, 1e-5) * count) << "sum of velocity changes " << push << " m/s";
  }
}

// Bit for bit, strands of all lengths side by side: those within the tolerance stay, and the others go where
// they go by themselves.
TYPED_TEST(KernelLengthStep, LeavesWhatIsWithinTheToleranceAndDoesNotMixLanes) {
  using T = typename TypeParam::T;
  std::vector<Strand> strands;
  std::vector<State> states;
  for (int k = 0; k < 37; ++k) {
    const auto [strand, displaced] = this->displaced(2 + k % 20, 1, k % 3 == 0 ? 2e-7 : 0.001);
    strands.push_back(strand), states.push_back(displaced);
  }
  auto all = this->run_of(strands, states);
  std::vector<State> begin;
  for (std::size_t k = 0; k < states.size(); ++k) begin.push_back(all.get(k));
  this->hold(all, 1e-2);
  int moved = 0;
  for (std::size_t k = 0; k < states.size(); ++k) {
    const State end = all.get(k);
    if (k % 3 == 0) {
      EXPECT_EQ(this->figure(all, k, kernels::kLengthIterations), 0) << k;
      EXPECT_TRUE(end.position == begin[k].position && end.velocity == begin[k].velocity) << k;
    }
    moved += end.position != begin[k].position;
  }
  EXPECT_GT(moved, 20);
  const state::AlignedVector<T> together = all.state.position;
  for (std::size_t k = 0; k < states.size(); ++k) {
    auto alone = this->run_of({strands[k]}, {states[k]});
    this->hold(alone, 1e-2);
    for (int i = 0; i < strands[k].size(); ++i)
      for (int c = 0; c < 3; ++c)
        EXPECT_EQ(together[all.model.layout.at(k, i, 3, c)],
                  alone.state.position[alone.model.layout.at(0, i, 3, c)])
            << "strand " << k << ", particle " << i;
  }
}

TYPED_TEST(KernelLengthStep, WithoutIterationsOnlyLooks) {
  const auto [strand, displaced] = this->displaced(12, 1, 0.001);
  auto run = this->run_of({strand}, {displaced});
  const State begin = run.get(0);
  this->hold(run, 1e-4, 0);
  EXPECT_TRUE(run.get(0).position == begin.position && run.get(0).velocity == begin.velocity);
  EXPECT_NEAR(this->figure(run, 0, kernels::kLengthStrain), oracle::worst_edge_strain(strand, begin.position),
              this->either(1e-12, 2e-5));
}

TYPED_TEST(KernelLengthStep, CallsDivergedWhatIsBeyondTheLimitsOrNotFiniteAndNothingElse) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr std::size_t kStrands = 19, kSick = 7;
  const auto expect = [&](const char* what, const auto& harm) {
    const Strand strand = oracle::make_strand(oracle::helix(), {});
    std::vector<State> states(kStrands, State{strand.rest, Points::Zero(3, strand.size())});
    harm(states[kSick]);
    auto run = this->run_of(std::vector<Strand>(kStrands, strand), states);
    this->hold(run, 1e-4);
    for (std::size_t k = 0; k < kStrands; ++k)
      EXPECT_EQ(this->figure(run, k, kernels::kLengthDiverged), k == kSick) << what << ", strand " << k;
  };
  for (const double bad : {kNaN, kInfinity, -kInfinity})
    for (const int particle : {1, 13, 29}) {
      expect("position", [&](State& s) { s.position(1, particle) = bad; });
      expect("velocity", [&](State& s) { s.velocity(2, particle) = bad; });
    }
  expect("too fast", [](State& s) { s.velocity(0, 3) = 51; });
  expect("thrown far", [](State& s) { s.position(2, 29) += 1e4; });
}

}  // namespace
}  // namespace ringlet::kernels_testing
