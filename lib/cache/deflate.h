// Shuffle and deflate, as HDF5's own filters undo them, at a speed that hides behind a simulation.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace ringlet::cache {

// One chunk of floats the way HDF5's shuffle filter followed by its deflate filter would store it: any HDF5
// reads it.
//
// Shuffling turns floats into four planes of bytes, and of a hair's coordinates only the plane of signs and
// exponents shrinks: the mantissas are noise, on which deflate spends nine tenths of its time for nothing. A
// zlib stream may change its level on the way, so planes whose bytes are nearly uniform go in as stored
// blocks. Deterministic.
std::vector<std::byte> shuffle_and_deflate(std::span<const float> chunk);

// The largest power of two that `quantise` may round to so that a point moves by at most `error`.
double quantisation_step(double error);

// Rounds every value to the nearest multiple of `step` (a power of two). The result is exact in float: a
// value too large for the step is a multiple of it already. Non-finite values stay what they are.
void quantise(std::span<float> values, double step);

}  // namespace ringlet::cache
