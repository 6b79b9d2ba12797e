// How much of the wind the hair before it lets through to each segment (Beer and Lambert): with the optical
// depth
//
//   tau = strength * integral upwind of 2 r n ds,   share = exp(-tau)
//
// where n is the length of hair in a volume [1/m^2] and r its radius, 2 r n the area that hair shows in a
// volume. The integral is taken from the middle of each tile by the tiles' mean densities, and blended
// between tiles.
#pragma once
#include "kernels/grid/transfer.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class T>
struct TileShelter {
  double upwind[3];  // unit, in the grid's axes
  double per_tile;   // strength * 2 r * edge of a tile / edge of a cell squared: depth of a tile, over its
                     // density
  T* tile_density;   // [tiles] mean of its cells
  T* tile_depth;     // [tiles] tau in its middle
};

template <class T>
RINGLET_FUNCTION T mean_density(const GridData<T>& g, std::int32_t tile) {
  T sum = T(0);
  for (int cell = 0; cell < kTileCells; ++cell)
    sum += g.node[(static_cast<std::int64_t>(tile) * kTileCells + cell) * kNodeValues + kDensity];
  return sum / T(kTileCells);
}

// From a tile's middle upwind, through each tile for as long as the way lies in it; as far as the hair goes,
// but for hair thousands of tiles away.
template <class T>
RINGLET_FUNCTION T depth_before(const GridData<T>& g, const TileShelter<T>& shelter, std::int32_t tile) {
  constexpr int kMostTiles = 1 << 11, kStride[3] = {1, 3, 9};
  if (!(shelter.per_tile > 0)) return T(0);
  std::int32_t at[3], step[3];
  double next[3], each[3];  // how far it is to the side of the next tile along each axis, and between them
  const Octet<std::int32_t> corner = tile_corner(g, tile);
  for (int c = 0; c < 3; ++c) {
    step[c] = shelter.upwind[c] < 0 ? -1 : 1;
    const double along = step[c] * shelter.upwind[c];
    at[c] = corner.v[c] / kTileEdge, each[c] = along > 1e-9 ? 1 / along : 1e9, next[c] = 0.5 * each[c];
  }
  double sum = 0, gone = 0;
  std::int32_t here = tile;
  for (int k = 0; k < kMostTiles; ++k) {
    const int axis = next[0] <= next[1] && next[0] <= next[2] ? 0 : next[1] <= next[2] ? 1 : 2;
    if (here >= 0) sum += (next[axis] - gone) * static_cast<double>(shelter.tile_density[here]);
    gone = next[axis], next[axis] += each[axis], at[axis] += step[axis];
    if (at[axis] < 0 || at[axis] >= g.extent[axis]) break;
    here = here >= 0
               ? g.near[static_cast<std::int64_t>(here) * kAround + kAround / 2 + step[axis] * kStride[axis]]
               : find_key(g.tile_key, g.tiles, key_of(at[0], at[1], at[2]));
  }
  return static_cast<T>(shelter.per_tile * sum);
}

// exp(-x) for x >= 0, by the series of a 64th of it: relative error under 1e-9 up to x = 40, where it ends.
RINGLET_FUNCTION double decay(double x) {
  const double y = -(x < 40 ? x : 40) / 64;
  double sum = 1;
  for (int k = 6; k > 0; --k) sum = 1 + sum * y / k;
  for (int k = 0; k < 6; ++k) sum *= sum;
  return sum;
}

// The depth at a place [cells], blended between the middles of the tiles about it; where there is no tile its
// own holds.
template <class T>
RINGLET_FUNCTION double depth_at(const GridData<T>& g, const TileShelter<T>& shelter, const double* place) {
  std::uint32_t own[3];
  int towards[3];  // -1 or 1: the tile beside it that is nearer
  double weight[3];
  for (int c = 0; c < 3; ++c) {
    const double tiles = place[c] / kTileEdge;
    own[c] = static_cast<std::uint32_t>(tiles);
    const double within = tiles - own[c] - 0.5;
    towards[c] = within < 0 ? -1 : 1, weight[c] = within < 0 ? -within : within;
  }
  const std::int32_t tile = find_key(g.tile_key, g.tiles, key_of(own[0], own[1], own[2]));
  if (tile < 0) return 0;
  double depth = 0;
  for (int n = 0; n < 8; ++n) {
    int around = kAround / 2;
    double share = 1;
    for (int c = 0, stride = 1; c < 3; ++c, stride *= 3) {
      if (n >> c & 1) around += towards[c] * stride;
      share *= n >> c & 1 ? weight[c] : 1 - weight[c];
    }
    // By its key: a segment's middle may lie in a tile that holds no sample, whose corners nobody has looked
    // up.
    const std::int32_t other = find_key(g.tile_key, g.tiles, key_around(g.tile_key[tile], around));
    depth += share * static_cast<double>(shelter.tile_depth[other < 0 ? tile : other]);
  }
  return depth;
}

// The share of the wind at one strand's segments.
template <class T>
RINGLET_FUNCTION void shelter_segments(const GridData<T>& g, const TileShelter<T>& shelter, T* share,
                                       int strand) {
  const int batch = strand / kLanes, lane = strand % kLanes;
  const int first = g.first_particle[strand], count = g.first_particle[strand + 1] - first;
  for (int i = 0; i + 1 < count; ++i) {
    const T *a = g.particle + static_cast<std::int64_t>(first + i) * 8, *b = a + 8;
    double middle[3];
    for (int c = 0; c < 3; ++c) middle[c] = 0.5 * (static_cast<double>(a[c]) + static_cast<double>(b[c]));
    const std::int64_t row = static_cast<std::int64_t>(g.step.batches.row[batch]) + i;
    share[row * kLanes + lane] = static_cast<T>(decay(depth_at(g, shelter, middle)));
  }
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
