// Shelter: how much of the wind reaches each segment past the head, by a depth map as seen along the wind.
//
// A cell of the map holds the depths at which the wind first meets the head (front) and last leaves it
// (rear). At depth s the wind is weakened by
//
//   strength / (1 + max(0, s - rear) / wake)  where s > front, and not at all before it,
//
// blended between the four cells round a point: behind the head the wake closes with the distance.
#pragma once
#include "kernels/backend/vector.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {

struct ShelterMap {
  double origin[3];                // the middle of the map's first cell, depth 0 [m]
  float right[3], up[3], wind[3];  // unit axes: along a row of cells, along a column, into the depth
  float per_cell;                  // 1 / size of a cell [1/m]
  std::int32_t columns, rows;
  const float* front;  // [rows][columns] [m]; infinite where the wind meets nothing
  const float* rear;   // [rows][columns] [m]
};

template <class T>
struct ShelterStep {
  StrandBatches<T> batches;
  const T* position;          // [rows][3] as StrandState
  const double* root_points;  // [batches][3] in the world [m]
  ShelterMap map;
  float strength;  // 0 to 1
  float per_wake;  // 1 / length of the wake [1/m]
  T* exposure;     // [rows] out: share of the wind that reaches the segment that begins there
};

inline namespace RINGLET_ISA {

// The weakening at depth `s` by one cell of the map; none beyond its edge.
template <class T>
RINGLET_FUNCTION float weakening(const ShelterStep<T>& step, int column, int row, float s) {
  const ShelterMap& map = step.map;
  if (column < 0 || row < 0 || column >= map.columns || row >= map.rows) return 0;
  const int cell = row * map.columns + column;
  if (!(s > map.front[cell])) return 0;
  const float behind = max(0.0f, s - map.rear[cell]);
  return step.strength / fma(behind, step.per_wake, 1.0f);
}

// The share of the wind at a point, relative to the map's origin.
template <class T>
RINGLET_FUNCTION float exposure_at(const ShelterStep<T>& step, Vector3<float> x) {
  const ShelterMap& map = step.map;
  const auto along = [&](const float* axis) { return fma(axis[2], x.z, fma(axis[1], x.y, axis[0] * x.x)); };
  const float s = along(map.wind);
  // Far away is out of the map, and no number that an int cannot hold.
  const float far = 1e6f;
  const float a = max(-far, min(far, along(map.right) * map.per_cell));
  const float b = max(-far, min(far, along(map.up) * map.per_cell));
  const int column = static_cast<int>(__builtin_floorf(a)), row = static_cast<int>(__builtin_floorf(b));
  const float p = a - static_cast<float>(column), q = b - static_cast<float>(row);
  const auto between = [&](int r) {
    const float left = weakening(step, column, r, s);
    return fma(p, weakening(step, column + 1, r, s) - left, left);
  };
  const float below = between(row);
  return 1.0f - fma(q, between(row + 1) - below, below);
}

// The exposure of the segments of one strand.
template <class T>
RINGLET_FUNCTION void shelter_strand(const ShelterStep<T>& step, int batch, int lane) {
  const std::int64_t first = step.batches.row[batch];
  const int particles = static_cast<int>(step.batches.count[batch * kLanes + lane]);
  const auto at = [&](int i, int c) {
    const double root = step.root_points[(batch * 3 + c) * kLanes + lane] - step.map.origin[c];
    return static_cast<float>(root +
                              static_cast<double>(step.position[((first + i) * 3 + c) * kLanes + lane]));
  };
  for (int i = 0; i + 1 < particles; ++i) {
    const Vector3<float> middle = {0.5f * (at(i, 0) + at(i + 1, 0)), 0.5f * (at(i, 1) + at(i + 1, 1)),
                                   0.5f * (at(i, 2) + at(i + 1, 2))};
    step.exposure[(first + i) * kLanes + lane] = static_cast<T>(exposure_at(step, middle));
  }
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
