#include "oracle/ams_reference.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace ringlet::oracle {
namespace {

struct Spring {
  int i, j;
  double stiffness, rest_length;
};

std::vector<Spring> springs(const Strand& strand) {
  std::vector<Spring> all;
  const std::vector<double>* stiffness[] = {&strand.edge, &strand.bend, &strand.twist};
  for (int span = 1; span <= 3; ++span) {
    for (int i = 0; i + span < strand.size(); ++i) {
      const double rest_length = (strand.rest.col(i + span) - strand.rest.col(i)).norm();
      all.push_back({i, i + span, (*stiffness[span - 1])[i], rest_length});
    }
  }
  return all;
}

// d d^T of the unit direction of r; zero where r has none.
Mat3 direction_matrix(const Vec3& r) {
  const double length = r.norm();
  if (length == 0) return Mat3::Zero();
  return r * r.transpose() / (length * length);
}

// Adds `block` as the stiffness between particles i and j.
void add_pair(Eigen::MatrixXd& matrix, int i, int j, const Mat3& block) {
  matrix.block<3, 3>(3 * i, 3 * i) += block;
  matrix.block<3, 3>(3 * j, 3 * j) += block;
  matrix.block<3, 3>(3 * i, 3 * j) -= block;
  matrix.block<3, 3>(3 * j, 3 * i) -= block;
}

Eigen::MatrixXd zero_matrix(const Strand& strand) {
  return Eigen::MatrixXd::Zero(3 * strand.size(), 3 * strand.size());
}

Eigen::VectorXd flat(const Points& points) { return points.reshaped(); }
Points unflat(const Eigen::VectorXd& values) { return values.reshaped(3, values.size() / 3); }

// Force and Jacobian share this: the angle between the segment as it is and as its ghost would have it.
double ghost_angle(const Points& x, const Points& y, int i) {
  const Vec3 wanted = y.col(i) - x.col(i - 1);
  const Vec3 actual = x.col(i) - x.col(i - 1);
  return std::atan2(wanted.cross(actual).norm(), wanted.dot(actual));
}

double rest_segment(const Strand& strand, int i) {
  return (strand.rest.col(i) - strand.rest.col(i - 1)).norm();
}

void check(const Strand& strand, const State& state) {
  const auto n = strand.rest.cols();
  if (state.position.cols() != n || state.velocity.cols() != n) {
    throw std::invalid_argument("the state does not have the strand's number of particles");
  }
  if (strand.clamped < 0 || strand.clamped > 2) throw std::invalid_argument("clamped must be 0, 1 or 2");
}

int clamped_count(const Strand& strand) { return std::min(strand.clamped, strand.size()); }

Vec3 unit(const Vec3& r) { return r.norm() > 0 ? Vec3(r / r.norm()) : Vec3(Vec3::Zero()); }

// ---- Inextensibility
// ---------------------------------------------------------------------------------------------

// Segments that the projection restores: with a rest length, a direction, and an end that can move.
std::vector<int> constrained_segments(const Strand& strand, const Points& x) {
  std::vector<int> segments;
  for (int i = 1; i < strand.size(); ++i) {
    const bool movable = i >= clamped_count(strand);
    if (movable && rest_segment(strand, i) > 0 && (x.col(i) - x.col(i - 1)).norm() > 0) segments.push_back(i);
  }
  return segments;
}

// Constraint values l - l_rest and their gradients with respect to the movable particles.
struct Constraints {
  Eigen::VectorXd value;
  Eigen::MatrixXd gradient;
};

Constraints constraints(const Strand& strand, const Points& x, const std::vector<int>& segments) {
  const int clamped = clamped_count(strand);
  const auto rows = static_cast<Eigen::Index>(segments.size());
  Constraints c{Eigen::VectorXd(rows), Eigen::MatrixXd::Zero(rows, 3 * (strand.size() - clamped))};
  for (Eigen::Index row = 0; row < rows; ++row) {
    const int i = segments[row];
    const Vec3 segment = x.col(i) - x.col(i - 1);
    c.value[row] = segment.norm() - rest_segment(strand, i);
    c.gradient.block<1, 3>(row, 3 * (i - clamped)) = unit(segment).transpose();
    if (i - 1 >= clamped) c.gradient.block<1, 3>(row, 3 * (i - 1 - clamped)) = -unit(segment).transpose();
  }
  return c;
}

Eigen::VectorXd movable_masses(const Strand& strand) {
  const int clamped = clamped_count(strand);
  Eigen::VectorXd masses(3 * (strand.size() - clamped));
  for (int i = clamped; i < strand.size(); ++i)
    masses.segment<3>(3 * (i - clamped)).setConstant(strand.mass[i]);
  return masses;
}

// sum_e lambda_e of the second derivative of segment e's length.
Eigen::MatrixXd constraint_curvature(const Strand& strand, const Points& x, const std::vector<int>& segments,
                                     const Eigen::VectorXd& multipliers) {
  Eigen::MatrixXd full = zero_matrix(strand);
  for (size_t row = 0; row < segments.size(); ++row) {
    const int i = segments[row];
    const Vec3 r = x.col(i) - x.col(i - 1);
    add_pair(
        full, i - 1, i,
        multipliers[static_cast<Eigen::Index>(row)] / r.norm() * (Mat3::Identity() - direction_matrix(r)));
  }
  const int movable = 3 * (strand.size() - clamped_count(strand));
  return full.bottomRightCorner(movable, movable);
}

// Whether `hessian` is positive definite on the displacements that the constraints allow to first order.
bool positive_on_kernel(const Eigen::MatrixXd& hessian, const Eigen::MatrixXd& gradient) {
  const Eigen::MatrixXd kernel = gradient.fullPivLu().kernel();
  return Eigen::LLT<Eigen::MatrixXd>(kernel.transpose() * hessian * kernel).info() == Eigen::Success;
}

// Minimiser of pull . d + d . hessian d / 2 subject to value + gradient d = 0.
struct KktStep {
  Eigen::VectorXd displacement, multipliers;
};

KktStep solve_kkt(const Eigen::MatrixXd& hessian, const Constraints& c, const Eigen::VectorXd& pull) {
  const auto n = hessian.rows(), rows = c.value.size();
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + rows, n + rows);
  matrix.topLeftCorner(n, n) = hessian;
  matrix.topRightCorner(n, rows) = c.gradient.transpose();
  matrix.bottomLeftCorner(rows, n) = c.gradient;
  Eigen::VectorXd rhs(n + rows);
  rhs << -pull, -c.value;
  const Eigen::VectorXd solution = matrix.partialPivLu().solve(rhs);
  return {solution.head(n), solution.tail(rows)};
}

}  // namespace

