// The curve of non-Hookean integrity, as the kernels take it.
#pragma once
#include "kernels/strand/strand_batch.h"
#include "scene/scene_desc.h"

namespace ringlet::effects {

// Hooke's line up to the first of `points` [elongation, tension], then the monotone piecewise cubic through
// them all (Fritsch and Butland 1984): it starts with the line's slope 1, as far as monotony allows, never
// falls between points, and ends, with the hair's hold, at the last.
template <class T>
kernels::TensionCurve<T> tension_curve(const scene::Curve& points);

}  // namespace ringlet::effects
