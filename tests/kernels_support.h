// The reference's strands stepped by the kernels, on every machine that the kernels are built for.
#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <type_traits>
#include <vector>

#include "kernels/launch/launch.h"
#include "oracle/ams_reference.h"
#include "oracle/helix.h"
#include "state/strand_model.h"

namespace ringlet::kernels_testing {

using oracle::RootPose;

// The kernels a strand at a time, without packs (unit/kernels_support.cpp).
template <class T>
const kernels::KernelTable<T>& scalar_kernels();

// A machine is a precision and the kernels for it.
template <class Real>
struct ScalarMachine {
  using T = Real;
  static constexpr bool kFused = true;  // multiply-adds round once: bits are those of every fused machine
  static std::string name() { return "scalar"; }
  static bool available() { return true; }
  static const kernels::KernelTable<T>& kernels() { return scalar_kernels<T>(); }
};

template <class Real, kernels::InstructionSet kSet>
struct PackMachine {
  using T = Real;
  static constexpr bool kFused = kSet != kernels::InstructionSet::kGeneric;
  static std::string name() { return kernels::name_of(kSet); }
  static bool available() { return kernels::best_instruction_set() >= kSet; }
  static const kernels::KernelTable<T>& kernels() { return kernels::cpu_kernels<T>(kSet); }
};

template <class T>
using MachinesOf = testing::Types<ScalarMachine<T>, PackMachine<T, kernels::InstructionSet::kGeneric>,
                                  PackMachine<T, kernels::InstructionSet::kAvx2>,
                                  PackMachine<T, kernels::InstructionSet::kAvx512>>;
using Machines = testing::Types<ScalarMachine<double>, PackMachine<double, kernels::InstructionSet::kGeneric>,
                                PackMachine<double, kernels::InstructionSet::kAvx2>,
                                PackMachine<double, kernels::InstructionSet::kAvx512>, ScalarMachine<float>,
                                PackMachine<float, kernels::InstructionSet::kGeneric>,
                                PackMachine<float, kernels::InstructionSet::kAvx2>,
                                PackMachine<float, kernels::InstructionSet::kAvx512>>;

struct MachineNames {
  template <class Machine>
  static std::string GetName(int) {
    return Machine::name() + (std::is_same_v<typename Machine::T, double> ? "_double" : "_float");
  }
};

// A fixture that reports SKIPPED where this processor lacks the machine.
template <class Machine>
class OnMachine : public testing::Test {
 protected:
  using T = typename Machine::T;
  static constexpr bool kDouble = std::is_same_v<T, double>;

  // The tolerance in the machine's precision.
  static constexpr double either(double in_double, double in_float) { return kDouble ? in_double : in_float; }
  void SetUp() override {
    if (!Machine::available()) GTEST_SKIP() << "this processor has no " << Machine::name();
  }
};

// The strand as a model of precision T holds it: rest shape and options rounded to T, stiffness to float.
template <class T>
oracle::Strand rounded(oracle::Strand strand) {
  strand.rest = strand.rest.template cast<T>().template cast<double>();
  for (auto* stiffness : {&strand.edge, &strand.bend, &strand.twist, &strand.integrity, &strand.angular})
    for (double& value : *stiffness) value = static_cast<float>(value);
  strand.gravity = strand.gravity.template cast<T>().template cast<double>();
  strand.drag = static_cast<T>(strand.drag), strand.damping = static_cast<T>(strand.damping);
  return strand;
}

// The air's drag on hair over its linear density: across and along a segment, linear [1/s] and quadratic
// [1/m].
struct AirLaw {
  double normal[2], tangential[2];

