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

// How far each segment has turned, in the world; identity up to the first that the comb reaches. The first
// `held` particles are prescribed: the segments between them stay.
std::vector<Quat> comb_turns(const std::vector<Vec3>& position, const Track& track, const scene::Comb& by,
                             std::size_t held) {
  std::vector<Quat> turns;
  Quat carried = Quat::Identity();
  Vec3 from = position.front();
  bool turned = false;
  for (std::size_t i = 0; i + 1 < position.size(); ++i) {
    const Vec3 segment = position[i + 1] - position[i];
    const double length = segment.norm();
    Vec3 direction = length > 0 ? Vec3(carried * (segment / length)) : Vec3::Zero();
    const auto [along, distance] = track.nearest(from);
    const Vec3 towards = track.at(along + length) - from;
    if (i + 1 >= held && distance < by.radius && length > 0 && towards.squaredNorm() > 0) {
      const double falloff = 1 - distance * distance / (by.radius * by.radius);
      const double strength = by.strength * falloff * falloff;
      if (strength > 0) {
        const Quat turn = turn_part(direction, towards.normalized(), strength);
        direction = (turn * direction).normalized();
        carried = (turn * carried).normalized();
        turned = true;
      }
    }
    turns.push_back(carried);
    // As it was, to the last bit, up to where it first turns.
    from = turned ? Vec3(from + length * direction) : position[i + 1];
  }
  return turned ? turns : std::vector<Quat>();
}

}  // namespace

bool comb(EditedStrand& strand, const scene::Comb& by) {
  const Track track(by.curve);
  if (track.empty()) return false;
  const std::vector<Quat> turns = comb_turns(strand.position, track, by, strand.held);
  if (turns.empty()) return false;
  // The rest shape's segments turn as those of the present shape did: what the strand bears, its weight or a
  // wind, is not combed into it.
  const Quat root(strand.rotation);
  std::vector<Vec3> rest = {strand.rest.front()};
  bool turned = false;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    turned = turned || turns[i].vec() != Vec3::Zero();
    const Vec3 segment = strand.rest[i + 1] - strand.rest[i];
    const Vec3 combed = root.conjugate() * (turns[i] * (root * segment));
    const double size = combed.norm();
    rest.push_back(!turned    ? strand.rest[i + 1]
                   : size > 0 ? Vec3(rest.back() + (segment.norm() / size) * combed)
                              : rest.back());
  }
  strand.rest = std::move(rest);
  return true;
}

}  // namespace ringlet::groom
