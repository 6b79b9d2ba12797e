#include "groom/continuation.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace ringlet::groom {
namespace {

constexpr std::size_t kTail = 8;    // last steps that tell how the strand goes on
constexpr std::size_t kLag = 3;     // steps that a turn is measured over
constexpr double kRounding = 1e-9;  // of a step: so little short of one is one

// Points at even steps along the polyline, the tip first.
std::vector<Vec3> steps_back(std::span<const Vec3> points, double step) {
  std::vector<Vec3> samples = {points.back()};
  double before = 0;  // length from the tip to the near end of the segment
  for (std::size_t i = points.size() - 1; i > 0; --i) {
    const double length = (points[i - 1] - points[i]).norm();
    while (samples.size() <= kTail) {
      const double into = static_cast<double>(samples.size()) * step - before;
      if (!(length > 0) || into > length + kRounding * step) break;
      samples.push_back(points[i] + std::min(1.0, into / length) * (points[i - 1] - points[i]));
    }
    before += length;
  }
  return samples;
}

std::vector<Vec3> directions_of(std::span<const Vec3> points, double step) {
  const std::vector<Vec3> samples = steps_back(points, step);
  std::vector<Vec3> directions;
  for (std::size_t i = samples.size() - 1; i > 0; --i) {
    const Vec3 way = samples[i - 1] - samples[i];
    if (way.norm() > 0) directions.push_back(way.normalized());
  }
  if (directions.empty()) directions.push_back((points.back() - points[points.size() - 2]).normalized());
  return directions;
}

// The rotation that best takes each direction to the one `lag` steps later (Kabsch 1976).
Mat3 turn_over(const std::vector<Vec3>& directions, std::size_t lag) {
  if (directions.size() <= lag) return Mat3::Identity();
  if (directions.size() == lag + 1)
    return Quat::FromTwoVectors(directions.front(), directions.back()).toRotationMatrix();
  Mat3 products = Mat3::Zero();
  for (std::size_t i = 0; i + lag < directions.size(); ++i)
    products += directions[i + lag] * directions[i].transpose();
  const Eigen::JacobiSVD<Mat3> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Mat3 &u = svd.matrixU(), &v = svd.matrixV();
  const double handed = u.determinant() * v.determinant() < 0 ? -1 : 1;
  return u * Vec3(1, 1, handed).asDiagonal() * v.transpose();
}

}  // namespace

Continuation::Continuation(std::span<const Vec3> points, double step)
    : directions_(directions_of(points, step)),
      lag_(std::clamp<std::size_t>(directions_.size() / 2, 1, kLag)),
      turn_(turn_over(directions_, lag_)),
      joint_(Eigen::AngleAxisd::Identity()) {
  if (directions_.size() > lag_)
    joint_ = Quat::FromTwoVectors(turn_ * directions_[directions_.size() - 1 - lag_], directions_.back());
}

Vec3 Continuation::next() {
  Vec3 direction = turn_ * directions_[directions_.size() - lag_];
  if (joined_ < lag_) {
    const double share = 1 - static_cast<double>(joined_) / static_cast<double>(lag_);
    direction = Eigen::AngleAxisd(share * joint_.angle(), joint_.axis()) * direction;
    ++joined_;
  }
  directions_.push_back(direction.normalized());
  return directions_.back();
}

}  // namespace ringlet::groom
