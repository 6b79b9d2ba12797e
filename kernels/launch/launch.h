// The kernels as the program calls them: one table of functions for each instruction set, compiled from one
// source.
#pragma once
#include "kernels/solid/response.h"
#include "kernels/strand/length_step.h"
#include "kernels/strand/strand_batch.h"
#include "kernels/wind/shelter.h"
#include "kernels/wind/wind_step.h"

namespace ringlet::kernels {

// Each function works on batches [begin, end) and is safe to call from several threads on different batches;
// scratch must hold `scratch_reals(particles of the longest batch)` values of its own for each thread,
// 64-byte aligned.
template <class T>
struct KernelTable {
  void (*strand_step)(const StrandStep<T>& step, int begin, int end, T* scratch);
  void (*contact_step)(const ContactStep<T>& step, int begin, int end, T* scratch);
  void (*wind_step)(const WindStep<T>& step, int begin, int end, T* scratch);
  void (*shelter_step)(const ShelterStep<T>& step, int begin, int end, T* scratch);
  void (*length_step)(const LengthStep<T>& step, int begin, int end, T* scratch);
};

enum class InstructionSet { kGeneric, kAvx2, kAvx512 };

inline constexpr int kMostScratchReals = 100;  // a particle, enough for every step of every model
inline std::int64_t scratch_reals(int particles) {
  return static_cast<std::int64_t>(particles) * kLanes * kMostScratchReals;
}

// The widest set that this processor has.
InstructionSet best_instruction_set();
const char* name_of(InstructionSet set);

// The table for T = float or double.
template <class T>
const KernelTable<T>& cpu_kernels(InstructionSet set);

}  // namespace ringlet::kernels
