// Which instruction set of the CPU the kernels run with.
#pragma once
#include <string>

#include "kernels/launch/launch.h"

namespace ringlet::effects {

// `name`: avx512, avx2 or generic; empty: the widest this processor has. Throws Error{kUsage} for one it has
// not.
kernels::InstructionSet choose_instruction_set(const std::string& name);

}  // namespace ringlet::effects
