#include "oracle/mass_spring_reference.h"

namespace ringlet::oracle {
namespace {

// The corners of each altitude: a point and its face, or two edges.
constexpr int kCorners[7][4] = {{0, 1, 2, 3}, {1, 2, 3, 0}, {2, 3, 0, 1}, {3, 0, 1, 2},
                                {0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2}};

double stiffness(const MassSpringChain& chain, int node, int span) {
  if (span == 3) return chain.twist[node / 2];
  return (span == 2 && node % 2 == 1 ? chain.bend : chain.edge)[node / 2];
}

double altitude_length(const Points& x, int which) {
  const int* k = kCorners[which];
  const Vec3 a = x.col(k[0]), b = x.col(k[1]), c = x.col(k[2]), d = x.col(k[3]);
  if (which < 4) return (c - b).cross(d - b).normalized().dot(a - b);
  return (b - a).cross(d - c).normalized().dot(c - a);
}

}  // namespace

ReferenceAltitude altitude(const Points& four, int which) {
  // Feet by least squares: the point of the face, or the points of both lines, nearest to the other end.
  ReferenceAltitude result{which, altitude_length(four, which), {}};
  const int* k = kCorners[which];
  const Vec3 a = four.col(k[0]), b = four.col(k[1]), c = four.col(k[2]), d = four.col(k[3]);
  Eigen::Matrix<double, 3, 2> span;
  if (which < 4) {
    span << c - b, d - b;
    const Eigen::Vector2d uv = span.colPivHouseholderQr().solve(a - b);
    const Vec3 n = (c - b).cross(d - b).normalized();
    result.gradient[k[0]] = n;
    result.gradient[k[1]] = -(1 - uv[0] - uv[1]) * n;
    result.gradient[k[2]] = -uv[0] * n;
    result.gradient[k[3]] = -uv[1] * n;
  } else {
    span << b - a, c - d;
    const Eigen::Vector2d st = span.colPivHouseholderQr().solve(c - a);
    const Vec3 n = (b - a).cross(d - c).normalized();
    result.gradient[k[0]] = -(1 - st[0]) * n;
    result.gradient[k[1]] = -st[0] * n;
    result.gradient[k[2]] = (1 - st[1]) * n;
    result.gradient[k[3]] = st[1] * n;
  }
  return result;
}

ReferenceAltitude shortest_altitude(const Points& four) {
  int best = 0;
  for (int which = 1; which < 7; ++which)
    if (std::abs(altitude_length(four, which)) < std::abs(altitude_length(four, best))) best = which;
  return altitude(four, best);
}

std::vector<int> chosen_altitudes(const Points& x) {
  std::vector<int> chosen;
  for (int node = 0; node + 3 < x.cols(); ++node)
    chosen.push_back(shortest_altitude(x.middleCols(node, 4)).which);
  return chosen;
}

double energy(const MassSpringChain& chain, const Points& x, const std::vector<int>& chosen) {
  double sum = 0;
  for (int node = 0; node < chain.nodes(); ++node)
    for (int span = 1; span <= 3 && node + span < chain.nodes(); ++span) {
      const double rest = (chain.rest.col(node + span) - chain.rest.col(node)).norm();
      const double stretch = (x.col(node + span) - x.col(node)).norm() - rest;
      sum += 0.5 * stiffness(chain, node, span) * stretch * stretch;
    }
  for (int node = 0; node + 3 < chain.nodes(); ++node) {
    const double now = altitude_length(x.middleCols(node, 4), chosen[node]);
    const double rest = altitude_length(chain.rest.middleCols(node, 4), chosen[node]);
    sum += 0.5 * chain.twist[node / 2] * (now - rest) * (now - rest);
  }
  return sum;
}

Points force(const MassSpringChain& chain, const Points& x, const std::vector<int>& chosen) {
  Points sum = Points::Zero(3, chain.nodes());
  for (int node = 0; node < chain.nodes(); ++node)
    for (int span = 1; span <= 3 && node + span < chain.nodes(); ++span) {
      const double rest = (chain.rest.col(node + span) - chain.rest.col(node)).norm();
      const Vec3 way = x.col(node + span) - x.col(node);
      const Vec3 pull = stiffness(chain, node, span) * (way.norm() - rest) * way.normalized();
      sum.col(node) += pull, sum.col(node + span) -= pull;
    }
  for (int node = 0; node + 3 < chain.nodes(); ++node) {
    const ReferenceAltitude now = altitude(x.middleCols(node, 4), chosen[node]);
    const double rest = altitude_length(chain.rest.middleCols(node, 4), chosen[node]);
    for (int k = 0; k < 4; ++k)
      sum.col(node + k) -= chain.twist[node / 2] * (now.length - rest) * now.gradient[k];
  }
  return sum;
}

LinearSystem assemble(const MassSpringChain& chain, const State& state, const Step& step) {
  const int n = chain.nodes(), held = std::min(chain.clamped, n);
  const Points& x = state.position;
  const double h = step.h;
  Eigen::MatrixXd stiff = Eigen::MatrixXd::Zero(3 * n, 3 * n), geometric = stiff;
  for (int node = 0; node < n; ++node)
    for (int span = 1; span <= 3 && node + span < n; ++span) {
      const double rest = (chain.rest.col(node + span) - chain.rest.col(node)).norm();
      const Vec3 way = x.col(node + span) - x.col(node);
      const Mat3 along = way.normalized() * way.normalized().transpose();
      const double kappa = stiffness(chain, node, span);
      const Mat3 turning = kappa * std::max(0.0, 1 - rest / way.norm()) * (Mat3::Identity() - along);
      for (const int i : {node, node + span})
        for (const int j : {node, node + span}) {
          stiff.block<3, 3>(3 * i, 3 * j) += (i == j ? 1 : -1) * kappa * along;
          geometric.block<3, 3>(3 * i, 3 * j) += (i == j ? 1 : -1) * turning;
        }
    }
  const std::vector<int> chosen = chosen_altitudes(x);
  for (int node = 0; node + 3 < n; ++node) {
    const ReferenceAltitude now = altitude(x.middleCols(node, 4), chosen[node]);
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        stiff.block<3, 3>(3 * (node + i), 3 * (node + j)) +=
            chain.twist[node / 2] * now.gradient[i] * now.gradient[j].transpose();
  }
  if (!chain.geometric_stiffness) geometric.setZero();
  Eigen::MatrixXd matrix = h * (h + chain.damping) * stiff + h * h * geometric;
  matrix.diagonal().array() += 1 + h * chain.drag;
  const Points forces = force(chain, x, chosen).colwise() + chain.gravity;
  Eigen::VectorXd rhs = (state.velocity + h * forces).reshaped();
  // The clamped nodes' velocities are known.
  const auto place = [&](const RootPose& pose, int node) -> Vec3 {
    return pose.rotation * chain.rest.col(node) + pose.root;
  };
  for (int node = 0; node < held; ++node)
    rhs -= matrix.middleCols(3 * node, 3) * ((place(step.after, node) - place(step.before, node)) / h);
  const int free = 3 * (n - held);
  return {matrix.bottomRightCorner(free, free), rhs.tail(free)};
}

}  // namespace ringlet::oracle
