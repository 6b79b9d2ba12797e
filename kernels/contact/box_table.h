// Where to look for a segment's neighbours: a uniform spatial hash of boxes, in levels by size.
//
// Segments are cut into pieces, each with a box of its own, for what is long and thin fills its box badly. A
// level takes boxes up to twice the size of the level before it, in cells that are narrower along x, along
// which they lie one after the other in memory. Cells are numbered modulo a power of two along each axis, so
// that a strand that was flung far away costs no memory. The table holds the boxes sorted by cell.
#pragma once
#include "kernels/contact/contact_data.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

struct Box {
  float low[3], high[3];

  RINGLET_KERNEL float half_size() const {
    return 0.5f * max(max(high[0] - low[0], high[1] - low[1]), high[2] - low[2]);
  }
};

inline constexpr int kLevels = 12;

struct BoxLevel {
  float half_size;    // of the largest box it takes [m]
  float per_cell[3];  // [1/m]
  std::int32_t cells[3];
  std::int32_t first_cell;
};

struct BoxLevels {
  float low[3];  // [m]
  BoxLevel level[kLevels];
  std::int32_t total_cells;

  // Levels from the boxes' mean half size on; few boxes have few cells.
  RINGLET_FUNCTION static BoxLevels make(const float* low, const float* high, float mean_half_size,
                                         std::int32_t boxes) {
    float most = 16;
    while (most < 128 && most * most * most < 16 * static_cast<float>(boxes)) most *= 2;
    BoxLevels levels{};
    for (int k = 0; k < kLevels; ++k) {
      BoxLevel& level = levels.level[k];
      level.half_size = k == 0 ? 1.5f * mean_half_size : 2 * levels.level[k - 1].half_size;
      level.first_cell = levels.total_cells;
      std::int32_t cells = 1;
      for (int c = 0; c < 3; ++c) {
        levels.low[c] = low[c];
        level.per_cell[c] = (c == 0 ? 4.0f : 0.7f) / level.half_size;
        const float wanted = min((high[c] - low[c]) * level.per_cell[c], c == 0 ? 4 * most : most);
        for (level.cells[c] = 1; static_cast<float>(level.cells[c]) < wanted;) level.cells[c] *= 2;
        cells *= level.cells[c];
      }
      levels.total_cells += cells;
    }
    return levels;
  }

  // Of the largest there are, where a box is larger than all.
  RINGLET_KERNEL int level_of(float half_size) const {
    int k = 0;
    while (k + 1 < kLevels && half_size > level[k].half_size) ++k;
    return k;
  }
  // Not yet modulo the number of cells.
  RINGLET_KERNEL std::int32_t cell_along(const BoxLevel& at, int axis, float x) const {
    const float place = (x - low[axis]) * at.per_cell[axis];
    constexpr float kFar = 1e9f;
    const float near = max(min(place, kFar), -kFar);
    const auto whole = static_cast<std::int32_t>(near);
    return whole - (near < static_cast<float>(whole) ? 1 : 0);
  }
  RINGLET_KERNEL std::int32_t row_of(const BoxLevel& at, std::int32_t y, std::int32_t z) const {
    return at.first_cell + ((z & (at.cells[2] - 1)) * at.cells[1] + (y & (at.cells[1] - 1))) * at.cells[0];
  }
  RINGLET_KERNEL std::int32_t cell_of(const Box& box) const {
    const BoxLevel& at = level[level_of(box.half_size())];
    std::int32_t cell[3];
    for (int c = 0; c < 3; ++c) cell[c] = cell_along(at, c, 0.5f * (box.low[c] + box.high[c]));
    return row_of(at, cell[1], cell[2]) + (cell[0] & (at.cells[0] - 1));
  }
};

// One of a segment's equal pieces.
struct Piece {
  std::int32_t segment;
  float from, to;  // along the segment, in its lengths
  float stray;     // of the segment, see MotionField [m]

  // Whether the place `at` in [0, 1] along the segment is on it: on one of its pieces.
  RINGLET_KERNEL bool holds(float at) const { return from <= at && (at < to || to >= 1); }
};

// Sorted by cell, and within a cell by segment.
struct BoxTable {
  BoxLevels levels;
  const std::int32_t* first;  // [total_cells + 1] of each cell
  const Piece* piece;         // [boxes]
  const std::uint64_t* cell;  // [boxes] that each is in
  const float* corners;       // low and high [m], see at()
  std::int32_t boxes;

  // Boxes lie in blocks, in each corner after corner.
  static constexpr std::int32_t kBlock = 16, kCorners = 6;
  RINGLET_KERNEL static std::int64_t at(std::int32_t corner, std::int32_t box) {
    return (static_cast<std::int64_t>(box / kBlock) * kCorners + corner) * kBlock + box % kBlock;
  }
};

// Calls visit(begin, end) for the runs of the table among which all boxes of `level` are that overlap `box`.
template <class Visit>
RINGLET_KERNEL void for_runs(const BoxTable& table, int level, const Box& box, const Visit& visit) {
  const BoxLevel& at = table.levels.level[level];
  if (table.first[at.first_cell] ==
      (level + 1 < kLevels ? table.first[table.levels.level[level + 1].first_cell] : table.boxes))
    return;
  // A little more than the largest box's half, for rounding. The last level takes boxes of any size.
  const float reach = level + 1 < kLevels ? 1.001f * at.half_size : 3e38f;
  std::int32_t begin[3], count[3];
  for (int c = 0; c < 3; ++c) {
    begin[c] = table.levels.cell_along(at, c, box.low[c] - reach);
    const std::int32_t cells = table.levels.cell_along(at, c, box.high[c] + reach) - begin[c] + 1;
    count[c] = cells < at.cells[c] ? cells : at.cells[c];
  }
  const std::int32_t from = begin[0] & (at.cells[0] - 1);
  const std::int32_t beyond = from + count[0] - at.cells[0];  // cells that begin anew on the left
  for (std::int32_t z = 0; z < count[2]; ++z)
    for (std::int32_t y = 0; y < count[1]; ++y) {
      const std::int32_t row = table.levels.row_of(at, begin[1] + y, begin[2] + z);
      visit(table.first[row + from], table.first[row + (beyond > 0 ? at.cells[0] : from + count[0])]);
      if (beyond > 0) visit(table.first[row], table.first[row + beyond]);
    }
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