Strand make_strand(const Points& rest, const Stiffness& stiffness, double mass) {
  if (rest.cols() == 0) throw std::invalid_argument("a strand needs a particle");
  const auto n = static_cast<size_t>(rest.cols());
  const auto count = [n](size_t span) { return n > span ? n - span : 0; };
  Strand strand;
  strand.rest = rest.colwise() - Vec3(rest.col(0));
  strand.mass.assign(n, mass);
  strand.edge.assign(count(1), mass * stiffness.edge);
  strand.bend.assign(count(2), mass * stiffness.bend);
  strand.twist.assign(count(3), mass * stiffness.twist);
  strand.integrity.assign(n, mass * stiffness.integrity);
  strand.angular.assign(n, mass * stiffness.angular);
  strand.preload = Points::Zero(3, rest.cols());
  return strand;
}

void preload_gravity(Strand& strand, const RootPose& first) {
  const Vec3 gravity = first.rotation.transpose() * strand.gravity;
  for (int i = 0; i < strand.size(); ++i) {
    strand.preload.col(i).setZero();
    if (strand.integrity[i] > 0) strand.preload.col(i) = -(strand.mass[i] / strand.integrity[i]) * gravity;
  }
}

Points ghost(const Strand& strand, const RootPose& pose) {
  return (pose.rotation * strand.rest).colwise() + pose.root;
}

Points preloaded_ghost(const Strand& strand, const RootPose& pose) {
  return (pose.rotation * (strand.rest + strand.preload)).colwise() + pose.root;
}

Points spring_force(const Strand& strand, const Points& x) {
  Points force = Points::Zero(3, strand.size());
  for (const Spring& s : springs(strand)) {
    const Vec3 r = x.col(s.j) - x.col(s.i);
    const Vec3 f = s.stiffness * (r.norm() - s.rest_length) * unit(r);
    force.col(s.i) += f;
    force.col(s.j) -= f;
  }
  return force;
}

double spring_energy(const Strand& strand, const Points& x) {
  double energy = 0;
  for (const Spring& s : springs(strand)) {
    energy += 0.5 * s.stiffness * std::pow((x.col(s.j) - x.col(s.i)).norm() - s.rest_length, 2);
  }
  return energy;
}

