// Time of the kernels per particle and substep on one thread: as many helices as a real wig has strands,
// walked through batch after batch as a run does, so that memory is as cold as in a run.
//
// Not a test. `bench_kernels --benchmark_repetitions=5`; the counter ns_per_particle is the figure.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "kernels/launch/launch.h"
#include "level_set_support.h"
#include "state/strand_model.h"

namespace ringlet::kernels_testing {
namespace {

using kernels::InstructionSet;
using kernels::kLanes;

constexpr int kStrands = 7905, kParticles = 21;
constexpr double kStep = 1.0 / 240;

// Helices of 0.2 m with their roots spread over a ball of 0.1 m, each pointing away from its centre.
struct Wig {
  state::StrandInput input;
  std::vector<Pose> roots;

  Wig() {
    input.counts.assign(kStrands, kParticles);
    input.preload = Vec3(0, -9.81, 0);
    for (int s = 0; s < kStrands; ++s) {
      const double height = 1 - 2 * (s + 0.5) / kStrands,
                   around = s * std::numbers::pi * (3 - std::sqrt(5.0));
      const double ring = std::sqrt(1 - height * height);
      const Vec3 out(ring * std::cos(around), height, ring * std::sin(around));
      roots.push_back({Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), out).toRotationMatrix(), 0.1 * out});
      input.first_rotation.push_back(roots.back().rotation);
      for (int i = 0; i < kParticles; ++i) {
        const double t = i / double(kParticles - 1), a = 8 * std::numbers::pi * t;
        input.rest.push_back({0.2 * t, 0.01 * (std::cos(a) - 1), 0.01 * std::sin(a)});
      }
    }
  }
};

const Wig& wig() {
  static const Wig made;
  return made;
}

enum class Motion { kStill, kShaken };
enum class Extra { kNone, kAir, kElongation, kMassSpring };

inline state::StrandInput input_for(Extra extra) {
  state::StrandInput input = wig().input;
  input.elongation = extra == Extra::kElongation, input.companions = extra == Extra::kMassSpring;
  return input;
}

template <class T>
struct Bench {
  state::StrandModel<T> model;
  state::StrandState<T> state{model};
  state::AlignedVector<T> figures, scratch;
  kernels::StrandParameters<T> parameters{};
  std::vector<Pose> pose = wig().roots;
  kernels::Elongation<T> elongation{};
  kernels::Air<T> air{};
  int steps = 0;

  explicit Bench(Extra extra = Extra::kNone) : model(input_for(extra)) {
    state::pose_at_rest<T>(state, model, pose);
    figures.assign(static_cast<std::size_t>(model.layout.batches()) * kernels::kFigures * kLanes, T(0));
    scratch.assign(kernels::scratch_reals(model.layout.longest()), T(0));
    parameters.step = T(kStep), parameters.gravity[1] = T(-9.81);
    for (const int k : {kernels::kEdge, kernels::kBend, kernels::kTwist}) parameters.stiffness[k] = T(1e6);
    for (const int k : {kernels::kIntegrity, kernels::kAngular}) parameters.stiffness[k] = T(1e2);
    parameters.damping = T(1.0 / 60), parameters.geometric_stiffness = T(1);
    parameters.consistent_angular = parameters.exact_integrity = true;
    parameters.clamped = 1, parameters.length_tolerance = T(1e-4);
    parameters.strain_limit = parameters.speed_limit = T(1e6);
    if (extra == Extra::kElongation) {
      state.elongation.assign(state.position.size() / 3, T(0));
      elongation = {
          state.elongation.data(), {1, T(0.5), T(1), {T(0.5)}, {{T(0.5), T(1), T(-1), T(0)}}}, true};
    }
    if (extra == Extra::kAir) {
      state.air.assign(state.position.size(), T(1));
      air = {state.air.data(), {T(46), T(9.6)}, {T(22), T(0.1)}};
    }
  }

  // Roots to where they are after one more step: at rest, or shaken violently by 0.3 m at 3 Hz.
  void move_roots(Motion motion) {
    ++steps;
    const double z =
        motion == Motion::kStill ? 0 : 0.3 * (1 - std::cos(2 * std::numbers::pi * 3 * steps * kStep));
    for (std::size_t s = 0; s < pose.size(); ++s) {
      Pose after = wig().roots[s];
      after.position.z() += z;
      state::set_root_motion<T>(state, model.layout, s, pose[s], after);
      pose[s] = after;
    }
  }
  void strand_step(InstructionSet set) {
    kernels::cpu_kernels<T>(set).strand_step(
        {model.view(), state.view(), state.root_motion.data(), parameters, figures.data(), elongation, air},
        0, model.layout.batches(), scratch.data());
  }
  void wind_step(InstructionSet set, const kernels::WindField<T>& field) {
    state.air.resize(state.position.size());
    kernels::cpu_kernels<T>(set).wind_step(
        {model.view(), state.position.data(), state.root_points.data(), field, nullptr, state.air.data()}, 0,
        model.layout.batches(), scratch.data());
  }
  double mean_figure(kernels::StrandFigure which) const {
    double sum = 0;
    for (int s = 0; s < kStrands; ++s) sum += figures[model.layout.at_strand(s, kernels::kFigures, which)];
    return sum / kStrands;
  }
};

