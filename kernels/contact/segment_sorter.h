// Sorts segments into a table.
#pragma once
#include "kernels/contact/motion_field.h"
#include "kernels/contact/segment_table.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// How far along their ways segments are looked for.
struct SweptSegments {
  HairExtent extent;
  const Place<float>* carried;  // see MotionField
  bool from_anywhere;           // tubes hold the start and what is about it, whatever the way
  float slope;                  // of the mean motion [-]
  float farthest;               // along a segment's way against the mean motion [m]

  // How far apart from the start on two can have been that meet: each went `farthest`, and the mean motion
  // carried them there from places between which it differs by its slope times that. Half of it [m].
  RINGLET_KERNEL float along_both() const { return farthest / (1 - gentle_slope()); }
  RINGLET_KERNEL float gentle_slope() const { return min(slope, 0.9f); }
};

// F: the pack that tubes are found by.
template <class Backend, class F, class T>
class SegmentSorter {
 public:
  // Of the segments that counts(segment) is true for. Holds until the next call.
  template <class Counts>
  SegmentTable<T> sort(Backend& backend, const HairPlaces<T>& places, const SweptSegments& swept,
                       const Counts& counts) {
    SegmentTable<T> table{};
    table.segments = pick(backend, places, swept, counts);
    place_in_cells(backend, places, swept, table.segments);
    table.levels = find_levels(backend, swept.extent, table.segments);
    sort_cells(backend, table.levels, table.segments);
    gather(backend, places, swept, table.segments);
    table.first = first_.data(), table.segment = segment_.data(), table.key = key_.data();
    table.places = places_.data(), table.tubes = tubes_.data();
    return table;
  }

  std::size_t bytes() const {
    return start_.bytes() + picked_.bytes() + segment_.bytes() + cell_place_.bytes() + key_.bytes() +
           order_.bytes() + first_.bytes() + places_.bytes() + tubes_.bytes();
  }

 private:
  template <class V>
  using Buffer = typename Backend::template Buffer<V>;

