// Between strands and nodes: samples of segments, sums onto a tile and its halo, and the way back.
#pragma once
#include "kernels/backend/vector.h"
#include "kernels/grid/grid_step.h"
#include "kernels/solid/level_set.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// ---- Strands in the grid's axes

template <class T>
RINGLET_FUNCTION Vector3<T> rotate_into(const double* rotation, const double* a) {
  const auto along = [&](int c) {
    return static_cast<T>(rotation[c] * a[0] + rotation[3 + c] * a[1] + rotation[6 + c] * a[2]);
  };
  return {along(0), along(1), along(2)};
}

// Places and velocities of one lane's particles in the grid's axes.
template <class T>
RINGLET_FUNCTION void place_strand(const GridData<T>& g, int strand) {
  const StrandBatches<T>& batches = g.step.batches;
  const GridAxes& axes = g.step.axes;
  const int batch = strand / kLanes, lane = strand % kLanes;
  const int first = g.first_particle[strand], count = g.first_particle[strand + 1] - first;
  double root[3], carried[3];  // of the root [m], velocity of the axes there [m/s]
  for (int c = 0; c < 3; ++c) root[c] = g.step.root_points[(batch * 3 + c) * kLanes + lane] - axes.origin[c];
  for (int c = 0; c < 3; ++c)
    carried[c] = axes.velocity[c] + axes.slope[3 * c] * root[0] + axes.slope[3 * c + 1] * root[1] +
                 axes.slope[3 * c + 2] * root[2];
  const Vector3<T> at_root = rotate_into<T>(axes.rotation, root);
  const T per_cell = static_cast<T>(1 / axes.cell);
  for (int i = 0; i < count; ++i) {
    const std::int64_t base = (static_cast<std::int64_t>(batches.row[batch]) + i) * 3 * kLanes + lane;
    double x[3], u[3];
    for (int c = 0; c < 3; ++c) x[c] = static_cast<double>(g.step.state.position[base + c * kLanes]);
    for (int c = 0; c < 3; ++c)
      u[c] = static_cast<double>(g.step.state.velocity[base + c * kLanes]) - carried[c] -
             (axes.slope[3 * c] * x[0] + axes.slope[3 * c + 1] * x[1] + axes.slope[3 * c + 2] * x[2]);
    const Vector3<T> place = per_cell * (at_root + rotate_into<T>(axes.rotation, x));
    const Vector3<T> velocity = rotate_into<T>(axes.rotation, u);
    T* to = g.particle + static_cast<std::int64_t>(first + i) * 8;
    to[0] = place.x, to[1] = place.y, to[2] = place.z, to[3] = T(0);
    to[4] = velocity.x, to[5] = velocity.y, to[6] = velocity.z, to[7] = T(0);
  }
}

// ---- Samples

// A sample's hair, however far a strand is torn [cells]; sums are scaled to hold it.
inline constexpr int kMostSampleLength = 2, kMostSampleMass = 2;

template <class T>
struct Segment {
  const T *a, *b;  // its particles in the grid's axes
  std::int32_t samples;
  T share_a, share_b;  // of their masses, at full weight
  T length;            // of hair at a sample [cells]

  RINGLET_FUNCTION Segment(const GridData<T>& g, std::int32_t i)
      : a(g.particle + static_cast<std::int64_t>(i) * 8),
        b(a + 8),
        samples(g.first_sample[i + 1] - g.first_sample[i]) {
    const T each = T(1) / static_cast<T>(samples);
    // Half a particle's mass is on each side of it, all of it at the strand's ends.
    share_a = g.ends[i] & kFirstOfStrand ? T(2) * each : each;
    share_b = g.ends[i + 1] & kLastOfStrand ? T(2) * each : each;
    T square = T(0);
    for (int c = 0; c < 3; ++c) square = fma(b[c] - a[c], b[c] - a[c], square);
    length = min(sqrt(square) * each, T(kMostSampleLength));
  }
  RINGLET_FUNCTION T parameter(std::int32_t sample) const {
    return (static_cast<T>(sample) + T(0.5)) / static_cast<T>(samples);
  }
  RINGLET_FUNCTION Vector3<T> place(T t) const {
    return {fma(t, b[0] - a[0], a[0]), fma(t, b[1] - a[1], a[1]), fma(t, b[2] - a[2], a[2])};
  }
};

