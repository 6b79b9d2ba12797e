// The contacts of hair against hair as the program calls them: one table of functions for each instruction
// set.
#pragma once
#include <cstddef>

#include "kernels/backend/host.h"
#include "kernels/contact/contact_step.h"
#include "kernels/launch/launch.h"

namespace ringlet::kernels {

// The memory that an application works in, kept from one to the next.
struct HairContactMemory;

template <class T>
struct HairContactTable {
  HairContactMemory* (*make)(HostThreads threads);
  void (*destroy)(HairContactMemory* memory);
  std::size_t (*bytes)(const HairContactMemory* memory);
  // Finds what the passes look at; returns how many pairs that is.
  HairContactFigures (*begin)(HairContactMemory* memory, const HairContactStep<T>& step);
  // One pass over the state as it now is. The figures tell what it found.
  void (*pass)(HairContactMemory* memory, const HairContactStep<T>& step, HairContactFigures& figures);
};

// The table for T = float or double.
template <class T>
const HairContactTable<T>& cpu_hair_contacts(InstructionSet set);

}  // namespace ringlet::kernels
