// Between strands and nodes: samples of segments, sums onto a tile and its halo, and the way back.
#pragma once
#include "kernels/backend/octet.h"
#include "kernels/backend/vector.h"
#include "kernels/grid/grid_step.h"
#include "kernels/grid/halo.h"
#include "kernels/solid/level_set.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Beyond this many cells from the origin there is no grid.
inline constexpr int kFarCells = kTileEdge << (kTileAxisBits - 2);

// ---- Strands in the grid's axes

template <class T>
RINGLET_FUNCTION Vector3<T> rotate_into(const double* rotation, const double* a) {
  const auto along = [&](int c) {
    return static_cast<T>(rotation[c] * a[0] + rotation[3 + c] * a[1] + rotation[6 + c] * a[2]);
  };
  return {along(0), along(1), along(2)};
}

// Places and velocities of one lane's particles in the grid's axes, and what they reach, from the axes'
// origin; `shift_particle` takes the places from the lowest tile's corner.
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
  const T per_cell = static_cast<T>(1 / axes.cell), far = static_cast<T>(kFarCells);
  StrandReach<T> reach{{far, far, far}, {-far, -far, -far}, T(0)};
  for (int i = 0; i < count; ++i) {
    const std::int64_t base = (static_cast<std::int64_t>(batches.row[batch]) + i) * 3 * kLanes + lane;
    double x[3], u[3];
    for (int c = 0; c < 3; ++c) x[c] = static_cast<double>(g.step.state.position[base + c * kLanes]);
    for (int c = 0; c < 3; ++c)
      u[c] = static_cast<double>(g.step.state.velocity[base + c * kLanes]) - carried[c] -
             (axes.slope[3 * c] * x[0] + axes.slope[3 * c + 1] * x[1] + axes.slope[3 * c + 2] * x[2]);
    const Vector3<T> place = per_cell * (at_root + rotate_into<T>(axes.rotation, x));
    // What is not a number lies at the far end too, and keeps conversions defined.
    const auto bounded = [&](T a) { return min(max(-far, a), far); };
    const Vector3<T> velocity = rotate_into<T>(axes.rotation, u);
    T* to = g.particle + static_cast<std::int64_t>(first + i) * 8;
    to[0] = bounded(place.x), to[1] = bounded(place.y), to[2] = bounded(place.z);
    to[3] = velocity.x, to[4] = T(0), to[5] = velocity.y, to[6] = T(0), to[7] = velocity.z;
    for (int c = 0; c < 3; ++c)
      reach.low[c] = min(reach.low[c], to[c]), reach.high[c] = max(reach.high[c], to[c]);
    const T speed = max(abs(velocity.x), max(abs(velocity.y), abs(velocity.z)));
    reach.speed = speed > reach.speed ? speed : reach.speed;  // no number does not count
  }
  g.reach[strand] = reach;
}

template <class T>
RINGLET_FUNCTION void shift_particle(const GridData<T>& g, int i) {
  T* place = g.particle + static_cast<std::int64_t>(i) * 8;
  for (int c = 0; c < 3; ++c) place[c] -= static_cast<T>(kTileEdge * g.low[c]);
}

// ---- Samples

// A sample's hair, however far a strand is torn [cells]; sums are scaled to hold it.
inline constexpr int kMostSampleLength = 2, kMostSampleMass = 2;

// Where a particle has its velocity, and a node its momentum.
inline constexpr int kMomenta = 1 << 3 | 1 << 5 | 1 << 7;

template <class T>
struct Segment {
  Octet<T> a, b;       // its particles in the grid's axes
  Octet<T> from, way;  // place of the first, and from it to the second, in both halves
  std::int32_t samples;
  T each;              // 1 / samples
  T share_a, share_b;  // of their masses, at full weight

