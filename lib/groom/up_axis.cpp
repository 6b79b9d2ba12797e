#include "groom/up_axis.h"

namespace ringlet::groom {

namespace {
// Rows are the y-up axes in axes with `up` up.
Mat3 to_y_up(scene::Axis up) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  Mat3 turn = Mat3::Identity();
  if (up == scene::Axis::kX) turn.transpose() << -y, x, z;
  if (up == scene::Axis::kZ) turn.transpose() << x, z, -y;
  return turn;
}
}  // namespace

Mat3 up_rotation(scene::Axis from, scene::Axis to) { return to_y_up(to).transpose() * to_y_up(from); }

}  // namespace ringlet::groom
