// Two segments by brute force, in double: their distance, and when they have passed through one another.
#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <array>

namespace ringlet::oracle {

// a's begin and end, b's begin and end.
using SegmentEnds = std::array<Eigen::Vector3d, 4>;

// Ends that move on straight lines.
struct SegmentMotion {
  SegmentEnds start, end;

  SegmentEnds after(double share) const {
    SegmentEnds ends;
    for (int k = 0; k < 4; ++k) ends[k] = start[k] + share * (end[k] - start[k]);
    return ends;
  }
};

// Where the lines of two segments are closest, as shares of a and b.
inline Eigen::Vector2d closest_on_lines(const SegmentEnds& e) {
  Eigen::Matrix<double, 3, 2> lines;
  lines << e[1] - e[0], e[2] - e[3];
  return lines.colPivHouseholderQr().solve(e[2] - e[0]);
}

inline double point_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& begin,
                               const Eigen::Vector3d& end) {
  const Eigen::Vector3d along = end - begin;
  const double length2 = along.squaredNorm();
  const double s = length2 > 0 ? std::clamp(along.dot(p - begin) / length2, 0.0, 1.0) : 0;
  return (begin + s * along - p).norm();
}

// Between the insides where the lines' closest points are inside, or from an end.
inline double segment_distance(const SegmentEnds& e) {
  double best = std::min({point_to_segment(e[0], e[2], e[3]), point_to_segment(e[1], e[2], e[3]),
                          point_to_segment(e[2], e[0], e[1]), point_to_segment(e[3], e[0], e[1])});
  const Eigen::Vector2d at = closest_on_lines(e);
  if (at.minCoeff() >= 0 && at.maxCoeff() <= 1)
    best = std::min(best, (e[0] + at[0] * (e[1] - e[0]) - e[2] - at[1] * (e[3] - e[2])).norm());
  return best;
}

inline double tetrahedron_volume(const SegmentEnds& e) {
  return (e[2] - e[0]).dot((e[1] - e[0]).cross(e[3] - e[2]));
}

struct SegmentCrossings {
  int count = 0;
  int sides = 0;      // from below, where the volume is negative, less those from above
  double last = 0;    // share of the motion, of the last
  bool clear = true;  // no end was so near that it decides
};

// By small steps: the volume changes sign while the lines' closest points are within both segments.
inline SegmentCrossings segment_crossings(const SegmentMotion& motion, int steps) {
  SegmentCrossings found;
  double before = tetrahedron_volume(motion.start);
  for (int k = 1; k <= steps; ++k) {
    const SegmentEnds e = motion.after(static_cast<double>(k) / steps);
    const double now = tetrahedron_volume(e);
    if ((now < 0) != (before < 0)) {
      const Eigen::Vector2d at = closest_on_lines(e);
      const double inside = std::min(at.minCoeff(), 1 - at.maxCoeff());
      if (std::abs(inside) < 0.02) found.clear = false;
      if (inside > 0) ++found.count, found.sides += before < 0 ? 1 : -1, found.last = (k - 0.5) / steps;
    }
    before = now;
  }
  return found;
}

}  // namespace ringlet::oracle