Points integrity_force(const Strand& strand, const Points& x, const RootPose& pose) {
  const Points y = preloaded_ghost(strand, pose);
  Points force(3, strand.size());
  for (int i = 0; i < strand.size(); ++i) force.col(i) = strand.integrity[i] * (y.col(i) - x.col(i));
  return force;
}

double integrity_energy(const Strand& strand, const Points& x, const RootPose& pose) {
  const Points y = preloaded_ghost(strand, pose);
  double energy = 0;
  for (int i = 0; i < strand.size(); ++i)
    energy += 0.5 * strand.integrity[i] * (y.col(i) - x.col(i)).squaredNorm();
  return energy;
}

Points angular_force(const Strand& strand, const Points& x, const RootPose& pose) {
  const Points y = ghost(strand, pose);
  Points force = Points::Zero(3, strand.size());
  for (int i = 1; i < strand.size(); ++i) {
    const double magnitude = strand.angular[i] * rest_segment(strand, i) * ghost_angle(x, y, i);
    force.col(i) = magnitude * unit(y.col(i) - x.col(i));
  }
  return force;
}

Eigen::MatrixXd spring_stiffness(const Strand& strand, const Points& x) {
  Eigen::MatrixXd k = zero_matrix(strand);
  for (const Spring& s : springs(strand)) {
    add_pair(k, s.i, s.j, s.stiffness * direction_matrix(x.col(s.j) - x.col(s.i)));
  }
  return k;
}

Eigen::MatrixXd geometric_stiffness(const Strand& strand, const Points& x) {
  Eigen::MatrixXd k = zero_matrix(strand);
  if (!strand.geometric_stiffness) return k;
  for (const Spring& s : springs(strand)) {
    const Vec3 r = x.col(s.j) - x.col(s.i);
    const double length = r.norm();
    if (length <= s.rest_length) continue;
    add_pair(k, s.i, s.j,
             s.stiffness * (1 - s.rest_length / length) * (Mat3::Identity() - direction_matrix(r)));
  }
  return k;
}

Eigen::MatrixXd integrity_stiffness(const Strand& strand, const Points& x, const RootPose& pose) {
  const Points y = preloaded_ghost(strand, pose);
  Eigen::MatrixXd k = zero_matrix(strand);
  for (int i = 0; i < strand.size(); ++i) {
    const bool exact = strand.integrity_tangent == IntegrityTangent::kExact;
    const Mat3 direction = exact ? Mat3(Mat3::Identity()) : direction_matrix(y.col(i) - x.col(i));
    k.block<3, 3>(3 * i, 3 * i) = strand.integrity[i] * direction;
  }
  return k;
}

Eigen::MatrixXd angular_stiffness(const Strand& strand, const Points& x, const RootPose& pose) {
  const Points y = ghost(strand, pose);
  Eigen::MatrixXd k = zero_matrix(strand);
  for (int i = 1; i < strand.size(); ++i) {
    double scale = 1;
    if (strand.angular_tangent == AngularTangent::kConsistent) {
      const double rest_length = rest_segment(strand, i);
      const double length = std::max((x.col(i) - x.col(i - 1)).norm(), 0.1 * rest_length);
      scale = length > 0 ? rest_length / length : 0;
    }
    k.block<3, 3>(3 * i, 3 * i) = strand.angular[i] * scale * direction_matrix(y.col(i) - x.col(i));
  }
  return k;
}

State rest_state(const Strand& strand, const RootPose& pose) {
  return {ghost(strand, pose), Points::Zero(3, strand.size())};
}

