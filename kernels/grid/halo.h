// A tile's nodes and those about it, laid out so that what a sample reaches lies together.
//
// A node's values are four pairs: of the cell's middle, and of its face on x, on y and on z. A place lies
// among 2 x 2 x 2 nodes of each pair, not the same for all. So each pair has blocks of its own: a block is of
// one node along x and of two along y, and a node is in those of its own y and of the one below. A place's
// eight nodes are then four blocks, two by two consecutive.
#pragma once
#include "kernels/backend/octet.h"
#include "kernels/grid/grid_step.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

inline constexpr int kHaloEdge = kTileEdge + 2, kHaloNodes = kHaloEdge * kHaloEdge * kHaloEdge;

RINGLET_KERNEL constexpr int halo_node(int x, int y, int z) { return (z * kHaloEdge + y) * kHaloEdge + x; }

// Of a pair: [z][lower y][x][lower and upper node][the pair's two values]
inline constexpr int kBlock = 4, kBlockRow = kHaloEdge * kBlock, kBlockPlane = (kHaloEdge - 1) * kBlockRow,
                     kPairBlocks = kHaloEdge * kBlockPlane;
// Sums are of all pairs, values are read of the faces' alone.
inline constexpr int kPairs = kNodeValues / 2, kFacePairs = kPairs - 1;
inline constexpr int kSumBlocks = kPairs * kPairBlocks, kValueBlocks = kFacePairs * kPairBlocks;

// Of a place, the lower of the two nodes about it along each axis and the weights of both. In the first half
// x, y and z for values in the middles of cells, in the second for those on their faces.
template <class T>
struct SampleWeights {
  Octet<T> low, high;
  Octet<std::int32_t> node;  // in the halo

  // `place` [cells], no nearer than half a cell to the lowest corner of all tiles (no hair lies in the lowest
  // ones), and the tile's lowest cell, `corner`, in both halves.
  RINGLET_KERNEL SampleWeights(const Octet<std::int32_t>& corner, const Octet<T>& place) {
    const Octet<T> from = place - choose<0x0f>(Octet<T>(T(0.5)), Octet<T>(T(0)));
    const Octet<std::int32_t> cell = truncated(from);
    high = from - to_real<T>(cell), low = Octet<T>(T(1)) - high;
    node = cell - corner + Octet<std::int32_t>(1);
  }
  // The rows along x that the nodes about it are of, a bit for each.
  RINGLET_KERNEL std::uint64_t rows() const {
    constexpr std::uint64_t kThree = 7, kNine = kThree | kThree << kHaloEdge | kThree << 2 * kHaloEdge;
    return kNine << ((node.v[6] - 1) * kHaloEdge + node.v[5] - 1);
  }
  // The first of its blocks among a pair's.
  template <int kPair>
  RINGLET_KERNEL int block() const {
    const auto along = [&](int axis) { return node.v[kPair == axis + 1 ? axis + 4 : axis]; };
    return along(2) * kBlockPlane + along(1) * kBlockRow + along(0) * kBlock;
  }

  // Weights for the lanes of blocks. Along x, for values in the middles or on the faces: [x][any]
  RINGLET_KERNEL Octet<T> in_x() const { return shuffled<0, 0, 0, 0, 8, 8, 8, 8>(low, high); }
  RINGLET_KERNEL Octet<T> on_x() const { return shuffled<4, 4, 4, 4, 12, 12, 12, 12>(low, high); }
  // [in the middle or on the face][y or z][any]
  RINGLET_KERNEL Octet<T> both_y() const { return shuffled<1, 1, 9, 9, 5, 5, 13, 13>(low, high); }
};

// ---- Sums

template <class T>
RINGLET_KERNEL void add_to(Fixed<T>* blocks, const Octet<T>& value) {
  (Octet<Fixed<T>>::load_by_halves(blocks) + nearest(value)).store_by_halves(blocks);
}

template <class T>
RINGLET_KERNEL void add_sample(const SampleWeights<T>& w, const Octet<T>& value, Fixed<T>* blocks) {
  // Of the faces on x and y, and of the middle and the face on z: [which][y][the pair's two values]
  const Octet<T> xy = shuffled<2, 3, 2, 3, 4, 5, 4, 5>(value, value);
  const Octet<T> mz = shuffled<0, 1, 0, 1, 6, 7, 6, 7>(value, value);
  const Octet<T> both_y = w.both_y(), in_y = first_half(both_y), in_x = w.in_x(), on_x = w.on_x();
  Fixed<T>* m = blocks + w.template block<0>();
  Fixed<T>* x = blocks + kPairBlocks + w.template block<1>();
  Fixed<T>* y = blocks + 2 * kPairBlocks + w.template block<2>();
  Fixed<T>* z = blocks + 3 * kPairBlocks + w.template block<3>();
  RINGLET_UNROLL
  for (int k = 0; k < 2; ++k) {
    const Octet<T>& weights = k == 0 ? w.low : w.high;
    const Octet<T> both_z = shuffled<2, 2, 2, 2, 6, 6, 6, 6>(weights, weights), in_z = first_half(both_z);
    const Octet<T> xy_rows = in_z * xy * both_y, mz_rows = both_z * mz * in_y;
    add_to(m + k * kBlockPlane, first_half(mz_rows) * in_x);
    add_to(x + k * kBlockPlane, first_half(xy_rows) * on_x);
    add_to(y + k * kBlockPlane, second_half(xy_rows) * in_x);
    add_to(z + k * kBlockPlane, second_half(mz_rows) * in_x);
  }
}

