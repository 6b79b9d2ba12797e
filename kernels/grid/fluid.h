// The fluid's cells, their operator and what the pressure does to the faces.
//
//   (A p)_i = sum over faces of w_f / m_f (p_i - p_j),   b_i = d_i - sum of (w_f u_f + (1 - w_f) u_wall)
//
// with w_f a face's open share, m_f its mass, the sum running outward, and d the least divergence that the
// density allows. Then u_f -= (p_above - p_below) / m_f: mass times change adds up to nothing away from
// walls, whatever the residual, so momentum is kept.
#pragma once
#include "kernels/grid/walls.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// The node next to a node along an axis, in the direction of `step` (1 or -1); -1 where there is no tile.
template <class T>
RINGLET_FUNCTION std::int64_t next_node(const GridData<T>& g, std::int64_t node, int axis, int step) {
  const int cell = static_cast<int>(node & (kTileCells - 1)), at = coordinate_in_tile(cell, axis) + step;
  const int rest = cell & ~(9 << axis), within = at & 3;
  const int next = rest | ((within & 1) | (within & 2) << 2) << axis;
  std::int64_t tile = node >> kTileBits;
  if (at < 0 || at >= kTileEdge) {
    constexpr int kStride[3] = {1, 3, 9};
    tile = g.near[tile * kAround + kAround / 2 + step * kStride[axis]];
    if (tile < 0) return -1;
  }
  return tile * kTileCells + next;
}

// The number of a fluid cell, -1 for another.
template <class T>
RINGLET_FUNCTION std::int32_t fluid_cell(const GridData<T>& g, std::int64_t node) {
  if (node < 0) return -1;
  const std::int64_t tile = node >> kTileBits;
  const std::uint64_t bit = std::uint64_t{1} << (node & (kTileCells - 1)), mask = g.fluid[tile];
  return mask & bit ? g.first_cell[tile] + ones(mask & (bit - 1)) : -1;
}

// A cell beside the fluid is no air where its middle is this near to a solid, or within it [cells].
inline constexpr double kWallShare = 0.25;

// What of a face is open. Where the cell beyond it is solid it is the wall: there is nothing that hair could
// be pressed into.
template <class T>
RINGLET_FUNCTION Opening<T> find_opening(const GridData<T>& g, const double* place, int axis, bool above,
                                         bool below) {
  Opening<T> opening{T(1), T(0)};
  double beyond[3] = {place[0], place[1], place[2]};
  beyond[axis] += above ? -0.5 : 0.5;
  for (std::int32_t s = 0; s < g.step.solid_count; ++s) {
    const SolidView& solid = g.step.solids[s];
    const Vector3<T> p = in_solid<T>(g.step.axes, solid, place);
    const BlendedSample<T> level(solid, p);
    const auto cells = [&](T distance) {
      return (distance - static_cast<T>(solid.offset)) / static_cast<T>(g.step.axes.cell);
    };
    T share = min(max(cells(level.distance) + T(0.5), T(0)), T(1));
    if (above != below &&
        cells(BlendedSample<T>(solid, in_solid<T>(g.step.axes, solid, beyond)).distance) < T(kWallShare))
      share = T(0);
    if (!(share < opening.share)) continue;
    opening = {share, wall_velocity(g, solid, place, p, level.first.triangle, axis)};
  }
  return opening;
}

template <class T>
RINGLET_FUNCTION std::uint64_t fluid_cells(const GridData<T>& g, std::int32_t tile) {
  std::uint64_t mask = 0;
  for (int cell = 0; cell < kTileCells; ++cell) {
    const T* values = g.node + (static_cast<std::int64_t>(tile) * kTileCells + cell) * kNodeValues;
    if (values[kDensity] > static_cast<T>(kFluidShare) * values[kTarget] && values[kTarget] > T(0))
      mask |= std::uint64_t{1} << cell;
  }
  return mask;
}

// Whether a tile has faces of fluid cells: some of its own, or across its lower faces.
template <class T>
RINGLET_FUNCTION bool has_fluid_faces(const GridData<T>& g, std::int32_t tile) {
  const std::int32_t* near = g.near + static_cast<std::int64_t>(tile) * kAround + kAround / 2;
  const auto fluid = [&](std::int32_t other) { return other >= 0 && g.fluid[other] != 0; };
  return fluid(tile) || fluid(near[-1]) || fluid(near[-3]) || fluid(near[-9]);
}

