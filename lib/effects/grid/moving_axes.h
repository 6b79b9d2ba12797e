// The axes that hair's grid moves in.
#pragma once
#include "kernels/grid/grid_step.h"
#include "state/strand_model.h"

namespace ringlet::effects {

// Rigid, with the mean turn of the roots from the rest pose and through their mean place, so that they go
// with the head whatever else it does. `cell`: its edge [m]; `substep`: what the roots' motion took [s].
// Nothing of it depends on the order of the strands.
template <class T>
kernels::GridAxes moving_axes(const state::StrandModel<T>& model, const state::StrandState<T>& state,
                              double cell, double substep);

// The longest side of the strands' box in these axes [m].
template <class T>
double longest_side(const state::StrandModel<T>& model, const state::StrandState<T>& state,
                    const kernels::GridAxes& axes);

// The mean radius of the hair [m]; for a model that has radii.
template <class T>
double mean_radius(const state::StrandModel<T>& model);

}  // namespace ringlet::effects
