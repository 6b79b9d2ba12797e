// The index arithmetic of the CUDA kernels, thread by thread on the host.
#include "kernels/launch/cuda_threads.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "kernels/launch/launch.h"
#include "parity/cuda_sphere.h"
#include "parity/cuda_support.h"

namespace ringlet::cuda_testing {
namespace {

using namespace kernels;

std::vector<std::int32_t> rows_of(std::span<const std::int32_t> longest) {
  std::vector<std::int32_t> row{0};
  for (const std::int32_t particles : longest) row.push_back(row.back() + particles);
  return row;
}

// Batches of these many particles, in numbers that fill the last warp and that do not.
const std::vector<std::vector<std::int32_t>> kGrooms = {
    {}, {7}, {3, 3}, {2, 3, 64}, {1, 1, 5, 21, 21, 21, 64, 65}};

TEST(CudaThreads, EveryStrandHasOneThread) {
  for (const auto& groom : kGrooms) {
    const int batches = static_cast<int>(groom.size());
    std::set<std::pair<int, int>> seen;
    for (int thread = 0; thread < batches * kLanes; ++thread) {
      const StrandThread at = strand_of_thread(thread);
      EXPECT_TRUE(at.batch >= 0 && at.batch < batches && at.lane >= 0 && at.lane < kLanes);
      EXPECT_TRUE(seen.insert({at.batch, at.lane}).second) << "thread " << thread << " repeats a strand";
    }
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(batches) * kLanes);
  }
}

TEST(CudaThreads, ScratchIsDisjointAndFitsAndCoalesces) {
  for (const auto& groom : kGrooms) {
    const int batches = static_cast<int>(groom.size());
    const std::vector<std::int32_t> row = rows_of(groom), begin = scratch_particles(row.data(), batches);
    constexpr int kReals = 7;
    std::vector<float> values(static_cast<std::size_t>(begin.back()) * kReals * kWarp);
    const WarpScratch scratch{begin.data(), values.data(), kReals};
    std::vector<char> taken(values.size());
    for (int thread = 0; thread < batches * kLanes; ++thread) {
      const int particles = groom[strand_of_thread(thread).batch];
      const std::int64_t first = scratch.of(thread) - values.data();
      EXPECT_EQ(first % kWarp, thread % kWarp);  // a warp's threads touch 32 neighbouring words
      EXPECT_EQ(first / kWarp % kReals, 0);
      for (int k = 0; k < particles * kReals; ++k) {
        const std::size_t at = static_cast<std::size_t>(first + std::int64_t{k} * kWarp);
        ASSERT_LT(at, taken.size());
        ASSERT_FALSE(taken[at]) << "thread " << thread << " shares scratch";
        taken[at] = true;
      }
    }
  }
}

TEST(CudaThreads, ScratchOffsetsPassFourBillion) {
  constexpr int kParticles = 20'000'000;
  EXPECT_EQ(scratch_offset(kParticles, 33, 39), std::int64_t{kParticles} * 39 * 32 + 1);
}

// All threads of a launch one after the other, each with the scratch it has on the device.
template <class Thread>
void run_threads(HostGroom& groom, const Thread& make) {
  const auto& layout = groom.model.layout;
  const auto begin = scratch_particles(layout.row().data(), layout.batches());
  const int reals = scratch_reals_of(groom.model.view());
  std::vector<float> values(static_cast<std::size_t>(begin.back()) * reals * kWarp);
  const auto function = make(WarpScratch{begin.data(), values.data(), reals});
  for (int thread = 0; thread < layout.batches() * kLanes; ++thread) function(thread);
}

void expect_steps_of_the_lanes(state::StrandInput input, bool extras = false) {
  const StrandParameters<float> parameters = default_parameters();
  input.elongation = extras && !input.companions;
  HostGroom lanes(input), threads(input);
  if (extras) lanes.soften_and_blow(), threads.soften_and_blow();
  for (int k = 0; k < 10; ++k) {
    lanes.move_roots(parameters.step), threads.move_roots(parameters.step);
    lanes.step(parameters);
    const auto step = threads.strand_step(parameters);
    with_strand_model(step, [&](auto model) {
      run_threads(threads, [&](WarpScratch scratch) {
        return StrandStepThread<decltype(model)>{step, scratch};
      });
    });
  }
  EXPECT_EQ(lanes.state.position, threads.state.position);
  EXPECT_EQ(lanes.state.velocity, threads.state.velocity);
  EXPECT_EQ(lanes.state.companion_position, threads.state.companion_position);
  EXPECT_EQ(lanes.state.elongation, threads.state.elongation);
  EXPECT_EQ(lanes.strand_figures, threads.strand_figures);
  if (input.elongation) {
    const auto broken = [](float e) { return e > 0.02f; };
    EXPECT_TRUE(std::any_of(lanes.state.elongation.begin(), lanes.state.elongation.end(), broken));
  }
}

TEST(CudaThreads, StepAsTheLanesDo) {
  expect_steps_of_the_lanes(mixed_strands(70, 1));
  expect_steps_of_the_lanes(mixed_strands(70, 1), true);
}

TEST(CudaThreads, StepMassSpringStrandsAsTheLanesDo) {
  state::StrandInput input = mixed_strands(70, 1);
  input.companions = true;
  expect_steps_of_the_lanes(input);
  expect_steps_of_the_lanes(input, true);
}

TEST(CudaThreads, BlowAndShelterAsTheKernelsOfTheProcessorDo) {
  const StrandParameters<float> parameters = default_parameters();
  HostGroom groom(mixed_strands(70, 2));
  groom.move_roots(parameters.step);
  groom.step(parameters);
  const std::vector<float> front(12, 0.0f), rear(12, 0.1f);
  state::AlignedVector<float> exposure(groom.state.position.size() / 3, 1.0f), other_exposure = exposure;
  state::AlignedVector<float> air(groom.state.position.size()), other_air = air;
  ShelterStep<float> shelter{
      groom.model.view(),
      groom.state.position.data(),
      groom.state.root_points.data(),
      {{-0.1, -0.1, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 10, 4, 3, front.data(), rear.data()},
      0.9f,
      5,
      exposure.data()};
  WindStep<float> wind{
      groom.model.view(),
      groom.state.position.data(),
      groom.state.root_points.data(),
      {{1, 2, 3}, 2, {{1, 2, 0}, {0, 1, 3}}, {{2, -1, 0}, {1, 0, 0}}, {0.1f, 0.7f}, {0, 0, 0}},
      exposure.data(),
      air.data()};
  state::AlignedVector<float> through_hair(exposure.size());
  for (std::size_t k = 0; k < through_hair.size(); ++k)
    through_hair[k] = 1 / (1 + 0.01f * static_cast<float>(k));
  wind.shelter = through_hair.data();
  run_threads(groom, [&](WarpScratch) { return ShelterStepThread{shelter}; });
  run_threads(groom, [&](WarpScratch) { return WindStepThread{wind}; });
  shelter.exposure = other_exposure.data(), wind.exposure = other_exposure.data(),
  wind.air = other_air.data();
  const auto& kernels = cpu_kernels<float>(best_instruction_set());
  kernels.shelter_step(shelter, 0, groom.model.layout.batches(), nullptr);
  kernels.wind_step(wind, 0, groom.model.layout.batches(), nullptr);
  EXPECT_EQ(exposure, other_exposure);
  EXPECT_NE(std::count_if(exposure.begin(), exposure.end(), [](float e) { return e < 1; }), 0);
  if (best_instruction_set() == InstructionSet::kGeneric) GTEST_SKIP() << "no fused multiply-add here";
  const state::StrandLayout& layout = groom.model.layout;
  for (std::size_t s = 0; s < layout.strands(); ++s)
    for (int i = 0; i + 1 < layout.count(s); ++i)
      for (int c = 0; c < 3; ++c)
        EXPECT_EQ(air[layout.at(s, i, 3, c)], other_air[layout.at(s, i, 3, c)]) << s << " " << i;
}

TEST(CudaThreads, CollideAsTheLanesDo) {
  const StrandParameters<float> parameters = default_parameters();
  const Sphere sphere(0.06, 1, 0.006f);
  const std::vector<SolidView> solids{sphere.view()};
  HostGroom lanes(helices(40)), threads(helices(40));
  float touched = 0;
  for (int k = 0; k < 10; ++k) {
    lanes.move_roots(parameters.step), threads.move_roots(parameters.step);
    lanes.step(parameters), threads.step(parameters);
    lanes.collide(solids, parameters.step);
    run_threads(threads, [&](WarpScratch scratch) {
      return ContactStepThread{threads.contact_step(solids, parameters.step), scratch};
    });
    touched += lanes.contact_figures[kTouched * kLanes];
  }
  EXPECT_GT(touched, 0);
  EXPECT_EQ(lanes.state.position, threads.state.position);
  EXPECT_EQ(lanes.state.velocity, threads.state.velocity);
  EXPECT_EQ(lanes.contact_figures, threads.contact_figures);
}

TEST(CudaThreads, HoldLengthsAsTheLanesDo) {
  const StrandParameters<float> parameters = default_parameters();
  HostGroom lanes(mixed_strands(70, 3)), threads(mixed_strands(70, 3));
  lanes.move_roots(parameters.step), threads.move_roots(parameters.step);
  const auto length_step = [](HostGroom& groom, state::AlignedVector<float>& figures) {
    for (std::size_t k = 0; k < groom.state.position.size(); k += 7) groom.state.position[k] *= 1.01f;
    figures.assign(static_cast<std::size_t>(groom.model.layout.batches()) * kLengthFigures * kLanes, 0.0f);
    return LengthStep<float>{
        groom.model.view(), groom.state.view(), 1.0f / 60, 1, 8, 1e-4f, figures.data(), 1e3f, 1e3f};
  };
  state::AlignedVector<float> of_lanes, of_threads;
  const LengthStep<float> step = length_step(threads, of_threads);
  run_threads(threads, [&](WarpScratch scratch) { return LengthStepThread{step, scratch}; });
  const int longest = lanes.model.layout.longest();
  state::AlignedVector<float> scratch(static_cast<std::size_t>(scratch_reals(longest)));
  cpu_kernels<float>(best_instruction_set())
      .length_step(length_step(lanes, of_lanes), 0, lanes.model.layout.batches(), scratch.data());
  EXPECT_GT(*std::max_element(of_threads.begin(), of_threads.end()), 1) << "iterations";
  if (best_instruction_set() == InstructionSet::kGeneric) GTEST_SKIP() << "no fused multiply-add here";
  EXPECT_EQ(lanes.state.position, threads.state.position);
  EXPECT_EQ(lanes.state.velocity, threads.state.velocity);
  EXPECT_EQ(of_lanes, of_threads);
}

}  // namespace
}  // namespace ringlet::cuda_testing