// Beyond this many tiles from the origin there is no grid [cells]; keeps keys and conversions defined, for
// what is not a number too.
inline constexpr int kFarCells = kTileEdge << (kTileAxisBits - 2);
template <class T>
RINGLET_KERNEL std::int32_t cell_coordinate(T x) {
  const T far = static_cast<T>(kFarCells);
  return floor_to_int(min(max(x, -far), far));
}
RINGLET_KERNEL std::int32_t tile_coordinate(std::int32_t cell) { return cell >> 2; }

template <class T>
RINGLET_FUNCTION std::uint64_t tile_key_at(const GridData<T>& g, Vector3<T> x) {
  const auto along = [&](T a, int c) {
    return static_cast<std::uint32_t>(tile_coordinate(cell_coordinate(a)) - g.low[c]);
  };
  return key_of(along(x.x, 0), along(x.y, 1), along(x.z, 2));
}

// Calls visit(sample, key) for the first sample in each tile on the segment's way.
template <class T, class Visit>
RINGLET_FUNCTION void for_each_piece(const GridData<T>& g, std::int32_t i, const Visit& visit) {
  if (g.ends[i] & kLastOfStrand) return;
  const Segment<T> segment(g, i);
  std::uint64_t before = ~std::uint64_t{0};
  for (std::int32_t s = 0; s < segment.samples; ++s) {
    const std::uint64_t key = tile_key_at(g, segment.place(segment.parameter(s)));
    if (key != before) visit(s, key);
    before = key;
  }
}

// ---- Weights: along each axis, of the three cells about a place (the one it lies in is the middle one), for
// values in the cells' middles and for those on their lower faces.

template <class T>
struct AxisWeights {
  T middle[3], face[3];

  RINGLET_KERNEL explicit AxisWeights(T within) {  // the cell, 0 to 1
    const T half = T(0.5);
    middle[0] = max(half - within, T(0)), middle[2] = max(within - half, T(0));
    middle[1] = T(1) - middle[0] - middle[2];
    face[0] = T(0), face[1] = T(1) - within, face[2] = within;
  }
};

// The weights of a sample at one row of three nodes (along x), for each of a node's values.
template <class T>
struct SampleWeights {
  AxisWeights<T> x, y, z;
  int corner;  // the node below it on each axis, in the halo

  RINGLET_KERNEL SampleWeights(T fx, T fy, T fz, int at) : x(fx), y(fy), z(fz), corner(at) {}

  // Of the row's nodes in y and z, for density, then for the faces of x, y and z.
  RINGLET_KERNEL void row(int j, int k, T* w) const {
    const T middle = y.middle[j] * z.middle[k];
    w[0] = w[1] = w[2] = w[3] = middle;
    w[4] = w[5] = y.face[j] * z.middle[k];
    w[6] = w[7] = y.middle[j] * z.face[k];
  }
  // And along x.
  RINGLET_KERNEL void along(int i, T* w) const {
    for (int v = 0; v < kNodeValues; ++v) w[v] = x.middle[i];
    w[2] = w[3] = x.face[i];
  }
};

// The tiles about a tile.
template <class T>
RINGLET_FUNCTION void find_near(const GridData<T>& g, std::int32_t tile) {
  std::int32_t* near = g.near + static_cast<std::int64_t>(tile) * kAround;
  for (int n = 0; n < kAround; ++n) {
    std::uint64_t key = g.tile_key[tile];
    int place = n;
    for (int axis = 0; axis < 3; ++axis, place /= 3) {
      if (place % 3 == 0) key = key_before(key, axis);
      if (place % 3 == 2) key = key_after(key, axis);
    }
    near[n] = find_key(g.tile_key, g.tiles, key);
  }
}