LinearSystem assemble(const Strand& strand, const State& state, const Step& step) {
  check(strand, state);
  const int n = strand.size();
  const double h = step.h;
  const double damped = h * h + h * strand.damping;
  const Points& x = state.position;

  const Eigen::MatrixXd spring = spring_stiffness(strand, x);
  const Eigen::MatrixXd geometric = geometric_stiffness(strand, x);
  const Eigen::MatrixXd integrity = integrity_stiffness(strand, x, step.before);
  const Eigen::MatrixXd angular = angular_stiffness(strand, x, step.before);
  const Points ghost_velocity = (ghost(strand, step.after) - ghost(strand, step.before)) / h;
  const Points preloaded_velocity =
      (preloaded_ghost(strand, step.after) - preloaded_ghost(strand, step.before)) / h;

  Eigen::MatrixXd matrix = damped * (spring + integrity + angular) + h * h * geometric;
  Points force = spring_force(strand, x) + integrity_force(strand, x, step.before) +
                 angular_force(strand, x, step.before);
  Points momentum(3, n);
  for (int i = 0; i < n; ++i) {
    matrix.block<3, 3>(3 * i, 3 * i) += strand.mass[i] * (1 + h * strand.drag) * Mat3::Identity();
    force.col(i) += strand.mass[i] * strand.gravity;
    momentum.col(i) = strand.mass[i] * state.velocity.col(i);
  }
  const Eigen::VectorXd rhs = flat(momentum + h * force) + damped * (integrity * flat(preloaded_velocity) +
                                                                     angular * flat(ghost_velocity));

  const int held = 3 * clamped_count(strand);
  const int free = 3 * n - held;
  const Eigen::VectorXd held_velocity = flat(ghost_velocity).head(held);
  return {matrix.bottomRightCorner(free, free),
          rhs.tail(free) - matrix.bottomLeftCorner(free, held) * held_velocity};
}

State advance(const Strand& strand, const State& state, const Step& step) {
  const LinearSystem system = assemble(strand, state, step);
  const int clamped = clamped_count(strand);
  const int free = strand.size() - clamped;
  State next = state;
  const Points target = ghost(strand, step.after);
  next.velocity.leftCols(clamped) = (target - ghost(strand, step.before)).leftCols(clamped) / step.h;
  if (free > 0) {
    const Eigen::LLT<Eigen::MatrixXd> factor(system.matrix);
    if (factor.info() != Eigen::Success)
      throw std::runtime_error("the step's matrix is not positive definite");
    next.velocity.rightCols(free) = unflat(factor.solve(system.rhs));
  }
  next.position = state.position + step.h * next.velocity;
  next.position.leftCols(clamped) = target.leftCols(clamped);
  return next;
}

double worst_edge_strain(const Strand& strand, const Points& x) {
  double worst = 0;
  for (int i = 1; i < strand.size(); ++i) {
    const double rest_length = rest_segment(strand, i);
    if (rest_length == 0) continue;
    worst = larger(worst, std::abs((x.col(i) - x.col(i - 1)).norm() / rest_length - 1));
  }
  return worst;
}

Points project_lengths_successively(const Strand& strand, Points x, double tolerance, int max_iterations,
                                    int* iterations) {
  const std::vector<int> segments = constrained_segments(strand, x);
  const Eigen::VectorXd inverse_mass = movable_masses(strand).cwiseInverse();
  int count = 0;
  while (!segments.empty() && count < max_iterations && worst_edge_strain(strand, x) > tolerance) {
    const Constraints c = constraints(strand, x, segments);
    const Eigen::MatrixXd weighted = inverse_mass.asDiagonal() * c.gradient.transpose();
    const Eigen::VectorXd multipliers = (c.gradient * weighted).ldlt().solve(c.value);
    x.rightCols(strand.size() - clamped_count(strand)) -= unflat(weighted * multipliers);
    ++count;
  }
  if (iterations) *iterations = count;
  return x;
}

Points correct_lengths(const Strand& strand, const State& before, const Step& step, const Points& x,
                       int iterations) {
  const std::vector<int> segments = constrained_segments(strand, x);
  if (segments.empty()) return x;
  const Constraints c = constraints(strand, x, segments);
  const Eigen::MatrixXd response = assemble(strand, before, step).matrix.llt().solve(c.gradient.transpose());
  const Eigen::VectorXd inverse_mass = movable_masses(strand).cwiseInverse();
  Eigen::MatrixXd stiffness = (c.gradient * inverse_mass.asDiagonal() * c.gradient.transpose()).inverse();
  for (Eigen::Index row = 0; row < c.value.size(); ++row)
    stiffness(row, row) += step.h * (step.h + strand.damping) * strand.edge[segments[row] - 1];

  Eigen::VectorXd tension = Eigen::VectorXd::Zero(c.value.size()), residual = c.value, search = tension;
  double last = 1;
  for (int i = 0; i < iterations && residual.norm() > 0; ++i) {
    const Eigen::VectorXd image = stiffness * residual;
    const double product = image.dot(residual);
    search = i == 0 ? image : Eigen::VectorXd(image + product / last * search);
    const Eigen::VectorXd shortened = c.gradient * (response * search);
    const double along = product / search.dot(shortened);
    tension += along * search, residual -= along * shortened, last = product;
  }
  Points corrected = x;
  corrected.rightCols(strand.size() - clamped_count(strand)) -= unflat(response * tension);
  return corrected;
}

