// Which model steps the strands, with what extras: compiled once for each, chosen once a launch.
#pragma once
#include "kernels/strand/mass_spring_step.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <template <class, class> class Model, class Extra>
struct StrandModelOf {
  template <class R>
  using For = Model<Extra, R>;
};

// Calls `call` with the StrandModelOf that a step asks for.
template <class T, class Call>
void with_strand_model(const StrandStep<T>& step, const Call& call) {
  const bool air = step.air.velocity != nullptr, elongation = step.elongation.memory != nullptr;
  if (step.state.companion_position != nullptr) {
    if (air)
      call(StrandModelOf<MassSpring, Extras<true, false>>{});
    else
      call(StrandModelOf<MassSpring, Extras<false, false>>{});
  } else if (air && elongation) {
    call(StrandModelOf<AugmentedMassSpring, Extras<true, true>>{});
  } else if (air) {
    call(StrandModelOf<AugmentedMassSpring, Extras<true, false>>{});
  } else if (elongation) {
    call(StrandModelOf<AugmentedMassSpring, Extras<false, true>>{});
  } else {
    call(StrandModelOf<AugmentedMassSpring, Extras<false, false>>{});
  }
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
