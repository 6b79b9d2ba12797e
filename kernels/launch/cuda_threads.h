// Which strand a CUDA thread works on, and where its scratch is. Nothing here needs a device: the tests run
// every thread on the host.
//
// A thread takes one strand, so a warp two batches. Scratch is interleaved by the warp's width, so that its
// threads touch neighbouring words; a warp's scratch is as long as the longer of its batches needs.
#pragma once
#include <algorithm>
#include <vector>

#include "kernels/solid/response.h"
#include "kernels/strand/length_step.h"
#include "kernels/strand/strand_models.h"
#include "kernels/wind/shelter.h"
#include "kernels/wind/wind_step.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr int kWarp = 32;
inline constexpr int kBatchesPerWarp = kWarp / kLanes;
static_assert(kWarp % kLanes == 0);

// Scratch values a particle, enough for every step of a model.
inline int scratch_reals_of(const StrandBatches<float>& model) {
  return std::max({model.rest_companion ? kMassSpringReals : kStepReals, kContactReals, kLengthReals});
}

struct StrandThread {
  int batch, lane;
};
RINGLET_FUNCTION StrandThread strand_of_thread(int thread) { return {thread / kLanes, thread % kLanes}; }

// [warps + 1] where each warp's scratch begins, in particles; `row` is StrandBatches::row on the host.
inline std::vector<std::int32_t> scratch_particles(const std::int32_t* row, std::int32_t batches) {
  std::vector<std::int32_t> begin{0};
  for (std::int32_t batch = 0; batch < batches; batch += kBatchesPerWarp) {
    std::int32_t longest = 0;
    for (std::int32_t b = batch; b < std::min(batch + kBatchesPerWarp, batches); ++b)
      longest = std::max(longest, row[b + 1] - row[b]);
    begin.push_back(begin.back() + longest);
  }
  return begin;
}
RINGLET_FUNCTION std::int64_t scratch_offset(int particle, int thread, int reals) {
  return static_cast<std::int64_t>(particle) * reals * kWarp + thread % kWarp;
}

// Scratch on the device, or wherever the threads run.
struct WarpScratch {
  const std::int32_t* begin;  // scratch_particles
  float* values;
  int reals;  // scratch_reals_of the model

  RINGLET_FUNCTION float* of(int thread) const {
    return values + scratch_offset(begin[thread / kWarp], thread, reals);
  }
};

// The steps, one call a thread.
template <class Model>
struct StrandStepThread {
  StrandStep<float> step;
  WarpScratch scratch;

  RINGLET_FUNCTION void operator()(int thread) const {
    const StrandThread at = strand_of_thread(thread);
    step_strands<typename Model::template For<float>, float>(step, at.batch, at.lane, scratch.of(thread),
                                                             kWarp);
  }
};

struct ContactStepThread {
  ContactStep<float> step;
  WarpScratch scratch;

  RINGLET_FUNCTION void operator()(int thread) const {
    const StrandThread at = strand_of_thread(thread);
    collide_strands<float>(step, at.batch, at.lane, scratch.of(thread), kWarp);
  }
};

struct LengthStepThread {
  LengthStep<float> step;
  WarpScratch scratch;

  RINGLET_FUNCTION void operator()(int thread) const {
    const StrandThread at = strand_of_thread(thread);
    hold_lengths<float>(step, at.batch, at.lane, scratch.of(thread), kWarp);
  }
};

struct WindStepThread {
  WindStep<float> step;

  RINGLET_FUNCTION void operator()(int thread) const {
    const StrandThread at = strand_of_thread(thread);
    blow<float>(step, at.batch, at.lane);
  }
};

struct ShelterStepThread {
  ShelterStep<float> step;

  RINGLET_FUNCTION void operator()(int thread) const {
    const StrandThread at = strand_of_thread(thread);
    shelter_strand(step, at.batch, at.lane);
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