  // The matrix that multiplies the air's velocity `u` relative to the segment [1/s].
  oracle::Mat3 of_segment(const oracle::Vec3& segment, const oracle::Vec3& u) const {
    const oracle::Vec3 t = segment.normalized();
    const oracle::Mat3 along = t * t.transpose(), across = oracle::Mat3::Identity() - along;
    return (tangential[0] + tangential[1] * (along * u).norm()) * along +
           (normal[0] + normal[1] * (across * u).norm()) * across;
  }
  template <class T>
  kernels::Air<T> as() const {
    return {nullptr,
            {static_cast<T>(normal[0]), static_cast<T>(normal[1])},
            {static_cast<T>(tangential[0]), static_cast<T>(tangential[1])}};
  }
};
inline constexpr AirLaw kHairInAir{{46, 9.6}, {22, 0.1}};

enum class Springs { kAms, kMassSpring };

// Strands of unit mass and their state. The options of the first strand (gravity, drag, damping, clamped
// particles, tangents) hold for all; lengths are left alone until `parameters` says otherwise.
template <class Machine>
class StrandRun {
 public:
  using T = typename Machine::T;

  // At rest on the ghosts of `poses`, which the preload (if any) is taken against.
  StrandRun(const std::vector<oracle::Strand>& strands, std::vector<RootPose> poses, bool preload,
            Springs springs = Springs::kAms)
      : model(input_of(strands, poses, preload, springs)), state(model), poses_(std::move(poses)) {
    const oracle::Strand& first = strands.front();
    parameters.gravity[0] = static_cast<T>(first.gravity.x());
    parameters.gravity[1] = static_cast<T>(first.gravity.y());
    parameters.gravity[2] = static_cast<T>(first.gravity.z());
    parameters.drag = static_cast<T>(first.drag), parameters.damping = static_cast<T>(first.damping);
    parameters.geometric_stiffness = first.geometric_stiffness ? T(1) : T(0);
    parameters.consistent_angular = first.angular_tangent == oracle::AngularTangent::kConsistent;
    parameters.exact_integrity = first.integrity_tangent == oracle::IntegrityTangent::kExact;
    parameters.clamped = first.clamped;
    parameters.length_tolerance = T(1e-4);
    parameters.strain_limit = parameters.speed_limit = T(1e9);
    std::vector<Pose> at;
    for (const RootPose& pose : poses_) at.push_back({pose.rotation, pose.root});
    state::pose_at_rest<T>(state, model, at);
    figures.assign(static_cast<std::size_t>(model.layout.batches()) * kernels::kFigures * kernels::kLanes,
                   T(0));
    scratch.assign(kernels::scratch_reals(model.layout.longest()), T(0));
  }

  void set(std::size_t strand, const oracle::State& values) {
    const oracle::Points x = values.position.colwise() - poses_[strand].root;
    for (int i = 0; i < model.layout.count(strand); ++i)
      for (int c = 0; c < 3; ++c) {
        const std::size_t at = model.layout.at(strand, i, 3, c);
        state.position[at] = static_cast<T>(x(c, i));
        state.velocity[at] = static_cast<T>(values.velocity(c, i));
      }
  }

  oracle::State get(std::size_t strand) const {
    const int n = model.layout.count(strand);
    oracle::State values{oracle::Points(3, n), oracle::Points(3, n)};
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) {
        const std::size_t at = model.layout.at(strand, i, 3, c);
        values.position(c, i) = state.position[at], values.velocity(c, i) = state.velocity[at];
      }
    values.position.colwise() += poses_[strand].root;
    return values;
  }

  // The mass-spring chain of the first strand, hair and companions in turn.
  void set_chain(const oracle::State& values) {
    for_chain([&](int node, T* position, T* velocity, int c) {
      *position = static_cast<T>(values.position(c, node) - poses_[0].root[c]);
      *velocity = static_cast<T>(values.velocity(c, node));
    });
  }
  oracle::State get_chain() {
    const int nodes = 2 * model.layout.count(0) - 1;
    oracle::State values{oracle::Points(3, nodes), oracle::Points(3, nodes)};
    for_chain([&](int node, const T* position, const T* velocity, int c) {
      values.position(c, node) = *position + poses_[0].root[c], values.velocity(c, node) = *velocity;
    });
    return values;
  }

