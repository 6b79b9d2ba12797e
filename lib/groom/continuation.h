// How a strand would go on past its tip. Private to the room.
#pragma once
#include <span>
#include <vector>

#include "core/geometry.h"

namespace ringlet::groom {

// The strand's last directions at even steps, each new one that of a few steps before, turned by the rotation
// that best takes the last directions to those a few steps later. For a helix, an arc or a line that rotation
// does exactly. From step to step it would do for them too, but for real curls, some four steps a turn and
// uneven, it is far less certain.
class Continuation {
 public:
  // `points` have a length; the last segment is one of the steps.
  Continuation(std::span<const Vec3> points, double step);

  // Unit direction of the next step.
  Vec3 next();

 private:
  std::vector<Vec3> directions_;
  std::size_t lag_;          // the few steps
  Mat3 turn_;                // over them
  Eigen::AngleAxisd joint_;  // from the direction foretold for the last step to what it is
  std::size_t joined_ = 0;   // steps made of the first few, over which the joint fades
};

}  // namespace ringlet::groom
