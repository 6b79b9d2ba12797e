#include "solids/rigid_fit.h"

namespace ringlet::solids {

Pose fit_pose(std::span<const Vec3> from, std::span<const Vec3> to) {
  Vec3 from_mean = Vec3::Zero(), to_mean = Vec3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) from_mean += from[i], to_mean += to[i];
  from_mean /= static_cast<double>(from.size());
  to_mean /= static_cast<double>(from.size());
  Mat3 covariance = Mat3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i)
    covariance += (to[i] - to_mean) * (from[i] - from_mean).transpose();
  const Eigen::JacobiSVD<Mat3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handedness = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  Pose pose;
  pose.rotation = svd.matrixU() * Vec3(1, 1, handedness).asDiagonal() * svd.matrixV().transpose();
  pose.position = to_mean - pose.rotation * from_mean;
  return pose;
}

}  // namespace ringlet::solids
