// Where to look for a segment's neighbours: a uniform spatial hash of segments, in levels by size.
//
// A level takes segments up to twice the size of the level before it, in cells half as wide as the largest.
// Cells are numbered modulo a power of two along each axis, so that a strand that was flung far away costs no
// memory. The table holds the segments sorted by cell, and in a cell by the axis that they run along most;
// along x cells lie one after the other in memory.
#pragma once
#include "kernels/contact/contact_data.h"
#include "kernels/contact/tube.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

struct Box {
  float low[3], high[3];

  RINGLET_KERNEL void extend(const Box& box) {
    for (int c = 0; c < 3; ++c) low[c] = min(low[c], box.low[c]), high[c] = max(high[c], box.high[c]);
  }
};

inline constexpr int kLevels = 12;

struct BoxLevel {
  float half_size;  // of the largest box it takes [m]
  float per_cell;   // [1/m]
  std::int32_t cells[3];
  std::int32_t first_cell;
};

struct BoxLevels {
  float low[3];  // [m]
  BoxLevel level[kLevels];
  std::int32_t total_cells;

  // Levels from a half size on; few boxes have few cells.
  RINGLET_FUNCTION static BoxLevels make(const float* low, const float* high, float first_half_size,
                                         std::int32_t boxes) {
    BoxLevels levels{};
    for (int c = 0; c < 3; ++c) levels.low[c] = low[c];
    for (int k = 0; k < kLevels; ++k) {
      BoxLevel& level = levels.level[k];
      level.half_size = k == 0 ? first_half_size : 2 * levels.level[k - 1].half_size;
      level.per_cell = 1 / level.half_size;
      level.first_cell = levels.total_cells;
      levels.total_cells += share_cells(level, low, high, boxes);
    }
    return levels;
  }

  // As many along each axis as the boxes' extent holds, but no more in all than there is use for. Returns how
  // many.
  RINGLET_FUNCTION static std::int32_t share_cells(BoxLevel& level, const float* low, const float* high,
                                                   std::int32_t boxes) {
    constexpr float kFar = 1 << 20;
    float most = 4096, all = 1;
    while (most < (1 << 21) && most < 16 * static_cast<float>(boxes)) most *= 2;
    for (int c = 0; c < 3; ++c) {
      const float wanted = min((high[c] - low[c]) * level.per_cell, kFar);
      for (level.cells[c] = 1; static_cast<float>(level.cells[c]) < wanted;) level.cells[c] *= 2;
      all *= static_cast<float>(level.cells[c]);
    }
    for (; all > most; all /= 2) {
      int longest = 0;
      for (int c = 1; c < 3; ++c)
        if (level.cells[c] > level.cells[longest]) longest = c;
      level.cells[longest] /= 2;
    }
    return static_cast<std::int32_t>(all);
  }
  // Of the largest there are, where a box is larger than all.
  RINGLET_KERNEL int level_of(float half_size) const {
    int k = 0;
    while (k + 1 < kLevels && half_size > level[k].half_size) ++k;
    return k;
  }
  RINGLET_KERNEL int level_with(std::int32_t cell) const {
    int k = 0;
    while (k + 1 < kLevels && cell >= level[k + 1].first_cell) ++k;
    return k;
  }
  // Not yet modulo the number of cells.
  RINGLET_KERNEL std::int32_t cell_along(const BoxLevel& at, int axis, float x) const {
    const float place = (x - low[axis]) * at.per_cell;
    constexpr float kFar = 1e9f;
    const float near = max(min(place, kFar), -kFar);
    const auto whole = static_cast<std::int32_t>(near);
    return whole - (near < static_cast<float>(whole) ? 1 : 0);
  }
  RINGLET_KERNEL std::int32_t row_of(const BoxLevel& at, std::int32_t y, std::int32_t z) const {
    return at.first_cell + ((z & (at.cells[2] - 1)) * at.cells[1] + (y & (at.cells[1] - 1))) * at.cells[0];
  }
  RINGLET_KERNEL std::int32_t cell_of(const float* centre, float half_size) const {
    const BoxLevel& at = level[level_of(half_size)];
    std::int32_t cell[3];
    for (int c = 0; c < 3; ++c) cell[c] = cell_along(at, c, centre[c]);
    return row_of(at, cell[1], cell[2]) + (cell[0] & (at.cells[0] - 1));
  }
};