// Where a place lies in a tile's halo. `tile`: coordinates of the tile.
template <class T>
RINGLET_KERNEL SampleWeights<T> weights_in_tile(const std::int32_t* tile, Vector3<T> p) {
  const std::int32_t x = cell_coordinate(p.x), y = cell_coordinate(p.y), z = cell_coordinate(p.z);
  const int i = x - kTileEdge * tile[0], j = y - kTileEdge * tile[1], k = z - kTileEdge * tile[2];
  return {p.x - static_cast<T>(x), p.y - static_cast<T>(y), p.z - static_cast<T>(z),
          (k * kHaloEdge + j) * kHaloEdge + i};
}

template <class T>
RINGLET_FUNCTION void tile_coordinates(const GridData<T>& g, std::int32_t tile, std::int32_t* at) {
  for (int c = 0; c < 3; ++c)
    at[c] = static_cast<std::int32_t>(gather_bits(g.tile_key[tile] >> c)) + g.low[c];
}

// Calls visit(node of the halo, node of the grid) for those that exist.
template <class T, class Visit>
RINGLET_FUNCTION void for_each_halo_node(const GridData<T>& g, std::int32_t tile, const Visit& visit) {
  const std::int32_t* near = g.near + static_cast<std::int64_t>(tile) * kAround;
  const auto side = [](int a) { return a == 0 ? 0 : a <= kTileEdge ? 1 : 2; };
  for (int k = 0; k < kHaloEdge; ++k)
    for (int j = 0; j < kHaloEdge; ++j)
      for (int i = 0; i < kHaloEdge; ++i) {
        const std::int32_t other = near[(side(k) * 3 + side(j)) * 3 + side(i)];
        if (other < 0) continue;
        const int cell = cell_in_tile((i - 1) & 3, (j - 1) & 3, (k - 1) & 3);
        visit((k * kHaloEdge + j) * kHaloEdge + i, static_cast<std::int64_t>(other) * kTileCells + cell);
      }
}

// Calls visit(segment's number, segment, first sample, end) for the pieces of an occupied tile.
template <class T, class Visit>
RINGLET_FUNCTION void for_each_piece_of_tile(const GridData<T>& g, std::int32_t occupied,
                                             const Visit& visit) {
  for (std::int32_t q = g.tile_piece[occupied]; q < g.tile_piece[occupied + 1]; ++q) {
    const std::uint32_t number = g.piece_of[q];
    const Piece piece = g.piece[number], next = g.piece[number + 1];
    const Segment<T> segment(g, piece.segment);
    visit(number, segment, piece, next.segment == piece.segment ? next.first : segment.samples);
  }
}

// ---- Onto the nodes

template <class T>
RINGLET_KERNEL Fixed<T> to_fixed(T a) {
  return static_cast<Fixed<T>>(a + select(a < T(0), T(-0.5), T(0.5)));
}