  RINGLET_KERNEL Segment(const GridData<T>& g, std::int32_t particle, std::int32_t n, std::int32_t ends)
      : a(Octet<T>::load(g.particle + static_cast<std::int64_t>(particle) * 8)),
        b(Octet<T>::load(g.particle + static_cast<std::int64_t>(particle) * 8 + 8)),
        from(first_half(a)),
        way(first_half(b - a)),
        samples(n),
        each(T(1) / static_cast<T>(n)) {
    // Half a particle's mass is on each side of it, all of it at the strand's ends.
    share_a = ends & kFirstOfStrand ? T(2) * each : each;
    share_b = ends & kLastOfStrand ? T(2) * each : each;
  }
  // Of hair at a sample [cells]
  RINGLET_FUNCTION T sample_length() const {
    T square = T(0);
    for (int c = 0; c < 3; ++c) square = fma(b.v[c] - a.v[c], b.v[c] - a.v[c], square);
    return min(sqrt(square) * each, T(kMostSampleLength));
  }
  RINGLET_FUNCTION T parameter(std::int32_t sample) const { return (static_cast<T>(sample) + T(0.5)) * each; }
  RINGLET_FUNCTION Octet<T> place(T t) const { return from + Octet<T>(t) * way; }
};

// Where eight samples of a segment lie, from the one numbered `first` on.
template <class T>
struct SampleTiles {
  Octet<std::int32_t> x, y, z;          // their tiles
  alignas(32) std::int32_t nearest[8];  // tile about it, itself included, that the sample is nearest to

  RINGLET_KERNEL SampleTiles(const Segment<T>& segment, std::int32_t first) {
    Octet<T> t;
    RINGLET_UNROLL
    for (int k = 0; k < 8; ++k) t.v[k] = segment.parameter(first + k);
    const auto along = [&](const Octet<T>& a, const Octet<T>& way, Octet<std::int32_t>& tile) {
      const Octet<std::int32_t> at = truncated(a + t * way), within = at & Octet<std::int32_t>(kTileEdge - 1);
      tile = at >> 2;
      return (within + Octet<std::int32_t>(1)) >> 1;  // 0, 1 or 2: before the tile, in it, after it
    };
    const Octet<T>&a = segment.from, &way = segment.way;
    const Octet<std::int32_t> near_x = along(spread<0>(a), spread<0>(way), x);
    const Octet<std::int32_t> near_y = along(spread<1>(a), spread<1>(way), y);
    const Octet<std::int32_t> near_z = along(spread<2>(a), spread<2>(way), z);
    const Octet<std::int32_t> three(3);
    (near_x + three * (near_y + three * near_z)).store(nearest);
  }
  // The first `samples` of them that lie in another tile than the one before, a bit for each; the one before
  // the first is the last of `before`.
  RINGLET_KERNEL std::uint32_t starts(const SampleTiles& before, std::int32_t samples) const {
    const auto other = [](const Octet<std::int32_t>& a, const Octet<std::int32_t>& b) {
      return a ^ shuffled<7, 8, 9, 10, 11, 12, 13, 14>(b, a);
    };
    return not_zero(other(x, before.x) | other(y, before.y) | other(z, before.z)) & ((1u << samples) - 1);
  }
};

// Calls visit(tiles, first, samples, starts) for each eight samples of a segment, or what is left of them:
// `starts` has the bits of those that a piece begins with.
template <class T, class Visit>
RINGLET_FUNCTION void for_each_eight(const Segment<T>& segment, const Visit& visit) {
  const auto samples = [&](std::int32_t first) {
    const std::int32_t left = segment.samples - first;
    return left < 8 ? left : 8;
  };
  SampleTiles<T> tiles(segment, 0);
  visit(tiles, 0, samples(0), tiles.starts(tiles, samples(0)) | 1);
  for (std::int32_t first = 8; first < segment.samples; first += 8) {
    const SampleTiles<T> before = tiles;
    tiles = SampleTiles<T>(segment, first);
    visit(tiles, first, samples(first), tiles.starts(before, samples(first)));
  }
}

template <class T>
RINGLET_FUNCTION std::int32_t count_pieces(const GridData<T>& g, std::int32_t i) {
  if (g.ends[i] & kLastOfStrand) return 0;
  std::int32_t pieces = 0;
  for_each_eight(Segment<T>(g, i, g.first_sample[i + 1] - g.first_sample[i], 0),
                 [&](const SampleTiles<T>&, std::int32_t, std::int32_t, std::uint32_t starts) {
                   pieces += ones(starts);
                 });
  return pieces;
}

