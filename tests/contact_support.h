// Strands that are stepped, collide with one another and hold their lengths, as a run does it: eight substeps
// and then contacts once a frame.
#pragma once
#include <tbb/parallel_for.h>

#include <vector>

#include "kernels/launch/hair_contacts.h"
#include "kernels/solid/touch.h"
#include "state/strand_order.h"

namespace ringlet::kernels_testing {

using kernels::HairContactFigures;
using kernels::InstructionSet;
using kernels::kLanes;

struct HairStrand {
  std::vector<Vec3> points;  // [m]
  Vec3 velocity = Vec3::Zero();
};

// A straight strand with its middle at `middle`.
inline HairStrand straight_strand(const Vec3& middle, const Vec3& along, int particles,
                                  const Vec3& velocity) {
  HairStrand strand{{}, velocity};
  for (int i = 0; i < particles; ++i)
    strand.points.push_back(middle + (static_cast<double>(i) / (particles - 1) - 0.5) * along);
  return strand;
}

inline void run_with_tbb(void*, int chunks, void (*body)(const void*, int), const void* context) {
  tbb::parallel_for(0, chunks, [=](int chunk) { body(context, chunk); });
}

template <class T>
class HairRun {
 public:
  static constexpr int kSubsteps = 8;
  static constexpr double kFrame = 1.0 / 24, kStep = kFrame / kSubsteps;

  HairRun(const std::vector<HairStrand>& strands, double radius, int clamped,
          InstructionSet set = kernels::best_instruction_set(),
          kernels::HostThreads threads = {run_with_tbb, nullptr})
      : model(input_of(strands)),
        state(model),
        contacts(kernels::make_hair_contacts<T>(set, threads)),
        kernels_(kernels::cpu_kernels<T>(set)) {
    step.clamped = clamped, step.friction = T(0.3);
    poses_.resize(strands.size());
    for (std::size_t s = 0; s < strands.size(); ++s) poses_[s].position = strands[s].points[0];
    state::pose_at_rest<T>(state, model, poses_);
    for (std::size_t s = 0; s < strands.size(); ++s)
      state::set_root_motion<T>(state, model.layout, s, poses_[s], poses_[s]);  // roots stay
    for (std::size_t s = 0; s < strands.size(); ++s)
      for (std::size_t i = 0; i < strands[s].points.size(); ++i)
        for (int c = 0; c < 3; ++c)
          state.velocity[model.layout.at(s, static_cast<int>(i), 3, c)] = T(strands[s].velocity[c]);
    order_ = state::strands_by_root(model, state);
    radius_.assign(model.layout.rows() * kLanes, T(radius));
    const auto batches = static_cast<std::size_t>(model.layout.batches());
    figures_.assign(batches * kernels::kFigures * kLanes, T(0));
    length_figures_.assign(batches * kernels::kLengthFigures * kLanes, T(0));
    scratch_.assign(kernels::scratch_reals(model.layout.longest()), T(0));
    strand.step = T(kStep), strand.stiffness[kernels::kEdge] = T(1e6);
    strand.stiffness[kernels::kBend] = strand.stiffness[kernels::kTwist] = T(1e4);
    strand.damping = T(1.0 / 60), strand.geometric_stiffness = T(1);
    strand.consistent_angular = strand.exact_integrity = true;
    strand.clamped = clamped, strand.length_iterations = 8, strand.length_tolerance = T(1e-4);
    strand.strain_limit = strand.speed_limit = T(1e9);
    start_ = state.position, start_roots_ = state.root_points;
  }

  // What the next application starts from.
  void remember() {
    contacts->settle(contact_step());
    start_ = state.position, start_roots_ = state.root_points;
  }

  // As the state now is.
  const kernels::HairContactStep<T>& contact_step() {
    step.batches = model.view();
    step.order = order_.data(), step.strands = static_cast<std::int32_t>(order_.size());
    step.state = state.view(), step.radius = radius_.data();
    step.start = start_.data(), step.start_root_points = start_roots_.data();
    step.root_points = state.root_points.data();
    step.step = T(kStep), step.touches = state.touches.empty() ? nullptr : state.touches.data();
    return step;
  }

  // `seconds`: that the way since `remember` took.
  HairContactFigures collide(double seconds) {
    contact_step();
    HairContactFigures figures = contacts->begin(step);
    for (int pass = 0; pass < passes; ++pass) {
      figures.contacts = contacts->pass(step);
      if (figures.contacts == 0) break;
      hold_lengths(seconds);
    }
    contacts->count_crossings(step, figures);
    return figures;
  }