// What is known of a segment in one place.
template <class T>
struct alignas(64) SegmentPlaces {
  // At the start and at the end. extra: at start.begin the strand's number, see number_of; at the end radii
  // [m].
  struct Ends {
    Place<T> begin, end;
  } start, end;

  // Whole numbers stay so in T. Strands that share one are far from one another.
  RINGLET_KERNEL static T number_of(std::int32_t strand) { return static_cast<T>(strand & 0xffffff); }
};

// Of the places from `of` on, those of a segment for each lane. `quads`: four times where it is in the table.
template <class R>
RINGLET_KERNEL GatheredSegment<R> gather_ends(const typename SegmentPlaces<Scalar<R>>::Ends& of,
                                              const std::int32_t* quads) {
  const Quad<R> begin = gather_quads<R>(&of.begin.x, quads), end = gather_quads<R>(&of.end.x, quads);
  return {{vector_of(begin), vector_of(end)}, begin.w, end.w};
}

// Sorted by cell, axis and segment's number.
template <class T>
struct SegmentTable {
  BoxLevels levels;
  const std::int32_t* first;       // [total_cells + 1] of each cell
  const std::int32_t* segment;     // [segments]
  const std::uint64_t* key;        // [segments] cell and axis that each is in
  const SegmentPlaces<T>* places;  // [segments]
  const float* tubes;              // see tube() [m]
  std::int32_t segments;

  RINGLET_KERNEL static std::uint64_t key_of(std::int32_t cell, int axis) {
    return static_cast<std::uint64_t>(cell) << 2 | static_cast<std::uint64_t>(axis);
  }
  RINGLET_KERNEL static std::int32_t cell_of(std::uint64_t key) {
    return static_cast<std::int32_t>(key >> 2);
  }
  RINGLET_KERNEL static int axis_of(std::uint64_t key) { return static_cast<int>(key & 3); }

  // Tubes lie in blocks of segments; in each, axis by axis, all segments' first number, then all segments'
  // second.
  static constexpr std::int32_t kBlock = 16, kNumbers = Tube<float>::kNumbers;
  RINGLET_KERNEL static std::int64_t tube(std::int32_t at, int axis) {
    return (static_cast<std::int64_t>(at / kBlock) * 3 + axis) * kNumbers * kBlock + at % kBlock;
  }
  RINGLET_KERNEL Box box(std::int32_t at) const {
    Box box;
    for (int c = 0; c < 3; ++c) {
      const float* ends = tubes + tube(at, c);
      box.low[c] = ends[0], box.high[c] = ends[kBlock];
    }
    return box;
  }
};

// Calls visit(begin, end) for the runs of the table among which all boxes of `level` are that overlap `box`.
template <class T, class Visit>
RINGLET_KERNEL void for_runs(const SegmentTable<T>& table, int level, const Box& box, const Visit& visit) {
  const BoxLevel& at = table.levels.level[level];
  if (table.first[at.first_cell] ==
      (level + 1 < kLevels ? table.first[table.levels.level[level + 1].first_cell] : table.segments))
    return;
  // A little more than the largest box's half, for rounding. The last level takes boxes of any size.
  const float reach = level + 1 < kLevels ? 1.001f * at.half_size : 3e38f;
  std::int32_t begin[3], count[3];
  for (int c = 0; c < 3; ++c) {
    const float here = reach + 1e-6f * max(abs(box.low[c]), abs(box.high[c]));
    begin[c] = table.levels.cell_along(at, c, box.low[c] - here);
    const std::int32_t cells = table.levels.cell_along(at, c, box.high[c] + here) - begin[c] + 1;
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
