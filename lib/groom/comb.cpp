#include <algorithm>
#include <cmath>
#include <limits>

#include "groom/edit_operations.h"

namespace ringlet::groom {
namespace {

// A polyline by the length along it; past its end it goes straight on.
class Track {
 public:
  explicit Track(const std::vector<Vec3>& points) {
    double length = 0;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const Vec3 way = points[i + 1] - points[i];
      const double segment = way.norm();
      if (!(segment > 0)) continue;
      pieces_.push_back({points[i], way / segment, length, segment});
      length += segment;
    }
  }

  bool empty() const { return pieces_.empty(); }

  struct Nearest {
    double along, distance;  // beyond the end `along` goes on, the distance is to the end
  };
  Nearest nearest(const Vec3& point) const {
    Nearest nearest{0, std::numeric_limits<double>::infinity()};
    for (const Piece& piece : pieces_) {
      const double ahead = (point - piece.from).dot(piece.direction);
      const double along = std::clamp(ahead, 0.0, piece.length);
      const double distance = (piece.from + along * piece.direction - point).norm();
      const bool is_last = &piece == &pieces_.back();
      if (distance < nearest.distance)
        nearest = {piece.start + (is_last ? std::max(ahead, 0.0) : along), distance};
    }
    return nearest;
  }

  Vec3 at(double along) const {
    const auto after = std::upper_bound(pieces_.begin() + 1, pieces_.end(), along,
                                        [](double s, const Piece& piece) { return s < piece.start; });
    const Piece& piece = *(after - 1);
    return piece.from + (along - piece.start) * piece.direction;
  }

 private:
  struct Piece {
    Vec3 from, direction;
    double start, length;
  };
  std::vector<Piece> pieces_;
};

// The rotation by this fraction of the way from one unit vector to another.
Quat turn_part(const Vec3& from, const Vec3& to, double fraction) {
  const Eigen::AngleAxisd whole(Quat::FromTwoVectors(from, to));
  return Quat(Eigen::AngleAxisd(fraction * whole.angle(), whole.axis()));
}

// The combed shape's unit directions, and whether any differs from the present.
struct Combed {
  std::vector<Vec3> directions;
  bool turned = false;
};

Combed comb_shape(const std::vector<Vec3>& position, const Track& track, const scene::Comb& by) {
  Combed combed;
  Quat carried = Quat::Identity();
  Vec3 from = position.front();
  for (std::size_t i = 0; i + 1 < position.size(); ++i) {
    const Vec3 segment = position[i + 1] - position[i];
    const double length = segment.norm();
    Vec3 direction = length > 0 ? Vec3(carried * (segment / length)) : Vec3::Zero();
    const auto [along, distance] = track.nearest(from);
    const Vec3 towards = track.at(along + length) - from;
    if (distance < by.radius && length > 0 && towards.squaredNorm() > 0) {
      const double falloff = 1 - distance * distance / (by.radius * by.radius);
      const double strength = by.strength * falloff * falloff;
      if (strength > 0) {
        const Quat turn = turn_part(direction, towards.normalized(), strength);
        direction = (turn * direction).normalized();
        carried = (turn * carried).normalized();
        combed.turned = true;
      }
    }
    combed.directions.push_back(direction);
    // As it was, to the last bit, up to where it first turns.
    from = combed.turned ? Vec3(from + length * direction) : position[i + 1];
  }
  return combed;
}

}  // namespace

bool comb(EditedStrand& strand, const scene::Comb& by) {
  const Track track(by.curve);
  if (track.empty()) return false;
  const Combed combed = comb_shape(strand.position, track, by);
  if (!combed.turned) return false;
  std::vector<Vec3> rest = {strand.rest.front()};
  for (std::size_t i = 0; i < combed.directions.size(); ++i) {
    const double length = (strand.rest[i + 1] - strand.rest[i]).norm();
    rest.push_back(rest.back() + length * (strand.rotation.transpose() * combed.directions[i]));
  }
  strand.rest = std::move(rest);
  return true;
}

}  // namespace ringlet::groom
