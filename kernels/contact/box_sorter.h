// Cuts segments into pieces and sorts the pieces' boxes into a table.
#pragma once
#include "kernels/contact/box_table.h"
#include "kernels/contact/motion_field.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// What of their ways segments are boxed by.
struct SweptBoxes {
  HairExtent extent;
  const Place<float>* carried;  // see MotionField
  bool from_anywhere;           // boxes hold the start and what is about it, whatever the way
  float slope;                  // of the mean motion [-]
  float farthest;               // along a segment's way against the mean motion [m]
  float piece_length;           // about [m]

  // How far apart from the start on two can have been that meet: each went `farthest`, and the mean motion
  // carried them there from places between which it differs by its slope times that. Half of it [m].
  RINGLET_KERNEL float along_both() const { return farthest / (1 - gentle_slope()); }
  RINGLET_KERNEL float gentle_slope() const { return min(slope, 0.9f); }
};

template <class Backend, class T>
class BoxSorter {
 public:
  // Of the segments that counts(segment) is true for. Holds until the next call.
  template <class Counts>
  BoxTable sort(Backend& backend, const HairPlaces<T>& places, const SweptBoxes& swept,
                const Counts& counts) {
    const std::int32_t boxes = cut(backend, places, swept, counts);
    box(backend, places, swept);
    BoxTable table{};
    table.boxes = boxes;
    table.levels = find_levels(backend, swept.extent, boxes);
    sort_cells(backend, table.levels, boxes);
    gather(backend, boxes);
    table.first = first_.data(), table.piece = piece_.data(), table.cell = key_.data();
    table.corners = corners_.data();
    return table;
  }

  std::size_t bytes() const {
    return start_.bytes() + cut_.bytes() + piece_.bytes() + box_.bytes() + key_.bytes() + order_.bytes() +
           first_.bytes() + corners_.bytes();
  }

 private:
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;
  static constexpr std::int32_t kMostPieces = 16;

