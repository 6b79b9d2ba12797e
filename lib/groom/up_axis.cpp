#include "groom/up_axis.h"

namespace ringlet::groom {

Mat3 up_rotation(scene::Axis from, scene::Axis to) {
  if (from == to) return Mat3::Identity();
  const Vec3 source = Vec3::Unit(static_cast<int>(from)), target = Vec3::Unit(static_cast<int>(to));
  const Vec3 axis = source.cross(target);
  return axis * axis.transpose() + target * source.transpose() - source * target.transpose();
}

}  // namespace ringlet::groom