// Calls visit(piece, tile's x, y, z) for each piece of a segment.
template <class T, class Visit>
RINGLET_FUNCTION void for_each_piece(const GridData<T>& g, std::int32_t i, const Visit& visit) {
  if (g.ends[i] & kLastOfStrand) return;
  const std::int32_t rest = g.first_sample[i], samples = g.first_sample[i + 1] - rest;
  Piece piece{i,
              g.first_piece[i] - 1,
              0,
              0,
              samples,
              rest,
              (g.ends[i] & kFirstOfStrand) | (g.ends[i + 1] & kLastOfStrand),
              0};
  std::int32_t x = 0, y = 0, z = 0;
  for_each_eight(Segment<T>(g, i, samples, 0), [&](const SampleTiles<T>& tiles, std::int32_t first,
                                                   std::int32_t count, std::uint32_t starts) {
    for (std::int32_t k = 0; k < count; ++k) {
      if (starts >> k & 1) {
        if (first + k > 0) visit(piece, x, y, z);
        ++piece.number, piece.first = first + k, piece.rest = rest + first + k, piece.reached = 0;
        x = tiles.x.v[k], y = tiles.y.v[k], z = tiles.z.v[k];
      }
      piece.reached |= 1u << tiles.nearest[k], piece.end = first + k + 1;
    }
  });
  visit(piece, x, y, z);
}

// ---- Tiles

// A tile's lowest corner, from the lowest tile's [cells], in both halves.
template <class T>
RINGLET_FUNCTION Octet<std::int32_t> tile_corner(const GridData<T>& g, std::int32_t tile) {
  Octet<std::int32_t> corner(0);
  for (int c = 0; c < 3; ++c)
    corner.v[c] = corner.v[c + 4] = kTileEdge * static_cast<std::int32_t>(gather_bits(g.tile_key[tile] >> c));
  return corner;
}

inline constexpr std::uint64_t kAllRows = (std::uint64_t{1} << kHaloEdge * kHaloEdge) - 1;

// The grid's nodes that a row of the halo's along x are, -1: none.
struct HaloRow {
  std::int64_t node[kHaloEdge];
};

// Calls visit(y, z, row) for the halo's rows along x whose bits are set.
template <class T, class Visit>
RINGLET_FUNCTION void for_each_halo_row(const GridData<T>& g, std::int32_t tile, std::uint64_t rows,
                                        const Visit& visit) {
  const std::int32_t* near = g.near + static_cast<std::int64_t>(tile) * kAround;
  const auto side = [](int a) { return a == 0 ? 0 : a <= kTileEdge ? 1 : 2; };
  for (int z = 0; z < kHaloEdge; ++z)
    for (int y = 0; y < kHaloEdge; ++y) {
      if (!(rows >> (z * kHaloEdge + y) & 1)) continue;
      const std::int32_t* tiles = near + (side(z) * 3 + side(y)) * 3;
      const int cells = cell_in_tile(0, (y - 1) & 3, (z - 1) & 3);
      HaloRow row;
      RINGLET_UNROLL
      for (int x = 0; x < kHaloEdge; ++x) {
        const std::int64_t other = tiles[side(x)];
        row.node[x] = other < 0 ? -1 : other * kTileCells + (cells | cell_in_tile((x - 1) & 3, 0, 0));
      }
      visit(y, z, row);
    }
}

// Calls visit(piece, segment) for the pieces of an occupied tile.
template <class T, class Visit>
RINGLET_FUNCTION void for_each_piece_of_tile(const GridData<T>& g, std::int32_t occupied,
                                             const Visit& visit) {
  for (std::int32_t q = g.tile_piece[occupied]; q < g.tile_piece[occupied + 1]; ++q) {
    constexpr int kAhead = 8;  // particles lie anywhere: they are on their way when their turn comes
    if (q + kAhead < g.pieces) {
      const Piece& later = g.tile_pieces[q + kAhead];
      prefetch(g.particle + static_cast<std::int64_t>(later.segment) * 8);
      prefetch(g.particle + static_cast<std::int64_t>(later.segment) * 8 + 15);
      prefetch(g.rest_density + later.rest);
    }
    const Piece piece = g.tile_pieces[q];
    visit(piece, Segment<T>(g, piece.segment, piece.samples, piece.ends));
  }
}