// The cells of a tile whose lower face along an axis has a fluid cell below it, a bit for each.
template <class T>
RINGLET_FUNCTION std::uint64_t fluid_below(const GridData<T>& g, std::int32_t tile, int axis) {
  constexpr int kStride[3] = {1, 3, 9};
  // Cells whose coordinate along the axis has no lower bit, no upper one.
  constexpr std::uint64_t kEven[3] = {0x5555555555555555ull, 0x3333333333333333ull, 0x0f0f0f0f0f0f0f0full};
  constexpr std::uint64_t kFirst[3] = {0x00ff00ff00ff00ffull, 0x0000ffff0000ffffull, 0x00000000ffffffffull};
  const std::uint64_t even = kEven[axis], first = kFirst[axis], fluid = g.fluid[tile];
  const std::int32_t other = g.near[static_cast<std::int64_t>(tile) * kAround + kAround / 2 - kStride[axis]];
  const std::uint64_t beyond = other < 0 ? 0 : g.fluid[other];
  return (fluid & even) << (1 << axis) | (fluid & ~even & first) << (7 << axis) |
         (beyond & ~even & ~first) >> (9 << axis);
}
// Those that have a fluid cell on either side of it.
template <class T>
RINGLET_FUNCTION std::uint64_t fluid_faces(const GridData<T>& g, std::int32_t tile, int axis) {
  return g.fluid[tile] | fluid_below(g, tile, axis);
}

// Whether 2 x 2 x 2 cells of a tile have such faces.
template <class T>
RINGLET_FUNCTION bool part_has_fluid_faces(const GridData<T>& g, std::int64_t part) {
  const std::int32_t tile = static_cast<std::int32_t>(part / kTileParts);
  constexpr std::uint64_t kCells = (1 << kPartCells) - 1;
  std::uint64_t faces = 0;
  for (int axis = 0; axis < 3; ++axis) faces |= fluid_faces(g, tile, axis);
  return (faces >> (part % kTileParts * kPartCells) & kCells) != 0;
}

// Of the faces of 2 x 2 x 2 cells.
template <class T>
RINGLET_FUNCTION void find_openings(const GridData<T>& g, std::int64_t part) {
  const std::int32_t tile = static_cast<std::int32_t>(part / kTileParts);
  const Octet<std::int32_t> corner = tile_corner(g, tile);
  T* to = g.opening + static_cast<std::int64_t>(g.wall[part]) * kPartCells * kWallValues;
  for (int axis = 0; axis < 3; ++axis) {
    const std::uint64_t below = fluid_below(g, tile, axis);
    for (int n = 0; n < kPartCells; ++n) {
      const int cell = static_cast<int>(part % kTileParts) * kPartCells + n;
      const bool fluid_above = g.fluid[tile] >> cell & 1, fluid_beneath = below >> cell & 1;
      Opening<T> opening{T(1), T(0)};
      if (fluid_above || fluid_beneath) {
        double place[3];
        for (int c = 0; c < 3; ++c)
          place[c] =
              kTileEdge * g.low[c] + corner.v[c] + coordinate_in_tile(cell, c) + (c == axis ? 0.0 : 0.5);
        opening = find_opening(g, place, axis, fluid_above, fluid_beneath);
      }
      to[n * kWallValues + axis] = opening.share, to[n * kWallValues + 3 + axis] = opening.velocity;
    }
  }
}

// Calls f(bit) for the bits that are set, from the lowest on.
template <class F>
RINGLET_FUNCTION void for_each_bit(std::uint64_t bits, const F& f) {
  for (; bits != 0; bits &= bits - 1) f(ones(~bits & (bits - 1)));
}

// 1 / mass of a tile's faces, 0 where neither cell beside one is fluid.
template <class T>
RINGLET_FUNCTION void find_lightness(const GridData<T>& g, std::int32_t tile) {
  const std::int64_t first = static_cast<std::int64_t>(tile) * kTileCells;
  for (int face = 0; face < kTileCells * 3; ++face) g.lightness[first * 3 + face] = T(0);
  for (int axis = 0; axis < 3; ++axis) {
    const int value = kFaceMass + 2 * axis;
    const std::uint64_t below = fluid_below(g, tile, axis);
    for_each_bit(g.fluid[tile] | below, [&](int cell) {
      const std::int64_t node = first + cell;
      T mass = g.node[node * kNodeValues + value];
      const auto at_least = [&](std::int64_t opposite) {
        if (opposite >= 0)
          mass = max(mass, static_cast<T>(kLeastFaceShare) * g.node[opposite * kNodeValues + value]);
      };
      if (g.fluid[tile] >> cell & 1) at_least(next_node(g, node, axis, 1));
      if (below >> cell & 1) at_least(next_node(g, node, axis, -1));
      if (mass > T(0)) g.lightness[node * 3 + axis] = T(1) / mass;
    });
  }
}

// A fluid cell's row of the operator, and how much flows out of it.
template <class T>
struct CellRow {
  T face[kDirections], open = T(0), outflow = T(0);
  std::int32_t neighbour[kDirections];

