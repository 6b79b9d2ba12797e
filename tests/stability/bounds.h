// What a scenario may do, from the equations of its model, and how what it did is held against that.
//
// A step of the models is linearly implicit Euler with material damping beta, drag d and springs K (all by
// unit mass): every mode loses energy, at a rate that follows from its frequency, and one that is driven at
// resonance answers by so much more. Hair that starts bent takes no energy from nowhere, hair whose lengths
// are held stores no more than when it is folded at every particle.
#pragma once
#include "stability/scenario.h"

namespace ringlet::stability {

// Of the whole scenario; energies by unit mass, sums over all particles.
struct Bounds {
  double energy;        // [m^2/s^2]
  double strain;        // of strands that no solid moved [-]
  double moved_strain;  // of those that one did [-]
  double speed;         // [m/s]
  double rest;          // [s] after the calm; 0: it only creeps
  double last_speed;    // at the end [m/s]
};

Bounds bounds_of(const Scenario& scenario, const Outcome& outcome);

// Fails the test where the outcome is beyond a bound or has diverged; notes each figure and its bound as
// properties of the test. `seconds`: from the calm to the end; what need not be at rest by then is held to
// its last speed alone.
void hold(const Outcome& outcome, const Bounds& bounds, double seconds);

// Runs the scenario and holds it to its bounds. Skips the test where the machine is not to be had.
void hold(const Scenario& scenario);

}  // namespace ringlet::stability