  // Returns how many segments there are.
  template <class Counts>
  std::int32_t pick(Backend& backend, const HairPlaces<T>& places, const SweptSegments& swept,
                    const Counts& counts) {
    const std::int32_t particles = places.particles;
    start_.resize(particles + 1);
    std::int32_t* start = start_.data();
    const Place<float>* carried = swept.carried;
    backend.parallel_for("count segments", particles + 1, [=] RINGLET_LAMBDA(std::int32_t p) {
      start[p] = 0;
      if (p == particles || places.strand[p] < 0 || !counts(p)) return;
      const Vector3<float> end = float_vector(places.end[p]), along = float_vector(places.end[p + 1]) - end,
                           from = vector_of(carried[p]), then = vector_of(carried[p + 1]) - from;
      const bool lost = !(dot(end, end) + dot(along, along) + dot(from, from) + dot(then, then) < 1e12f) ||
                        !(thickest(places.end, p) < T(1e6));
      if (!lost) start[p] = 1;
    });
    const std::int32_t all = backend.scan("start segments", start_, particles + 1);
    picked_.resize(all);
    std::int32_t* picked = picked_.data();
    backend.parallel_for("pick segments", particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      if (start[p] < start[p + 1]) picked[start[p]] = p;
    });
    return all;
  }

  struct MovedSegment {
    Vector3<float> begin[2], end[2];
    float margin;
  };
  // A segment at the start, carried along with the mean motion, and where it is when it has gone
  // `farthest` from there, or at the end; or else at the start, and `farthest` about it.
  RINGLET_FUNCTION static MovedSegment place(const HairPlaces<T>& places, const SweptSegments& swept,
                                             std::int32_t p) {
    const float near =
        static_cast<float>(kNear) * static_cast<float>(thickest(places.end, p)) + swept.carried[p].extra;
    if (swept.from_anywhere) {
      const Vector3<float> begin = float_vector(places.start[p]), end = float_vector(places.start[p + 1]);
      return {{begin, begin}, {end, end}, near + swept.along_both()};
    }
    const Segment<float> first{vector_of(swept.carried[p]), vector_of(swept.carried[p + 1])};
    const Vector3<float> begin_way = float_vector(places.end[p]) - first.begin,
                         end_way = float_vector(places.end[p + 1]) - first.end;
    const float way = max(length(begin_way), length(end_way));
    const float share = way > swept.farthest ? swept.farthest / way : 1.0f;
    return {{first.begin, fma(share, begin_way, first.begin)},
            {first.end, fma(share, end_way, first.end)},
            near + swept.gentle_slope() / (1 - swept.gentle_slope()) * share * way};
  }

  struct CellPlace {
    float centre[3], half_size;
    int axis;
  };
  RINGLET_FUNCTION static CellPlace cell_place(const MovedSegment& segment) {
    CellPlace at{{}, 0, 0};
    float longest = -1;
    for (int c = 0; c < 3; ++c) {
      const auto along = [=](const Vector3<float>& corner) { return (&corner.x)[c]; };
      const float ends[4] = {along(segment.begin[0]), along(segment.begin[1]), along(segment.end[0]),
                             along(segment.end[1])};
      const float low = min(min(ends[0], ends[1]), min(ends[2], ends[3])),
                  high = max(max(ends[0], ends[1]), max(ends[2], ends[3]));
      at.centre[c] = 0.5f * (low + high);
      at.half_size = max(at.half_size, 0.5f * (high - low) + segment.margin);
      const float way = abs(ends[2] + ends[3] - ends[0] - ends[1]);
      if (way > longest) longest = way, at.axis = c;
    }
    return at;
  }

  void place_in_cells(Backend& backend, const HairPlaces<T>& places, const SweptSegments& swept,
                      std::int32_t segments) {
    cell_place_.resize(segments);
    CellPlace* cell_place = cell_place_.data();
    const std::int32_t* picked = picked_.data();
    backend.parallel_for("place segments", segments, [=] RINGLET_LAMBDA(std::int32_t k) {
      cell_place[k] = SegmentSorter::cell_place(place(places, swept, picked[k]));
    });
  }

  // From the largest of those on that are about as large as most: by a mean that a few large ones do not
  // matter to.
  BoxLevels find_levels(Backend& backend, const HairExtent& extent, std::int32_t segments) {
    const CellPlace* place = cell_place_.data();
    const double per_size = backend.sum("contact sizes", segments, [=] RINGLET_LAMBDA(std::int32_t k) {
      const float half = place[k].half_size;
      return half > 0 ? 1 / static_cast<double>(half) : 0.0;
    });
    const double most = per_size > 0 ? 1.5 * segments / per_size : 1;
    const double first =
        backend.largest("contact sizes", segments, 0.5 * most, [=] RINGLET_LAMBDA(std::int32_t k) {
          const auto half = static_cast<double>(place[k].half_size);
          return half <= most ? half : 0.0;
        });
    return BoxLevels::make(extent.low, extent.high, static_cast<float>(first), segments);
  }

  void sort_cells(Backend& backend, const BoxLevels& levels, std::int32_t segments) {
    const std::int32_t cells = levels.total_cells;
    key_.resize(segments), order_.resize(segments), first_.resize(cells + 1);
    std::uint64_t* keys = key_.data();
    std::uint32_t* order = order_.data();
    const CellPlace* place = cell_place_.data();
    backend.parallel_for("contact cells", segments, [=] RINGLET_LAMBDA(std::int32_t k) {
      keys[k] = SegmentTable<T>::key_of(levels.cell_of(place[k].centre, place[k].half_size), place[k].axis);
      order[k] = static_cast<std::uint32_t>(k);
    });
    int bits = 3;
    while ((cells - 1) >> (bits - 2)) ++bits;
    backend.sort("sort contacts", key_, order_, segments, bits);
    std::int32_t* first = first_.data();
    const std::uint64_t* sorted = key_.data();
    backend.parallel_for("contact cell starts", segments + 1, [=] RINGLET_LAMBDA(std::int32_t k) {
      const std::int32_t here = k < segments ? SegmentTable<T>::cell_of(sorted[k]) : cells;
      for (std::int32_t cell = k == 0 ? 0 : SegmentTable<T>::cell_of(sorted[k - 1]) + 1; cell <= here; ++cell)
        first[cell] = k;
    });
  }

  void gather(Backend& backend, const HairPlaces<T>& places, const SweptSegments& swept,
              std::int32_t segments) {
    using Table = SegmentTable<T>;
    constexpr int kWidth = Traits<F>::kWidth, kPackChunk = 128;
    // Whole blocks, for packs read past the end.
    const std::int32_t room = (segments + Table::kBlock - 1) / Table::kBlock * Table::kBlock;
    segment_.resize(room), places_.resize(room);
    tubes_.resize(static_cast<std::size_t>(room) * 3 * Table::kNumbers);
    float* tubes = tubes_.data();
    std::int32_t* segment = segment_.data();
    SegmentPlaces<T>* known = places_.data();
    const std::int32_t* picked = picked_.data();
    const std::uint32_t* order = order_.data();
    const bool still = swept.from_anywhere;
    backend.parallel_for(
        "gather segments", room / kWidth,
        [=] RINGLET_LAMBDA(std::int32_t pack) {
          alignas(64) float lanes[13][kWidth];
          for (int lane = 0; lane < kWidth; ++lane) {
            const std::int32_t k = pack * kWidth + lane, p = picked[order[k < segments ? k : segments - 1]];
            segment[k] = p;
            known[k] = {{places.start[p], places.start[p + 1]}, {places.end[p], places.end[p + 1]}};
            known[k].start.begin.extra = SegmentPlaces<T>::number_of(places.strand[p]);
            const MovedSegment at = place(places, swept, p);
            const Vector3<float>* corners[4] = {&at.begin[0], &at.begin[1], &at.end[0], &at.end[1]};
            for (int corner = 0; corner < 4; ++corner)
              for (int c = 0; c < 3; ++c) lanes[3 * corner + c][lane] = (&corners[corner]->x)[c];
            lanes[12][lane] = at.margin;
          }
          const auto corner = [&](int which) { return load3<F>(lanes[3 * which], kWidth); };
          const F margin = load<F>(lanes[12]);
          for (int axis = 0; axis < 3; ++axis) {
            float* to = tubes + Table::tube(pack * kWidth, axis);
            const Tube<F> tube = still ? Tube<F>::template about<1>({corner(0)}, {corner(2)}, margin, axis)
                                       : Tube<F>::template about<2>({corner(0), corner(1)},
                                                                    {corner(2), corner(3)}, margin, axis);
            for_numbers(tube, [=](int k, F number) { store(to + k * Table::kBlock, number); });
          }
        },
        kPackChunk);
  }

  Buffer<std::int32_t> start_, first_, picked_, segment_;
  Buffer<CellPlace> cell_place_;
  Buffer<SegmentPlaces<T>> places_;
  Buffer<std::uint64_t> key_;
  Buffer<std::uint32_t> order_;
  Buffer<float> tubes_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