  // The strands by themselves. Free strands have a root point too, which stays.
  void move_strands() {
    kernels::StrandStep<T> move{model.view(), state.view(), state.root_motion.data(), strand,
                                figures_.data()};
    kernels_.strand_step(move, 0, model.layout.batches(), scratch_.data());
  }
  void hold_lengths(double seconds) {
    kernels::LengthStep<T> lengths{model.view(), state.view(),           T(seconds), strand.clamped, 8,
                                   T(1e-4),      length_figures_.data(), T(1e9),     T(1e9)};
    kernels_.length_step(lengths, 0, model.layout.batches(), scratch_.data());
  }

  // One frame, with contacts at its end or after each substep.
  HairContactFigures frame(bool each_substep = false) {
    HairContactFigures found;
    remember();
    for (int k = 0; k < kSubsteps; ++k) {
      move_strands();
      if (each_substep || k + 1 == kSubsteps) found = collide(each_substep ? kStep : kFrame);
      if (each_substep) remember();
    }
    return found;
  }

  Vec3 position(std::size_t strand, int i) const {
    Vec3 at;
    for (int c = 0; c < 3; ++c)
      at[c] = state.position[model.layout.at(strand, i, 3, c)] +
              state.root_points[model.layout.at_strand(strand, 3, c)];
    return at;
  }
  Vec3 velocity(std::size_t strand, int i) const {
    Vec3 v;
    for (int c = 0; c < 3; ++c) v[c] = state.velocity[model.layout.at(strand, i, 3, c)];
    return v;
  }
  void set_position(std::size_t strand, int i, const Vec3& at) {
    for (int c = 0; c < 3; ++c)
      state.position[model.layout.at(strand, i, 3, c)] =
          T(at[c] - state.root_points[model.layout.at_strand(strand, 3, c)]);
  }
  void set_velocity(std::size_t strand, int i, const Vec3& v) {
    for (int c = 0; c < 3; ++c) state.velocity[model.layout.at(strand, i, 3, c)] = T(v[c]);
  }
  // A solid has pressed the particle; `home`: it goes on with the root.
  void hold(std::size_t strand, int i, const Vec3& normal, const Vec3& velocity, double friction,
            bool home = false) {
    using kernels::kTouchReals;
    if (state.touches.empty()) state.touches.assign(model.layout.rows() * kTouchReals * kLanes, T(0));
    const auto real = [&](int k) -> T& { return state.touches[model.layout.at(strand, i, kTouchReals, k)]; };
    for (int c = 0; c < 3; ++c)
      real(kernels::kTouchNormal + c) = T(normal[c]), real(kernels::kTouchVelocity + c) = T(velocity[c]);
    real(kernels::kTouchFriction) = T(friction), real(kernels::kTouchHome) = T(home);
  }
  double load(std::size_t strand, int i) const {
    return state.touches[model.layout.at(strand, i, kernels::kTouchReals, kernels::kTouchLoad)];
  }
  void set_radius(std::size_t strand, double radius) {
    for (int i = 0; i < count(strand); ++i) radius_[model.layout.at(strand, i, 1, 0)] = T(radius);
  }
  int count(std::size_t strand) const { return model.living(strand); }
  std::size_t strands() const { return poses_.size(); }

  state::StrandModel<T> model;
  state::StrandState<T> state;
  kernels::StrandParameters<T> strand{};
  kernels::HairContactStep<T> step{};
  std::unique_ptr<kernels::HairContacts<T>> contacts;
  int passes = 4;

 private:
  static state::StrandInput input_of(const std::vector<HairStrand>& strands) {
    state::StrandInput input;
    for (const HairStrand& strand : strands) {
      input.counts.push_back(static_cast<std::int32_t>(strand.points.size()));
      input.rest.insert(input.rest.end(), strand.points.begin(), strand.points.end());
    }
    return input;
  }

  const kernels::KernelTable<T>& kernels_;
  std::vector<Pose> poses_;
  state::AlignedVector<T> start_, radius_, figures_, length_figures_, scratch_;
  state::AlignedVector<double> start_roots_;
  std::vector<std::int32_t> order_;
};

}  // namespace ringlet::kernels_testing
