// Vectors, poses and triangle meshes on the host side, in double precision. Metres and scene axes throughout.
#pragma once
#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace ringlet {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Quat = Eigen::Quaterniond;
using Triangle = std::array<std::int32_t, 3>;

// A rigid pose: x = rotation * local + position.
struct Pose {
  Mat3 rotation = Mat3::Identity();
  Vec3 position = Vec3::Zero();
};

}  // namespace ringlet
