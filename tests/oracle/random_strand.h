// Random strands in general position, and the measure of a linear solve, for comparing kernels with the
// reference.
#pragma once
#include <random>

#include "oracle/ams_reference.h"

namespace ringlet::oracle {

struct RandomStrand {
  Strand strand;
  State state;
  Step step;
};

inline Points random_points(std::mt19937& generator, int count, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  Points points(3, count);
  for (double& value : points.reshaped()) value = uniform(generator);
  return points;
}

inline RootPose random_pose(std::mt19937& generator, double angle, double distance) {
  const Points axis = random_points(generator, 2, 1);
  return {Eigen::AngleAxisd(angle, axis.col(0).normalized()).toRotationMatrix(), distance * axis.col(1)};
}

// A strand of `count` particles, segments of about a centimetre, equal masses, stiffness varying by particle,
// drag, damping and preload; stretched and bent by some 20 %, moving, its root frame turning and travelling
// in the step. Clamped particles sit on their ghosts.
inline RandomStrand random_strand(std::mt19937& generator, int count, int clamped) {
  std::uniform_real_distribution<double> uniform(0.5, 1.5);
  Points rest = Points::Zero(3, count);
  for (int i = 1; i < count; ++i)
    rest.col(i) = rest.col(i - 1) + Vec3(0.01, 0, 0) + random_points(generator, 1, 0.005);
  Strand strand = make_strand(rest, {}, 1);
  for (auto* stiffness : {&strand.edge, &strand.bend, &strand.twist, &strand.integrity, &strand.angular}) {
    for (double& value : *stiffness) value *= uniform(generator);
  }
  strand.drag = uniform(generator);
  strand.damping = uniform(generator) / 60;
  strand.clamped = clamped;
  RandomStrand random{strand, {}, {random_pose(generator, 1, 0.1), {}, 1.0 / 240}};
  const RootPose turn = random_pose(generator, 0.02, 0.002);
  random.step.after = {turn.rotation * random.step.before.rotation, random.step.before.root + turn.root};
  preload_gravity(random.strand, random.step.before);
  random.state = rest_state(strand, random.step.before);
  for (int i = clamped; i < count; ++i) random.state.position.col(i) += random_points(generator, 1, 0.002);
  random.state.velocity = random_points(generator, count, 0.5);
  return random;
}

// |b - A x| / (|A| |x| + |b|) in the infinity norm: the normwise backward error of a computed solution of A x
// = b.
inline double backward_error(const LinearSystem& system, const Eigen::VectorXd& x) {
  if (x.size() == 0) return 0;
  const double matrix = system.matrix.cwiseAbs().rowwise().sum().maxCoeff();
  const Eigen::VectorXd residual = system.rhs - system.matrix * x;
  const double scale = matrix * x.lpNorm<Eigen::Infinity>() + system.rhs.lpNorm<Eigen::Infinity>();
  return residual.lpNorm<Eigen::Infinity>() / scale;
}

}  // namespace ringlet::oracle
