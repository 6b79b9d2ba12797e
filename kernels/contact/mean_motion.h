// The hair's motion at large: mean displacements on a lattice, smooth between its nodes.
//
// Locks of hair travel centimetres in a frame, neighbours against one another millimetres. Neighbours are
// looked for along what is left of a segment's way without the mean motion, so that hair that moves together
// costs no more than hair at rest. The field tells the displacement of what is at a place at the start. Of
// two segments that meet each is carried by the field where it was; the difference is less than the field's
// slope times how far the two moved against one another before they met, so the field is made smooth. Sums
// are of whole numbers: in any order the same.
#pragma once
#include "kernels/contact/contact_data.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

struct MotionLattice {
  float low[3];    // first node [m]
  float per_cell;  // [1/m]
  std::int32_t nodes[3];

  static MotionLattice over(const float* low, const float* high, float cell) {
    MotionLattice lattice{{low[0], low[1], low[2]}, 1 / cell, {}};
    for (int c = 0; c < 3; ++c)
      lattice.nodes[c] = static_cast<std::int32_t>((high[c] - low[c]) * lattice.per_cell) + 2;
    return lattice;
  }
  RINGLET_KERNEL std::int32_t number(std::int32_t x, std::int32_t y, std::int32_t z) const {
    return (z * nodes[1] + y) * nodes[0] + x;
  }
  RINGLET_KERNEL std::int32_t total() const { return nodes[0] * nodes[1] * nodes[2]; }
  // The node nearest to a place along an axis; the first for what is not a number.
  RINGLET_KERNEL std::int32_t nearest(int axis, float x) const {
    const float place = (x - low[axis]) * per_cell + 0.5f;
    if (!(place >= 1)) return 0;
    const auto last = static_cast<float>(nodes[axis] - 1);
    return place < last ? static_cast<std::int32_t>(place) : nodes[axis] - 1;
  }
};

// Sums at one node.
struct MotionSum {
  std::int64_t displacement[3];  // in units of kMotionUnit
  std::int64_t count;
};
inline constexpr double kMotionUnit = 1.0 / (1LL << 32);  // [m]

// At one node: the mean displacement [m] of what is about it, where there is something.
struct MotionNode {
  float mean[3];
  bool known;
};

RINGLET_KERNEL MotionNode mean_of(const MotionSum& sum) {
  MotionNode node{{0, 0, 0}, sum.count > 0};
  if (node.known)
    for (int c = 0; c < 3; ++c)
      node.mean[c] = static_cast<float>(kMotionUnit * static_cast<double>(sum.displacement[c]) /
                                        static_cast<double>(sum.count));
  return node;
}

// Calls visit(neighbour's number) for the nodes next to one.
template <class Visit>
RINGLET_KERNEL void for_neighbours(const MotionLattice& lattice, std::int32_t node, const Visit& visit) {
  const std::int32_t at[3] = {node % lattice.nodes[0], node / lattice.nodes[0] % lattice.nodes[1],
                              node / (lattice.nodes[0] * lattice.nodes[1])};
  const std::int32_t stride[3] = {1, lattice.nodes[0], lattice.nodes[0] * lattice.nodes[1]};
  for (int axis = 0; axis < 3; ++axis) {
    if (at[axis] > 0) visit(node - stride[axis]);
    if (at[axis] + 1 < lattice.nodes[axis]) visit(node + stride[axis]);
  }
}

// What a node without hair takes on.
RINGLET_FUNCTION MotionNode mean_of_neighbours(const MotionLattice& lattice, const MotionNode* nodes,
                                               std::int32_t node) {
  MotionNode mean{};
  float count = 0;
  for_neighbours(lattice, node, [&](std::int32_t other) {
    if (!nodes[other].known) return;
    for (int c = 0; c < 3; ++c) mean.mean[c] += nodes[other].mean[c];
    count += 1;
  });
  mean.known = count > 0;
  for (int c = 0; c < 3 && mean.known; ++c) mean.mean[c] /= count;
  return mean;
}

// The node moved towards those neighbours that it differs from by more than `most`.
RINGLET_FUNCTION MotionNode less_steep(const MotionLattice& lattice, const MotionNode* nodes,
                                       std::int32_t node, float most) {
  MotionNode moved = nodes[node];
  for_neighbours(lattice, node, [&](std::int32_t other) {
    for (int c = 0; c < 3; ++c) {
      const float apart = nodes[other].mean[c] - nodes[node].mean[c];
      moved.mean[c] += (apart - max(-most, min(most, apart))) / 6;
    }
  });
  return moved;
}

// How much the mean motion changes from a node to the next along an axis.
RINGLET_FUNCTION float steepness(const MotionLattice& lattice, const MotionNode* nodes, std::int32_t node,
                                 int axis) {
  std::int32_t stride = 1;
  for (int c = 0; c < axis; ++c) stride *= lattice.nodes[c];
  if (node / stride % lattice.nodes[axis] + 1 == lattice.nodes[axis]) return 0;
  float square = 0;
  for (int c = 0; c < 3; ++c) {
    const float apart = nodes[node + stride].mean[c] - nodes[node].mean[c];
    square += apart * apart;
  }
  return sqrt(square);
}

// At a place near the hair [m]: between the nodes about it that know.
RINGLET_KERNEL Vector3<float> mean_motion(const MotionLattice& lattice, const MotionNode* nodes,
                                          Vector3<float> at) {
  const float place[3] = {at.x, at.y, at.z};
  std::int32_t cell[3];
  float along[3];
  for (int c = 0; c < 3; ++c) {
    const float here = max((place[c] - lattice.low[c]) * lattice.per_cell, 0.0f);
    const std::int32_t last = lattice.nodes[c] - 2;
    cell[c] = here < static_cast<float>(last) ? static_cast<std::int32_t>(here) : last;
    along[c] = min(here - static_cast<float>(cell[c]), 1.0f);
  }
  float weights = 0;
  Vector3<float> mean = zero3<float>();
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = corner >> 1 & 1, z = corner >> 2;
    const MotionNode& node = nodes[lattice.number(cell[0] + x, cell[1] + y, cell[2] + z)];
    if (!node.known) continue;
    const float weight =
        (x ? along[0] : 1 - along[0]) * (y ? along[1] : 1 - along[1]) * (z ? along[2] : 1 - along[2]) +
        1e-6f;  // never nothing
    mean = fma(weight, Vector3<float>{node.mean[0], node.mean[1], node.mean[2]}, mean);
    weights += weight;
  }
  return weights > 0 ? (1 / weights) * mean : mean;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