  // Integrity follows this curve from now on.
  void soften(const kernels::TensionCurve<T>& curve, bool permanent) {
    state.elongation.assign(state.position.size() / 3, T(0));
    elongation = {state.elongation.data(), curve, permanent};
  }
  double remembered(std::size_t strand, int particle) const {
    return state.elongation[model.layout.at(strand, particle, 1, 0)];
  }
  // The same wind [m/s] at every segment from now on; coefficients as kernels::Air.
  void blow(const Vec3& wind, const kernels::Air<T>& law) {
    state.air.assign(state.position.size(), T(0));
    for (std::size_t strand = 0; strand < poses_.size(); ++strand)
      for (int i = 0; i < model.layout.count(strand); ++i)
        for (int c = 0; c < 3; ++c) state.air[model.layout.at(strand, i, 3, c)] = static_cast<T>(wind[c]);
    air = law;
    air.velocity = state.air.data();
  }

  // One substep to the given root poses, `at_a_time` batches a call (0: all in one).
  void step(const std::vector<RootPose>& after, double h, int at_a_time = 0) {
    for (std::size_t strand = 0; strand < poses_.size(); ++strand)
      state::set_root_motion<T>(state, model.layout, strand, {poses_[strand].rotation, poses_[strand].root},
                                {after[strand].rotation, after[strand].root});
    parameters.step = static_cast<T>(h);
    kernels::StrandStep<T> step{model.view(), state.view(), state.root_motion.data(), parameters,
                                figures.data()};
    step.elongation = elongation, step.air = air;
    const int batches = model.layout.batches(), piece = at_a_time > 0 ? at_a_time : batches;
    for (int begin = 0; begin < batches; begin += piece)
      Machine::kernels().strand_step(step, begin, std::min(begin + piece, batches), scratch.data());
    poses_ = after;
  }

  // The contact stage after a step; lengths as `parameters` says.
  void collide(const std::vector<kernels::SolidView>& solids, int at_a_time = 0) {
    const int batches = model.layout.batches(), piece = at_a_time > 0 ? at_a_time : batches;
    state::AlignedVector<std::int32_t> grown_on(batches * kernels::kLanes, kernels::kNoSkin);
    for (std::size_t strand = 0; strand < skin.size(); ++strand)
      grown_on[model.layout.at_strand(strand, 1, 0)] = skin[strand];
    contact_figures.assign(static_cast<std::size_t>(batches) * kernels::kContactFigures * kernels::kLanes,
                           T(0));
    kernels::ContactStep<T> step{};
    step.batches = model.view(), step.state = state.view(), step.root_points = state.root_points.data();
    step.skin = grown_on.data(), step.home = home, step.solids = solids.data();
    step.solid_count = static_cast<std::int32_t>(solids.size());
    step.step = parameters.step, step.clamped = parameters.clamped, step.rounds = 8;
    step.length_iterations = parameters.length_iterations,
    step.length_tolerance = parameters.length_tolerance;
    step.figures = contact_figures.data();
    step.strain_limit = parameters.strain_limit, step.speed_limit = parameters.speed_limit;
    step.skipped_substeps = parameters.skipped_substeps;
    step.touches = state.touches.empty() ? nullptr : state.touches.data();
    for (int begin = 0; begin < batches; begin += piece)
      Machine::kernels().contact_step(step, begin, std::min(begin + piece, batches), scratch.data());
  }

  double contact_figure(std::size_t strand, kernels::ContactFigure which) const {
    return contact_figures[model.layout.at_strand(strand, kernels::kContactFigures, which)];
  }
  double figure(std::size_t strand, kernels::StrandFigure which) const {
    return figures[model.layout.at_strand(strand, kernels::kFigures, which)];
  }

  state::StrandModel<T> model;
  state::StrandState<T> state;
  kernels::StrandParameters<T> parameters{};
  std::int32_t home = -1;          // the solid that strands grow on, as ContactStep has it
  std::vector<std::int32_t> skin;  // [strands], or empty
  kernels::Elongation<T> elongation{};
  kernels::Air<T> air{};
  state::AlignedVector<T> figures, contact_figures, scratch;