// The sums of one occupied tile's samples, added to its nodes and those about it. Tiles that are added at the
// same time must not be neighbours.
template <class T>
RINGLET_FUNCTION void scatter_tile(const GridData<T>& g, std::int32_t occupied) {
  const std::int32_t tile = g.occupied_tile[occupied];
  std::int32_t at[3];
  tile_coordinates(g, tile, at);
  Fixed<T> sums[kHaloNodes * kNodeValues];
  for (int n = 0; n < kHaloNodes * kNodeValues; ++n) sums[n] = 0;
  for_each_piece_of_tile(
      g, occupied, [&](std::uint32_t, const Segment<T>& segment, Piece piece, std::int32_t end) {
        const std::int32_t rest = g.first_sample[piece.segment];
        for (std::int32_t s = piece.first; s < end; ++s) {
          const T t = segment.parameter(s), a = (T(1) - t) * segment.share_a, b = t * segment.share_b;
          const SampleWeights<T> weights = weights_in_tile(at, segment.place(t));
          T value[kNodeValues] = {segment.length, segment.length * g.rest_density[rest + s]};
          for (int c = 0; c < 3; ++c) {
            value[kFaceMass + 2 * c] = a + b;
            value[kFaceMass + 2 * c + 1] = fma(a, segment.a[4 + c], b * segment.b[4 + c]);
          }
          for (int v = 0; v < kNodeValues; ++v) value[v] *= g.scale[v];
          add_sample(weights, value, sums);
        }
      });
  for_each_halo_node(g, tile, [&](int halo, std::int64_t node) {
    for (int v = 0; v < kNodeValues; ++v) g.sums[node * kNodeValues + v] += sums[halo * kNodeValues + v];
  });
}

template <class T>
RINGLET_KERNEL void add_sample(const SampleWeights<T>& weights, const T* value, Fixed<T>* sums) {
  T along[3][kNodeValues];
  for (int i = 0; i < 3; ++i) weights.along(i, along[i]);
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j) {
      T row[kNodeValues];
      weights.row(j, k, row);
      for (int v = 0; v < kNodeValues; ++v) row[v] *= value[v];
      Fixed<T>* to = sums + (weights.corner + (k * kHaloEdge + j) * kHaloEdge) * kNodeValues;
      for (int i = 0; i < 3; ++i)
        for (int v = 0; v < kNodeValues; ++v) to[i * kNodeValues + v] += to_fixed(row[v] * along[i][v]);
    }
}

// Density, target, masses and velocities of a node from its sums.
template <class T>
RINGLET_FUNCTION void finish_node(const GridData<T>& g, std::int64_t node) {
  const Fixed<T>* sums = g.sums + node * kNodeValues;
  T* to = g.node + node * kNodeValues;
  const auto value = [&](int v) { return static_cast<T>(sums[v]) / g.scale[v]; };
  const auto over = [](T a, T b) { return select(b > T(0), a, T(0)) / select(b > T(0), b, T(1)); };
  to[kDensity] = value(kDensity), to[kTarget] = over(value(kTarget), to[kDensity]);
  for (int v = kFaceMass; v < kNodeValues; v += 2) to[v] = value(v), to[v + 1] = over(value(v + 1), to[v]);
}

// ---- Back to the strands

// What a tile's samples read off the nodes, gathered to the ends of their segments: change + pic (velocity -
// own), with own the sample's velocity. Each end takes it by the share of its mass that the sample has, so
// that what nodes give away is what particles get.
template <class T>
RINGLET_FUNCTION void gather_tile(const GridData<T>& g, T pic, std::int32_t occupied) {
  const std::int32_t tile = g.occupied_tile[occupied];
  std::int32_t at[3];
  tile_coordinates(g, tile, at);
  T values[kHaloNodes * kNodeValues];
  for (int n = 0; n < kHaloNodes * kNodeValues; ++n) values[n] = T(0);
  for_each_halo_node(g, tile, [&](int halo, std::int64_t node) {
    for (int v = 0; v < kNodeValues; ++v) values[halo * kNodeValues + v] = g.node[node * kNodeValues + v];
  });
  for_each_piece_of_tile(
      g, occupied, [&](std::uint32_t number, const Segment<T>& segment, Piece piece, std::int32_t end) {
        T given[6] = {};
        for (std::int32_t s = piece.first; s < end; ++s) {
          const T t = segment.parameter(s), a = (T(1) - t) * segment.share_a, b = t * segment.share_b;
          T read[kNodeValues];
          read_sample(weights_in_tile(at, segment.place(t)), values, read);
          for (int c = 0; c < 3; ++c) {
            const T own = fma(a, segment.a[4 + c], b * segment.b[4 + c]) / (a + b);
            const T change = fma(pic, read[kFaceMass + 2 * c + 1] - own, read[kFaceMass + 2 * c]);
            given[c] = fma(a, change, given[c]), given[3 + c] = fma(b, change, given[3 + c]);
          }
        }
        for (int c = 0; c < 6; ++c) g.given_back[static_cast<std::int64_t>(number) * 6 + c] = given[c];
      });
}