// The key of the n-th tile about a tile.
RINGLET_FUNCTION std::uint64_t key_around(std::uint64_t key, int n) {
  for (int axis = 0; axis < 3; ++axis, n /= 3) {
    if (n % 3 == 0) key = key_before(key, axis);
    if (n % 3 == 2) key = key_after(key, axis);
  }
  return key;
}

// Lays the pieces of an occupied tile one after the other. Returns which of the tiles about it their samples
// reach, a bit for each: those beside the cells that they lie in.
template <class T>
RINGLET_FUNCTION std::uint32_t collect_pieces(const GridData<T>& g, std::int32_t occupied) {
  std::uint32_t reached = 0;
  for (std::int32_t q = g.tile_piece[occupied]; q < g.tile_piece[occupied + 1]; ++q) {
    constexpr int kAhead = 16;
    if (q + kAhead < g.pieces) prefetch(g.piece + g.piece_of[q + kAhead]);
    g.tile_pieces[q] = g.piece[g.piece_of[q]];
    reached |= g.tile_pieces[q].reached;
  }
  // What reaches a corner reaches its edges and faces.
  for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= 3)
    for (int n = 0; n < kAround; ++n)
      if (n / stride % 3 != 1 && (reached >> n & 1)) reached |= 1u << (n + stride * (1 - n / stride % 3));
  return reached;
}

// The tiles across a tile's faces.
template <class T>
RINGLET_FUNCTION void find_near(const GridData<T>& g, std::int32_t tile) {
  std::int32_t* near = g.near + static_cast<std::int64_t>(tile) * kAround + kAround / 2;
  near[0] = tile;
  for (int axis = 0, stride = 1; axis < 3; ++axis, stride *= 3) {
    near[-stride] = find_key(g.tile_key, g.tiles, key_before(g.tile_key[tile], axis));
    near[stride] = find_key(g.tile_key, g.tiles, key_after(g.tile_key[tile], axis));
  }
}

// Those across an occupied tile's edges, then its corners: by way of the one before where there is one.
template <class T>
RINGLET_FUNCTION void find_around(const GridData<T>& g, std::int32_t occupied) {
  const std::int32_t own = g.occupied_tile[occupied];
  std::int32_t* near = g.near + static_cast<std::int64_t>(own) * kAround;
  for (int aside = 2; aside <= 3; ++aside)
    for (int n = 0; n < kAround; ++n) {
      const int x = n % 3, y = n / 3 % 3, z = n / 9;
      if ((x != 1) + (y != 1) + (z != 1) != aside) continue;
      const int stride = z != 1 ? 9 : 3, side = z != 1 ? z - 1 : y - 1;
      const std::int32_t beside = near[n - stride * side];
      near[n] = beside >= 0
                    ? g.near[static_cast<std::int64_t>(beside) * kAround + kAround / 2 + stride * side]
                    : find_key(g.tile_key, g.tiles, key_around(g.tile_key[own], n));
    }
}

// ---- Onto the nodes

// Where a node's values are, while they are sums.
template <class T>
RINGLET_KERNEL Fixed<T>* sums_of(const GridData<T>& g, std::int64_t node) {
  static_assert(sizeof(Fixed<T>) == sizeof(T));
  return reinterpret_cast<Fixed<T>*>(g.node + node * kNodeValues);
}