 private:
  template <class Visit>
  void for_chain(const Visit& visit) {
    for (int node = 0; node < 2 * model.layout.count(0) - 1; ++node)
      for (int c = 0; c < 3; ++c) {
        const std::size_t at = model.layout.at(0, node / 2, 3, c);
        visit(node, &(node % 2 ? state.companion_position : state.position)[at],
              &(node % 2 ? state.companion_velocity : state.velocity)[at], c);
      }
  }
  static state::StrandInput input_of(const std::vector<oracle::Strand>& strands,
                                     const std::vector<RootPose>& poses, bool preload, Springs springs) {
    state::StrandInput input;
    input.companions = springs == Springs::kMassSpring;
    input.elongation = true;
    const auto or_zero = [](const std::vector<double>& values, int i) {
      return i < static_cast<int>(values.size()) ? static_cast<float>(values[i]) : 0.0f;
    };
    for (std::size_t k = 0; k < strands.size(); ++k) {
      const oracle::Strand& s = strands[k];
      input.counts.push_back(s.size());
      input.first_rotation.push_back(poses[k].rotation);
      for (int i = 0; i < s.size(); ++i) {
        input.rest.push_back(s.rest.col(i));
        for (const auto* values : {&s.edge, &s.bend, &s.twist, &s.integrity, &s.angular})
          input.stiffness.push_back(or_zero(*values, i));
      }
    }
    if (preload) input.preload = strands.front().gravity;
    return input;
  }

  std::vector<RootPose> poses_;
};

// The run with every spring, ghost, weight and drag taken away: a step advances and projects, nothing else.
template <class Machine>
void make_forceless(StrandRun<Machine>& run) {
  std::fill(run.model.stiffness.begin(), run.model.stiffness.end(), 0);
  run.parameters.gravity[0] = run.parameters.gravity[1] = run.parameters.gravity[2] = 0;
  run.parameters.drag = run.parameters.damping = 0;
}

// A strand that falls from rest in so many steps, its lengths held to 1e-7: its particles after 1/12 s.
inline constexpr double kFallSeconds = 1.0 / 12;
template <class Machine>
oracle::Points fallen(const oracle::Strand& strand, Springs springs, int steps, bool lengths_in_step) {
  using T = typename Machine::T;
  StrandRun<Machine> run({strand}, {RootPose{}}, false, springs);
  run.parameters.gravity[1] = T(-9.81), run.parameters.damping = T(1.0 / 60);
  run.parameters.length_iterations = 8, run.parameters.length_tolerance = T(1e-7);
  run.parameters.lengths_in_step = lengths_in_step;
  for (int k = 0; k < steps; ++k) run.step({RootPose{}}, kFallSeconds / steps);
  return run.get(0).position;
}
// The order by which steps of 1/3840 s, then halved twice, bring it there.
template <class Machine>
double order_of_fall(const oracle::Strand& strand, Springs springs, bool lengths_in_step) {
  const auto end_of = [&](int steps) { return fallen<Machine>(strand, springs, steps, lengths_in_step); };
  const oracle::Points coarse = end_of(320), middle = end_of(640), fine = end_of(1280);
  return std::log2((middle - coarse).norm() / (fine - middle).norm());
}

// One strand through `steps` of the helix's steps by the kernels.
template <class Machine>
oracle::HelixOutcome run_helix_on(StrandRun<Machine>& run, const oracle::Strand& strand,
                                  const oracle::Shake& shake, int steps, int substeps) {
  return oracle::run_helix(strand, shake, steps, substeps,
                           [&](const oracle::Strand&, const oracle::State&, const oracle::Step& step) {
                             run.step({step.after}, step.h);
                             return run.get(0);
                           });
}

}  // namespace ringlet::kernels_testing