// A row's sums, of its nodes, from those of its blocks.
template <class T>
RINGLET_KERNEL void merge_row(const Fixed<T>* blocks, int y, int z, Fixed<T>* nodes) {
  RINGLET_UNROLL
  for (int x = 0; x < kHaloEdge; x += 2) {
    const int block = z * kBlockPlane + y * kBlockRow + x * kBlock;
    Octet<Fixed<T>> pair[kPairs];  // of two nodes, in their blocks' first half
    RINGLET_UNROLL
    for (int p = 0; p < kPairs; ++p) {
      const Octet<Fixed<T>> zero(0);
      const auto load = [&](int at) { return Octet<Fixed<T>>::load(blocks + p * kPairBlocks + at); };
      const Octet<Fixed<T>> lower = y < kHaloEdge - 1 ? load(block) : zero;
      const Octet<Fixed<T>> upper = y > 0 ? load(block - kBlockRow) : zero;
      pair[p] = lower + shuffled<2, 3, 0, 1, 6, 7, 4, 5>(upper, upper);
    }
    const auto first = shuffled<0, 1, 8, 9, 4, 5, 12, 13>(pair[0], pair[1]);
    const auto last = shuffled<0, 1, 8, 9, 4, 5, 12, 13>(pair[2], pair[3]);
    shuffled<0, 1, 2, 3, 8, 9, 10, 11>(first, last).store(nodes + x * kNodeValues);
    shuffled<4, 5, 6, 7, 12, 13, 14, 15>(first, last).store(nodes + (x + 1) * kNodeValues);
  }
}

// ---- Values

template <class T>
struct alignas(2 * sizeof(T)) Pair {
  T value[2];
};

// `node` null: there is none, and nothing there.
template <class T>
RINGLET_KERNEL void put_node(int x, int y, int z, const T* node, T* blocks) {
  const int block = z * kBlockPlane + y * kBlockRow + x * kBlock;
  RINGLET_UNROLL
  for (int p = 0; p < kFacePairs; ++p) {
    const Pair<T> pair = node ? reinterpret_cast<const Pair<T>*>(node)[1 + p] : Pair<T>{};
    const auto put = [&](int at) { *reinterpret_cast<Pair<T>*>(blocks + p * kPairBlocks + at) = pair; };
    if (y < kHaloEdge - 1) put(block);
    if (y > 0) put(block - kBlockRow + 2);
  }
}

// Sums of the halves of a and of b, and of the quarters of each half.
template <class T>
RINGLET_KERNEL Octet<T> sum_halves(const Octet<T>& a, const Octet<T>& b) {
  return shuffled<0, 1, 2, 3, 8, 9, 10, 11>(a, b) + shuffled<4, 5, 6, 7, 12, 13, 14, 15>(a, b);
}
template <class T>
RINGLET_KERNEL Octet<T> sum_quarters(const Octet<T>& a, const Octet<T>& b) {
  return shuffled<0, 1, 8, 9, 4, 5, 12, 13>(a, b) + shuffled<2, 3, 10, 11, 6, 7, 14, 15>(a, b);
}

// At a sample, in the lanes of the node's values; what the first two hold means nothing.
template <class T>
RINGLET_KERNEL Octet<T> read_sample(const SampleWeights<T>& w, const T* blocks) {
  const T* x = blocks + w.template block<1>();
  const T* y = blocks + kPairBlocks + w.template block<2>();
  const T* z = blocks + 2 * kPairBlocks + w.template block<3>();
  const Octet<T> in_x = w.in_x(), on_x = w.on_x(), both_y = w.both_y(), in_y = first_half(both_y);
  const auto read = [](const T* from, int k) { return Octet<T>::load_by_halves(from + k * kBlockPlane); };
  // [x or y][y]
  const Octet<T> low = sum_halves(on_x * read(x, 0), in_x * read(y, 0));
  const Octet<T> high = sum_halves(on_x * read(x, 1), in_x * read(y, 1));
  const Octet<T> in_z = shuffled<2, 2, 10, 10, 2, 2, 10, 10>(w.low, w.high);
  const Octet<T> xy = in_z * sum_quarters(both_y * low, both_y * high);  // [x or y][z]
  // [z][y], then [z]
  const Octet<T> rows = in_y * sum_halves(in_x * read(z, 0), in_x * read(z, 1));
  const Octet<T> on_z = shuffled<6, 6, 6, 6, 14, 14, 14, 14>(w.low, w.high);
  const Octet<T> third = on_z * sum_quarters(rows, rows);
  return choose<0x3f>(sum_quarters(xy, xy), sum_halves(third, third));
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
