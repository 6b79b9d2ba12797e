#include "effects/instruction_set.h"

#include "core/error.h"

namespace ringlet::effects {

kernels::InstructionSet choose_instruction_set(const std::string& name) {
  using kernels::InstructionSet;
  const InstructionSet best = kernels::best_instruction_set();
  if (name.empty()) return best;
  for (const InstructionSet set : {InstructionSet::kGeneric, InstructionSet::kAvx2, InstructionSet::kAvx512})
    if (set <= best && name == kernels::name_of(set)) return set;
  throw Error(ErrorKind::kUsage, "", "this processor has no instruction set `" + name + "`",
              std::string("its widest is ") + kernels::name_of(best));
}

}  // namespace ringlet::effects