Points project_lengths(const Strand& strand, const Points& start) {
  constexpr double kTolerance = 1e-12;
  constexpr int kMaxIterations = 200;
  const std::vector<int> segments = constrained_segments(strand, start);
  if (segments.empty()) return start;
  const int movable = strand.size() - clamped_count(strand);
  const Eigen::VectorXd masses = movable_masses(strand);
  const double length = strand.rest.norm();
  const double rounding = 1e-15 * masses.maxCoeff() * length * length;

  // A feasible start and its best multipliers; from there Newton's method on the stationarity of the
  // Lagrangian.
  Points x = project_lengths_successively(strand, start, 1e-10, kMaxIterations);
  Eigen::VectorXd multipliers;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Constraints c = constraints(strand, x, segments);
    const Eigen::VectorXd pull = masses.cwiseProduct(flat((x - start).rightCols(movable)));
    if (iteration == 0)
      multipliers = (c.gradient * c.gradient.transpose()).ldlt().solve(-(c.gradient * pull));
    const Eigen::VectorXd stationarity = pull + c.gradient.transpose() * multipliers;
    const bool feasible = c.value.lpNorm<Eigen::Infinity>() <= kTolerance * length;
    if (feasible && stationarity.lpNorm<Eigen::Infinity>() <= kTolerance * masses.maxCoeff() * length)
      return x;

    Eigen::MatrixXd hessian = constraint_curvature(strand, x, segments, multipliers);
    hessian.diagonal() += masses;
    if (!positive_on_kernel(hessian, c.gradient)) hessian = masses.asDiagonal();
    const KktStep step = solve_kkt(hessian, c, pull);
    const double penalty = 2 * step.multipliers.lpNorm<Eigen::Infinity>();
    const auto merit = [&](const Points& at) {
      const Eigen::VectorXd moved = flat((at - start).rightCols(movable));
      return 0.5 * moved.dot(masses.cwiseProduct(moved)) +
             penalty * constraints(strand, at, segments).value.lpNorm<1>();
    };
    double fraction = 1;
    Points next = x;
    do {
      next.rightCols(movable) = x.rightCols(movable) + fraction * unflat(step.displacement);
      fraction /= 2;
    } while (fraction > 1e-4 && merit(next) > merit(x) + rounding);
    x = next;
    multipliers = step.multipliers;
  }
  throw std::runtime_error("the length projection did not converge");
}

State with_projected(const State& state, const Points& projected, double h) {
  return {projected, state.velocity + (projected - state.position) / h};
}

// ---- Solids
// ------------------------------------------------------------------------------------------------------

Solid sphere(const Vec3& centre, double radius, const Vec3& velocity) {
  return {[=](const Vec3& p) { return (p - centre).norm() - radius; },
          [=](const Vec3& p) { return unit(p - centre); }, [=](const Vec3&) { return velocity; }};
}

Solid half_space(const Vec3& point, const Vec3& outward_normal, const Vec3& velocity) {
  const Vec3 n = unit(outward_normal);
  return {[=](const Vec3& p) { return n.dot(p - point); }, [=](const Vec3&) { return n; },
          [=](const Vec3&) { return velocity; }};
}

Particle solid_response(const Solid& solid, double friction, const Particle& particle, double h) {
  Vec3 velocity = particle.velocity;
  const Vec3 ahead = particle.position + h * velocity;
  if (solid.distance(ahead) < 0) {
    const Vec3 n = solid.normal(ahead);
    const Vec3 solid_velocity = solid.velocity(ahead);
    const Vec3 relative = velocity - solid_velocity;
    const double normal_speed = relative.dot(n);
    const Vec3 tangential = relative - normal_speed * n;
    if (normal_speed <= 0) {
      velocity = solid_velocity;
      if (tangential.norm() > 0) {
        velocity += std::max(0.0, 1 - friction * std::abs(normal_speed) / tangential.norm()) * tangential;
      }
    }
  }
  Vec3 position = particle.position + h * velocity;
  const double distance = solid.distance(position);
  if (distance < 0) position -= distance * solid.normal(position);
  return {position, velocity};
}

}  // namespace ringlet::oracle