// The sums of one occupied tile's samples, added to its nodes and those about it. Tiles that are added at the
// same time must not be neighbours.
template <class T>
RINGLET_FUNCTION void scatter_tile(const GridData<T>& g, std::int32_t occupied) {
  const std::int32_t tile = g.occupied_tile[occupied];
  const Octet<std::int32_t> corner = tile_corner(g, tile);
  const Octet<T> scale = Octet<T>::load(g.scale);
  alignas(64) Fixed<T> blocks[kSumBlocks];
  for (int n = 0; n < kSumBlocks; ++n) blocks[n] = 0;
  std::uint64_t rows = 0;
  for_each_piece_of_tile(g, occupied, [&](const Piece& piece, const Segment<T>& segment) {
    const T* rest = g.rest_density + (piece.rest - piece.first);
    const Octet<T> one(T(1)), length(segment.sample_length());
    const Octet<T> first = choose<kMomenta>(segment.a, one), second = choose<kMomenta>(segment.b, one);
    for (std::int32_t s = piece.first; s < piece.end; ++s) {
      const T t = segment.parameter(s), a = (T(1) - t) * segment.share_a, b = t * segment.share_b;
      const Octet<T> hair = length * choose<1 << kTarget>(Octet<T>(rest[s]), one);
      const Octet<T> moved = Octet<T>(a) * first + Octet<T>(b) * second;
      const Octet<T> value = choose<1 << kDensity | 1 << kTarget>(hair, moved);
      const SampleWeights<T> weights(corner, segment.place(t));
      add_sample(weights, value * scale, blocks), rows |= weights.rows();
    }
  });
  g.rows[occupied] = rows;
  for_each_halo_row(g, tile, rows, [&](int y, int z, const HaloRow& row) {
    alignas(64) Fixed<T> merged[kHaloEdge * kNodeValues];
    merge_row<T>(blocks, y, z, merged);
    RINGLET_UNROLL
    for (int x = 0; x < kHaloEdge; ++x) {
      if (row.node[x] < 0) continue;
      Fixed<T>* to = sums_of(g, row.node[x]);
      (Octet<Fixed<T>>::load(to) + Octet<Fixed<T>>::load(merged + x * kNodeValues)).store(to);
    }
  });
}

// Density, target, masses and velocities of a tile's nodes from their sums. Most nodes of most tiles have no
// hair: nothing, as a sum and as a value.
template <class T>
RINGLET_FUNCTION void finish_tile(const GridData<T>& g, std::int32_t tile) {
  Octet<T> unit;
  for (int v = 0; v < kNodeValues; ++v) unit.v[v] = T(1) / g.scale[v];
  const auto over = [](T a, T b) { return b > T(0) ? a / b : T(0); };
  for (int cell = 0; cell < kTileCells; ++cell) {
    const std::int64_t node = static_cast<std::int64_t>(tile) * kTileCells + cell;
    const Fixed<T>* sums = sums_of(g, node);
    Fixed<T> hair = 0;
    for (int v = 0; v < kNodeValues; ++v) hair |= sums[v];
    if (hair == 0) continue;
    Octet<T> value = to_real<T>(Octet<Fixed<T>>::load(sums)) * unit;
    value.v[kTarget] = over(value.v[kTarget], value.v[kDensity]);
    for (int v = kFaceMass; v < kNodeValues; v += 2) value.v[v + 1] = over(value.v[v + 1], value.v[v]);
    value.store(g.node + node * kNodeValues);
  }
}

// ---- Back to the strands

// What a piece gives back: the change of velocity of its segment's first particle, then of its second, x, y,
// z in each half; where positions were corrected their displacement follows.
template <class T>
RINGLET_KERNEL T* given_back_by(const GridData<T>& g, std::int32_t piece) {
  return g.given_back + static_cast<std::int64_t>(piece) * (g.moved ? 2 : 1) * 8;
}

// What a tile's samples read off the nodes, gathered to the ends of their segments: of velocities change +
// pic (velocity - own), own the sample's, and of places the displacement. Each end takes it by the share of
// its mass that the sample has, so that what nodes give away is what particles get.
template <class T>
RINGLET_FUNCTION void gather_tile(const GridData<T>& g, std::int32_t occupied) {
  const std::int32_t tile = g.occupied_tile[occupied];
  const Octet<std::int32_t> corner = tile_corner(g, tile);
  alignas(64) T blocks[kValueBlocks];  // of the rows that samples reach: no others are read
  for (std::int32_t q = g.tile_piece[occupied]; q < g.tile_piece[occupied + 1]; ++q)
    prefetch(given_back_by(g, g.tile_pieces[q].number));
  for_each_halo_row(g, tile, g.rows[occupied], [&](int y, int z, const HaloRow& row) {
    RINGLET_UNROLL
    for (int x = 0; x < kHaloEdge; ++x)
      put_node(x, y, z, row.node[x] < 0 ? nullptr : g.node + row.node[x] * kNodeValues, blocks);
  });
  for_each_piece_of_tile(g, occupied, [&](const Piece& piece, const Segment<T>& segment) {
    // Of the first particle, then of the second; lanes as the nodes'.
    const Octet<T> zero(T(0)), pic(g.step.pic);
    const Octet<T> speed[2] = {pic * choose<kMomenta>(segment.a, zero),
                               pic * choose<kMomenta>(segment.b, zero)};
    Octet<T> given[2] = {zero, zero};
    for (std::int32_t s = piece.first; s < piece.end; ++s) {
      const T t = segment.parameter(s), a = (T(1) - t) * segment.share_a, b = t * segment.share_b;
      const T own = T(1) / (a + b);
      const Octet<T> read = read_sample(SampleWeights<T>(corner, segment.place(t)), blocks) -
                            (Octet<T>(a * own) * speed[0] + Octet<T>(b * own) * speed[1]);
      given[0] = given[0] + Octet<T>(a) * read, given[1] = given[1] + Octet<T>(b) * read;
    }
    T* to = given_back_by(g, piece.number);
    shuffled<3, 5, 7, 7, 11, 13, 15, 15>(given[0], given[1]).store(to);
    if (g.moved) shuffled<2, 4, 6, 6, 10, 12, 14, 14>(given[0], given[1]).store(to + 8);
  });
}

