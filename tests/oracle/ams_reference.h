// Reference implementation of the augmented mass-spring (AMS) strand: one strand, double precision, dense
// matrices.
//
// It is written from the equations alone (AMS paper section 3.1, supplement B and C; McAdams et al. for the
// solid response) and shares nothing with the kernels it judges. Slow and plain on purpose: every block of
// the linear system is added where its formula says, and Eigen's dense factorisation solves it.
//
// Conventions: SI units; column i of a 3 x N matrix belongs to particle i; particle 0 is the root. Errors are
// thrown as std::invalid_argument (sizes, clamped particles) or std::runtime_error (no convergence).
#pragma once
#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <vector>

namespace ringlet::oracle {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Points = Eigen::Matrix3Xd;

// Stiffness per unit mass [1/s^2].
struct Stiffness {
  double edge = 1e6, bend = 1e6, twist = 1e6, integrity = 1e2, angular = 1e2;
};

enum class AngularTangent { kConsistent, kPaper };
enum class IntegrityTangent { kExact, kPaper };

// A strand and everything about it that a step does not change.
struct Strand {
  Points rest;  // [m] rest shape in the root's frame, relative to the root particle: column 0 is zero
  std::vector<double> mass;       // [kg] one a particle
  std::vector<double> edge;       // [N/m] spring (i, i+1) at index i, N-1 of them
  std::vector<double> bend;       // [N/m] spring (i, i+2), N-2
  std::vector<double> twist;      // [N/m] spring (i, i+3), N-3
  std::vector<double> integrity;  // [N/m] coupling of particle i to its preloaded ghost, N
  std::vector<double>
      angular;     // [N/m] times segment length times angle is the force on particle i, N; 0 unused
  Points preload;  // [m] offset of the preloaded ghost, in the root's frame
  Vec3 gravity{0, -9.81, 0};  // [m/s^2]
  double drag = 0;            // [1/s] G / m
  double damping = 0;         // [s] stiffness-proportional material damping, beta
  int clamped = 1;            // particles 0 .. clamped-1 follow their ghosts; 0, 1 or 2
  bool geometric_stiffness = true;
  AngularTangent angular_tangent = AngularTangent::kConsistent;
  IntegrityTangent integrity_tangent = IntegrityTangent::kExact;

  int size() const { return static_cast<int>(rest.cols()); }
};

// A strand of equal masses [kg] and uniform stiffness with the given rest shape [m] (any origin), without
// preload.
Strand make_strand(const Points& rest, const Stiffness& stiffness, double mass = 1);

// The strand's root frame: a rest point p is at rotation * p + root.
struct RootPose {
  Mat3 rotation = Mat3::Identity();
  Vec3 root = Vec3::Zero();  // [m]
};

// Offsets the ghosts so that the integrity springs carry the weight, y' = y - (m / kappa_I) g, fixed in the
// root frame that `first` has. A particle without integrity stiffness gets none.
void preload_gravity(Strand& strand, const RootPose& first = {});

Points ghost(const Strand& strand, const RootPose& pose);            // y [m]
Points preloaded_ghost(const Strand& strand, const RootPose& pose);  // y' [m]

// Elastic forces [N] and, where one exists, their potential [J]. The angular force is no gradient.
Points spring_force(const Strand& strand, const Points& x);
double spring_energy(const Strand& strand, const Points& x);
Points integrity_force(const Strand& strand, const Points& x, const RootPose& pose);
double integrity_energy(const Strand& strand, const Points& x, const RootPose& pose);
Points angular_force(const Strand& strand, const Points& x, const RootPose& pose);

// Stiffness matrices [N/m], 3N x 3N, particle-major: the two-particle springs' K, their Kg (zero when
// switched off), and the block diagonals of the ghost couplings. Directions jump where a particle sits on its
// ghost: there the angular matrix turns with the last bit, so compare matrices at states off the ghosts.
Eigen::MatrixXd spring_stiffness(const Strand& strand, const Points& x);
Eigen::MatrixXd geometric_stiffness(const Strand& strand, const Points& x);
Eigen::MatrixXd integrity_stiffness(const Strand& strand, const Points& x, const RootPose& pose);
Eigen::MatrixXd angular_stiffness(const Strand& strand, const Points& x, const RootPose& pose);

struct State {
  Points position, velocity;
};  // [m], [m/s]

State rest_state(const Strand& strand, const RootPose& pose = {});  // on the ghosts, without velocity

// The strand's root frame at a step's start and end, and the step [s].
struct Step {
  RootPose before, after;
  double h;
};

// The linear system of one implicit step for the velocities of the particles that are not clamped, in their
// order: matrix * V = rhs, 3 rows a particle, clamped particles eliminated. [kg], [kg m/s]
struct LinearSystem {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd rhs;
};
LinearSystem assemble(const Strand& strand, const State& state, const Step& step);

// One linearly implicit Euler step.
State advance(const Strand& strand, const State& state, const Step& step);

// The larger of two, and NaN where either is.
inline double larger(double a, double b) { return a >= b || std::isnan(a) ? a : b; }

// max_i |l_i / l_i^rest - 1| over segments with a rest length; 0 when there are none.
double worst_edge_strain(const Strand& strand, const Points& x);

// Inextensibility. The exact minimiser of sum_i m_i |dx_i|^2 over displacements that restore every segment's
// rest length with the clamped particles held, by Newton's method on the full Lagrangian to 1e-12. Segments
// without a rest length or whose ends coincide constrain nothing.
Points project_lengths(const Strand& strand, const Points& x);

// The same constraint reached by successive linear projections, each along the constraint gradients where the
// last one ended and each of least mass-weighted size, until the worst strain is at most `tolerance`. Its sum
// differs from the exact minimiser at second order in the correction. `iterations`, where given, receives
// their number.
Points project_lengths_successively(const Strand& strand, Points x, double tolerance, int max_iterations,
                                    int* iterations = nullptr);

// The same constraint approached in the metric of an implicit step that led to x: the tensions that bring the
// lengths back to first order, (J A^-1 J^T) lambda = C, x -= A^-1 J^T lambda, A the step's matrix, by so many
// iterations of conjugate gradients that are preconditioned by the masses' stiffness plus the segments' own.
// As many as there are segments solve it.
Points correct_lengths(const Strand& strand, const State& before, const Step& step, const Points& x,
                       int iterations);

// Positions replaced by `projected`, velocities corrected by the displacement over h.
State with_projected(const State& state, const Points& projected, double h);

// An analytic solid: signed distance [m] (negative inside), unit outward normal, velocity [m/s], all at a
// point.
struct Solid {
  std::function<double(const Vec3&)> distance;
  std::function<Vec3(const Vec3&)> normal, velocity;
};
Solid sphere(const Vec3& centre, double radius, const Vec3& velocity = Vec3::Zero());
Solid half_space(const Vec3& point, const Vec3& outward_normal, const Vec3& velocity = Vec3::Zero());

struct Particle {
  Vec3 position, velocity;
};

// The solid's response for one particle: `position` before the advance of the step h, `velocity` after the
// implicit solve. Friction where position + h velocity is inside and approaching; then the advance; then the
// push-out.
Particle solid_response(const Solid& solid, double friction, const Particle& particle, double h);

}  // namespace ringlet::oracle