  RINGLET_FUNCTION CellRow(const GridData<T>& g, std::int64_t node, std::int32_t number) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::int64_t high = next_node(g, node, axis, 1);  // none where no hair reaches
      const T below = velocity(g, node, axis), beyond = velocity(g, high, axis);
      const bool hair_below = mass(g, node, axis) > T(0), hair_beyond = mass(g, high, axis) > T(0);
      // Where a face has no hair nothing crosses it faster than the other side.
      add(g, node, axis, 2 * axis, next_node(g, node, axis, -1), number, -(hair_below ? below : beyond));
      add(g, high, axis, 2 * axis + 1, high, number, hair_beyond ? beyond : below,
          hair_below ? T(1) / (static_cast<T>(kLeastFaceShare) * mass(g, node, axis)) : T(0));
    }
  }

 private:
  RINGLET_FUNCTION static T mass(const GridData<T>& g, std::int64_t node, int axis) {
    return node < 0 ? T(0) : g.node[node * kNodeValues + kFaceMass + 2 * axis];
  }
  RINGLET_FUNCTION static T velocity(const GridData<T>& g, std::int64_t node, int axis) {
    return node < 0 ? T(0) : g.node[node * kNodeValues + kFaceMass + 2 * axis + 1];
  }
  // `outward`: the hair's velocity out of the cell through this face.
  RINGLET_FUNCTION void add(const GridData<T>& g, std::int64_t face_node, int axis, int direction,
                            std::int64_t beside, std::int32_t number, T outward, T lightness_across = T(0)) {
    // A face that no hair reaches weighs what a face weighs at least.
    const bool reached = face_node >= 0;
    const Opening<T> opening = reached ? opening_of(g, face_node, axis) : Opening<T>{T(1), T(0)};
    const T c = reached ? opening.share * g.lightness[face_node * 3 + axis] : lightness_across;
    const std::int32_t other = fluid_cell(g, beside);
    neighbour[direction] = other < 0 ? number : other;
    face[direction] = other < 0 ? T(0) : c;
    open += c;
    const T wall = direction & 1 ? opening.velocity : -opening.velocity;
    outflow += fma(opening.share, outward, (T(1) - opening.share) * wall);
  }
};

// The least divergence that a cell's density allows within one step: negative below the target. 0 over it:
// that is no matter of velocity.
template <class T>
RINGLET_FUNCTION T least_divergence(const T* values) {
  return min(T(0), T(1) - values[kTarget] / values[kDensity]);
}

// The divergence of displacement that brings a cell to its target, or that it has to spare.
template <class T>
RINGLET_FUNCTION T wanted_divergence(const T* values) {
  const T wanted = T(1) - values[kTarget] / values[kDensity];
  return min(wanted, static_cast<T>(kMostCorrection));
}

// The change that pressure makes to one of a node's faces.
template <class T>
RINGLET_FUNCTION T pressed(const GridData<T>& g, const double* pressure, std::int64_t node, int axis) {
  const T lightness = g.lightness[node * 3 + axis];
  if (!(lightness > T(0))) return T(0);
  const auto at = [&](std::int64_t n) {
    const std::int32_t cell = fluid_cell(g, n);
    return cell < 0 ? 0.0 : pressure[cell];
  };
  return lightness * static_cast<T>(at(next_node(g, node, axis, -1)) - at(node));
}

// The change of a face's velocity. One that a wall closes takes the wall's where pressed hair would lag
// behind it.
template <class T>
RINGLET_FUNCTION T pressed_velocity(const GridData<T>& g, const double* pressure, std::int64_t node, int axis,
                                    T before) {
  const Opening<T> opening = opening_of(g, node, axis);
  const T change = pressed(g, pressure, node, axis);
  if (opening.share > T(0)) return change;
  const T lag = opening.velocity - before;
  return change * lag < T(0) ? lag : T(0);  // pressure would push it into the wall: hair is pressed onto it
}

// Readies a tile's nodes for the way back (`pressure` null: of places alone): the change of velocity and the
// share `pic` of the velocity itself take the place of velocities, no displacement that of masses.
template <class T>
RINGLET_FUNCTION void press_velocities(const GridData<T>& g, const double* pressure, std::int32_t tile) {
  std::uint64_t faces[3] = {};
  for (int axis = 0; pressure && axis < 3; ++axis) faces[axis] = fluid_faces(g, tile, axis);
  for (int cell = 0; cell < kTileCells; ++cell) {
    const std::int64_t node = static_cast<std::int64_t>(tile) * kTileCells + cell;
    T* values = g.node + node * kNodeValues + kFaceMass;
    if (!(values[0] > T(0) || values[2] > T(0) || values[4] > T(0))) continue;  // no hair, nothing to read
    for (int axis = 0; axis < 3; ++axis) {
      T &displacement = values[2 * axis], &velocity = values[2 * axis + 1];
      const T change = faces[axis] >> cell & 1 ? pressed_velocity(g, pressure, node, axis, velocity) : T(0);
      displacement = T(0), velocity = fma(g.step.pic, velocity, change);
    }
  }
}
// The displacement of each face [cells].
template <class T>
RINGLET_FUNCTION void press_places(const GridData<T>& g, const double* pressure, std::int32_t tile) {
  for (int axis = 0; axis < 3; ++axis)
    for_each_bit(fluid_faces(g, tile, axis), [&](int cell) {
      const std::int64_t node = static_cast<std::int64_t>(tile) * kTileCells + cell;
      if (opening_of(g, node, axis).share > T(0))
        g.node[node * kNodeValues + kFaceMass + 2 * axis] =
            min(max(pressed(g, pressure, node, axis), T(-1)), T(1));
    });
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