// Adds what the pieces give back to one strand's velocities and, where they were corrected, to its positions.
template <class T>
RINGLET_FUNCTION void give_back(const GridData<T>& g, int strand) {
  const int batch = strand / kLanes, lane = strand % kLanes;
  const int first = g.first_particle[strand], count = g.first_particle[strand + 1] - first;
  const T cell = static_cast<T>(g.step.axes.cell);
  for (int i = g.step.clamped; i < count; ++i) {
    const std::int64_t base = (static_cast<std::int64_t>(g.step.batches.row[batch]) + i) * 3 * kLanes + lane;
    // `quantity` 0: velocities, 1: positions [cells]
    const auto add = [&](int quantity, T unit, T* to) {
      Octet<T> given(T(0));
      const std::int32_t segment = first + i;
      for (std::int32_t q = g.first_piece[segment - (i > 0)]; q < g.first_piece[segment]; ++q)
        given = given + second_half(Octet<T>::load(given_back_by(g, q) + quantity * 8));
      for (std::int32_t q = g.first_piece[segment]; q < g.first_piece[segment + (i + 1 < count)]; ++q)
        given = given + Octet<T>::load(given_back_by(g, q) + quantity * 8);
      for (int c = 0; c < 3; ++c) {
        const double* r = g.step.axes.rotation + 3 * c;
        to[base + c * kLanes] +=
            unit * (static_cast<T>(r[0]) * given.v[0] + static_cast<T>(r[1]) * given.v[1] +
                    static_cast<T>(r[2]) * given.v[2]);
      }
    };
    add(0, T(1), g.step.state.velocity);
    if (g.moved) add(1, cell, g.step.state.position);
  }
}

// ---- At rest: the greatest density about each sample of an occupied tile, or what was found before.

template <class T>
RINGLET_FUNCTION void rest_densities(const GridData<T>& g, std::int32_t occupied) {
  const std::int32_t tile = g.occupied_tile[occupied];
  const Octet<std::int32_t> corner = tile_corner(g, tile);
  T density[kHaloNodes];
  for_each_halo_row(g, tile, kAllRows, [&](int y, int z, const HaloRow& row) {
    for (int x = 0; x < kHaloEdge; ++x)
      density[halo_node(x, y, z)] = row.node[x] < 0 ? T(0) : g.node[row.node[x] * kNodeValues + kDensity];
  });
  for_each_piece_of_tile(g, occupied, [&](const Piece& piece, const Segment<T>& segment) {
    for (std::int32_t s = piece.first; s < piece.end; ++s) {
      const SampleWeights<T> w(corner, segment.place(segment.parameter(s)));
      const auto also = [&](int axis) { return w.high.v[axis] > T(0) ? 1 : 0; };
      T& greatest = g.rest_density[piece.rest - piece.first + s];
      for (int k = 0; k <= also(2); ++k)
        for (int j = 0; j <= also(1); ++j)
          for (int i = 0; i <= also(0); ++i)
            greatest = max(greatest, density[halo_node(w.node.v[0] + i, w.node.v[1] + j, w.node.v[2] + k)]);
    }
  });
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