  // Returns how many pieces there are.
  template <class Counts>
  std::int32_t cut(Backend& backend, const HairPlaces<T>& places, const SweptBoxes& swept,
                   const Counts& counts) {
    const std::int32_t particles = places.particles;
    start_.resize(particles + 1);
    std::int32_t* start = start_.data();
    const float per_length = 1 / swept.piece_length;
    const Place<float>* carried = swept.carried;
    backend.parallel_for("count pieces", particles + 1, [=] RINGLET_LAMBDA(std::int32_t p) {
      start[p] = 0;
      if (p == particles || places.strand[p] < 0 || !counts(p)) return;
      const Vector3<float> end = float_vector(places.end[p]), along = float_vector(places.end[p + 1]) - end,
                           from = vector_of(carried[p]), then = vector_of(carried[p + 1]) - from;
      if (!(dot(end, end) + dot(along, along) + dot(from, from) + dot(then, then) < 1e12f)) return;  // lost
      const float wanted = length(along) * per_length;
      start[p] = wanted < kMostPieces ? static_cast<std::int32_t>(wanted) + 1 : kMostPieces;
    });
    const std::int32_t boxes = backend.scan("start pieces", start_, particles + 1);
    cut_.resize(boxes);
    Piece* piece = cut_.data();
    backend.parallel_for("cut segments", particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      const std::int32_t pieces = start[p + 1] - start[p];
      const float share = 1 / static_cast<float>(pieces > 0 ? pieces : 1);
      for (std::int32_t k = 0; k < pieces; ++k)
        piece[start[p] + k] = {p, static_cast<float>(k) * share,
                               k + 1 < pieces ? static_cast<float>(k + 1) * share : 1.0f, carried[p].extra};
    });
    return boxes;
  }

  void box(Backend& backend, const HairPlaces<T>& places, const SweptBoxes& swept) {
    box_.resize(cut_.size());
    Box* boxes = box_.data();
    const std::int32_t* start = start_.data();
    backend.parallel_for("box pieces", places.particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      if (start[p] < start[p + 1]) box_segment(places, swept, p, start[p + 1] - start[p], boxes + start[p]);
    });
  }

  // Each holds its piece at the start, carried along with the mean motion, and where it is when the segment
  // has gone `farthest` from there, or at the end; or else its piece at the start and `farthest` about it.
  RINGLET_FUNCTION static void box_segment(const HairPlaces<T>& places, const SweptBoxes& swept,
                                           std::int32_t p, std::int32_t pieces, Box* boxes) {
    const float near =
        static_cast<float>(kNear) * static_cast<float>(thickest(places.end, p)) + swept.carried[p].extra;
    if (swept.from_anywhere) {
      const Segment<float> start{float_vector(places.start[p]), float_vector(places.start[p + 1])};
      return box_pieces(start, start, near + swept.along_both(), pieces, boxes);
    }
    const Segment<float> first{vector_of(swept.carried[p]), vector_of(swept.carried[p + 1])};
    const Vector3<float> begin_way = float_vector(places.end[p]) - first.begin,
                         end_way = float_vector(places.end[p + 1]) - first.end;
    const float way = max(length(begin_way), length(end_way));
    const float share = way > swept.farthest ? swept.farthest / way : 1.0f;
    const Segment<float> last{fma(share, begin_way, first.begin), fma(share, end_way, first.end)};
    box_pieces(first, last, near + swept.gentle_slope() / (1 - swept.gentle_slope()) * share * way, pieces,
               boxes);
  }

  // Of what is between two places of a segment, with `more` about it.
  RINGLET_KERNEL static void box_pieces(const Segment<float>& first, const Segment<float>& last, float more,
                                        std::int32_t pieces, Box* boxes) {
    const float step = 1 / static_cast<float>(pieces);
    for (std::int32_t k = 0; k < pieces; ++k) {
      const float from = static_cast<float>(k) * step, to = static_cast<float>(k + 1) * step;
      const Vector3<float> corner[4] = {first.at(from), first.at(to), last.at(from), last.at(to)};
      Box& box = boxes[k];
      for (int c = 0; c < 3; ++c) {
        const auto at = [&](int which) { return (&corner[which].x)[c]; };
        box.low[c] = min(min(at(0), at(1)), min(at(2), at(3))) - more;
        box.high[c] = max(max(at(0), at(1)), max(at(2), at(3))) + more;
      }
    }
  }

  // By a mean that a few large boxes do not matter to.
  BoxLevels find_levels(Backend& backend, const HairExtent& extent, std::int32_t boxes) {
    const Box* box = box_.data();
    const double per_size = backend.sum("contact sizes", boxes, [=] RINGLET_LAMBDA(std::int32_t k) {
      const float half = box[k].half_size();
      return half > 0 ? 1 / static_cast<double>(half) : 0.0;
    });
    const double mean = per_size > 0 ? boxes / per_size : 1;
    return BoxLevels::make(extent.low, extent.high, static_cast<float>(mean), boxes);
  }

  void sort_cells(Backend& backend, const BoxLevels& levels, std::int32_t boxes) {
    const std::int32_t cells = levels.total_cells;
    key_.resize(boxes), order_.resize(boxes), first_.resize(cells + 1);
    std::uint64_t* keys = key_.data();
    std::uint32_t* order = order_.data();
    const Box* box = box_.data();
    backend.parallel_for("contact cells", boxes, [=] RINGLET_LAMBDA(std::int32_t k) {
      keys[k] = static_cast<std::uint64_t>(levels.cell_of(box[k])), order[k] = static_cast<std::uint32_t>(k);
    });
    int bits = 1;
    while ((cells - 1) >> bits) ++bits;
    backend.sort("sort contacts", key_, order_, boxes, bits);
    std::int32_t* first = first_.data();
    const std::uint64_t* sorted = key_.data();
    backend.parallel_for("contact cell starts", boxes + 1, [=] RINGLET_LAMBDA(std::int32_t k) {
      const std::int32_t here = k < boxes ? static_cast<std::int32_t>(sorted[k]) : cells;
      for (std::int32_t cell = k == 0 ? 0 : static_cast<std::int32_t>(sorted[k - 1]) + 1; cell <= here;
           ++cell)
        first[cell] = k;
    });
  }

  void gather(Backend& backend, std::int32_t boxes) {
    // Whole blocks, for packs read past the end.
    const std::int32_t room = (boxes + BoxTable::kBlock - 1) / BoxTable::kBlock * BoxTable::kBlock;
    piece_.resize(room), corners_.resize(static_cast<std::size_t>(room) * BoxTable::kCorners);
    float* corners = corners_.data();
    Piece* pieces = piece_.data();
    const Piece* cut = cut_.data();
    const std::uint32_t* order = order_.data();
    const Box* box = box_.data();
    backend.parallel_for("gather boxes", room, [=] RINGLET_LAMBDA(std::int32_t k) {
      const std::uint32_t from = k < boxes ? order[k] : 0;
      if (k < boxes) pieces[k] = cut[from];
      for (int c = 0; c < 3; ++c) {
        corners[BoxTable::at(c, k)] = k < boxes ? box[from].low[c] : 3e38f;
        corners[BoxTable::at(3 + c, k)] = k < boxes ? box[from].high[c] : -3e38f;
      }
    });
  }

  Buffer<std::int32_t> start_, first_;
  Buffer<Piece> cut_, piece_;
  Buffer<Box> box_;
  Buffer<std::uint64_t> key_;
  Buffer<std::uint32_t> order_;
  Buffer<float> corners_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