template <class T>
RINGLET_KERNEL void read_sample(const SampleWeights<T>& weights, const T* values, T* read) {
  T along[3][kNodeValues];
  for (int i = 0; i < 3; ++i) weights.along(i, along[i]);
  for (int v = 0; v < kNodeValues; ++v) read[v] = T(0);
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 3; ++j) {
      T row[kNodeValues];
      weights.row(j, k, row);
      const T* from = values + (weights.corner + (k * kHaloEdge + j) * kHaloEdge) * kNodeValues;
      for (int i = 0; i < 3; ++i)
        for (int v = 0; v < kNodeValues; ++v)
          read[v] = fma(row[v] * along[i][v], from[i * kNodeValues + v], read[v]);
    }
}

// Adds `factor` times what the pieces were given to one strand's velocities, or to its positions.
template <class T>
RINGLET_FUNCTION void give_back(const GridData<T>& g, T* to, T factor, int strand) {
  const int batch = strand / kLanes, lane = strand % kLanes;
  const int first = g.first_particle[strand], count = g.first_particle[strand + 1] - first;
  for (int i = g.step.clamped; i < count; ++i) {
    T given[3] = {};
    const auto add = [&](std::int32_t segment, int end) {
      for (std::int32_t q = g.first_piece[segment]; q < g.first_piece[segment + 1]; ++q)
        for (int c = 0; c < 3; ++c) given[c] += g.given_back[static_cast<std::int64_t>(q) * 6 + 3 * end + c];
    };
    if (i > 0) add(first + i - 1, 1);
    if (i + 1 < count) add(first + i, 0);
    const std::int64_t base = (static_cast<std::int64_t>(g.step.batches.row[batch]) + i) * 3 * kLanes + lane;
    for (int c = 0; c < 3; ++c) {
      const double* r = g.step.axes.rotation + 3 * c;
      const T world =
          static_cast<T>(r[0]) * given[0] + static_cast<T>(r[1]) * given[1] + static_cast<T>(r[2]) * given[2];
      to[base + c * kLanes] = fma(factor, world, to[base + c * kLanes]);
    }
  }
}

// ---- At rest: the greatest density about each sample of an occupied tile.

template <class T>
RINGLET_FUNCTION void rest_densities(const GridData<T>& g, T least, std::int32_t occupied) {
  const std::int32_t tile = g.occupied_tile[occupied];
  std::int32_t at[3];
  tile_coordinates(g, tile, at);
  T density[kHaloNodes];
  for (int n = 0; n < kHaloNodes; ++n) density[n] = T(0);
  for_each_halo_node(
      g, tile, [&](int halo, std::int64_t node) { density[halo] = g.node[node * kNodeValues + kDensity]; });
  for_each_piece_of_tile(
      g, occupied, [&](std::uint32_t, const Segment<T>& segment, Piece piece, std::int32_t end) {
        for (std::int32_t s = piece.first; s < end; ++s) {
          const SampleWeights<T> w = weights_in_tile(at, segment.place(segment.parameter(s)));
          T greatest = least;
          for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j)
              for (int i = 0; i < 3; ++i)
                if (w.x.middle[i] > T(0) && w.y.middle[j] > T(0) && w.z.middle[k] > T(0))
                  greatest = max(greatest, density[w.corner + (k * kHaloEdge + j) * kHaloEdge + i]);
          g.rest_density[g.first_sample[piece.segment] + s] = greatest;
        }
      });
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