void report(benchmark::State& run) {
  run.counters["ns_per_particle"] =
      benchmark::Counter(1e-9 * run.iterations() * kStrands * kParticles,
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

template <class T>
void strand_step(benchmark::State& run, InstructionSet set, Motion motion, int length_iterations,
                 Extra extra) {
  if (set > kernels::best_instruction_set()) return run.SkipWithError("not on this processor");
  Bench<T> bench(extra);
  bench.parameters.length_iterations = length_iterations;
  double iterations = 0, pieces = 0;
  for (int k = 0; k < 24; ++k) bench.move_roots(motion), bench.strand_step(set);
  for (auto _ : run) {
    run.PauseTiming();
    bench.move_roots(motion);
    run.ResumeTiming();
    bench.strand_step(set);
    iterations += bench.mean_figure(kernels::kIterations),
        pieces += bench.mean_figure(kernels::kSubdivisions);
  }
  report(run);
  run.counters["length_iterations"] = iterations / run.iterations();
  run.counters["pieces"] = pieces / run.iterations();
}

// The default turbulence, 3 octaves of 8 waves.
template <class T>
void wind_step(benchmark::State& run, InstructionSet set) {
  if (set > kernels::best_instruction_set()) return run.SkipWithError("not on this processor");
  Bench<T> bench;
  kernels::WindField<T> field{};
  field.modes = 24;
  for (int n = 0; n < field.modes; ++n)
    field.wave[n][0] = T(1 + n), field.amplitude[n][1] = T(0.1), field.phase[n] = T(0.01 * n);
  for (auto _ : run) bench.wind_step(set, field);
  report(run);
}

// One contact stage from the same state again and again; the sphere at the strands' roots, or far from all.
template <class T>
void contact_step(benchmark::State& run, InstructionSet set, bool near) {
  if (set > kernels::best_instruction_set()) return run.SkipWithError("not on this processor");
  Bench<T> bench;
  static const MeshSolid sphere(icosphere(0.1, 4), 0.004);
  kernels::SolidView solid = sphere.view();
  if (!near) solid.translation[0] = solid.translation_before[0] = 10;
  state::AlignedVector<std::int32_t> skin(bench.model.layout.batches() * kLanes, kernels::kNoSkin);
  state::AlignedVector<T> figures(static_cast<std::size_t>(bench.model.layout.batches()) *
                                  kernels::kContactFigures * kLanes);
  kernels::ContactStep<T> step{bench.model.view(),
                               bench.state.view(),
                               bench.state.root_points.data(),
                               skin.data(),
                               &solid,
                               1,
                               -1,
                               T(kStep),
                               1,
                               4,
                               8,
                               T(1e-4),
                               figures.data(),
                               T(10),
                               T(1000),
                               0,
                               nullptr};
  for (auto _ : run)
    kernels::cpu_kernels<T>(set).contact_step(step, 0, bench.model.layout.batches(), bench.scratch.data());
  report(run);
}

void register_all() {
  for (const InstructionSet set :
       {InstructionSet::kGeneric, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
    const std::string name = kernels::name_of(set);
    const auto add = [&](const std::string& what, auto function, auto... arguments) {
      benchmark::RegisterBenchmark((what + "/" + name).c_str(), function, set, arguments...)
          ->Unit(benchmark::kMillisecond)
          ->MinTime(0.3);
    };
    add("strand_step/float/shaken", strand_step<float>, Motion::kShaken, 8, Extra::kNone);
    add("strand_step/float/still", strand_step<float>, Motion::kStill, 8, Extra::kNone);
    add("strand_step/float/no_projection", strand_step<float>, Motion::kShaken, 0, Extra::kNone);
    add("strand_step/float/still/air", strand_step<float>, Motion::kStill, 8, Extra::kAir);
    add("strand_step/float/still/elongation", strand_step<float>, Motion::kStill, 8, Extra::kElongation);
    add("strand_step/float/still/mass_spring", strand_step<float>, Motion::kStill, 8, Extra::kMassSpring);
    add("strand_step/double/shaken", strand_step<double>, Motion::kShaken, 8, Extra::kNone);
    add("wind_step/float", wind_step<float>);
    add("contact_step/float/far", contact_step<float>, false);
    add("contact_step/float/near", contact_step<float>, true);
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing

int main(int argc, char** argv) {
  ringlet::kernels_testing::register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
