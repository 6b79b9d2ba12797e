#include "bench.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/processor.h"
#include "core/timer.h"
#include "effects/executor.h"
#include "kernels/launch/launch.h"
#include "pipeline/frame_times.h"
#include "scene/scene.h"

namespace ringlet::app {
namespace {

using Row = nlohmann::ordered_json;

using pipeline::median;

// ---- The strand step alone
// ----------------------------------------------------------------------------------------

// As many strands and particles as the AMS paper's "Digital Grooming" asset: helices of 21 particles, 25 cm
// long.
constexpr int kStrands = 7905, kParticles = 21;

state::StrandInput helices() {
  state::StrandInput input;
  input.counts.assign(kStrands, kParticles);
  for (int s = 0; s < kStrands; ++s) {
    for (int i = 0; i < kParticles; ++i) {
      const double t = i / (kParticles - 1.0), a = 6 * std::numbers::pi * t + s;
      input.rest.emplace_back(0.02 * std::cos(a), -0.2 * t, 0.02 * std::sin(a));
    }
  }
  input.first_rotation.assign(kStrands, Mat3::Identity());
  input.preload = Vec3(0, -9.81, 0);
  return input;
}

kernels::StrandParameters<float> parameters(double step) {
  kernels::StrandParameters<float> p{};
  p.step = static_cast<float>(step);
  p.gravity[1] = -9.81f;
  for (const int k : {kernels::kEdge, kernels::kBend, kernels::kTwist}) p.stiffness[k] = 1e6f;
  for (const int k : {kernels::kIntegrity, kernels::kAngular}) p.stiffness[k] = 1e2f;
  p.damping = 1.0f / 60, p.geometric_stiffness = 1;
  p.consistent_angular = p.exact_integrity = true;
  p.clamped = 1;
  p.length_iterations = 8, p.length_tolerance = 1e-4f;
  p.strain_limit = 1e3f, p.speed_limit = 1e3f;
  return p;
}

// The floor of any strand step: to read a substep's rest shape, lengths, positions and velocities and to
// write the latter two, with one addition to each value. Nanoseconds per particle and core.
double floor_nanoseconds(const state::StrandModel<float>& model, state::StrandState<float> state, int threads,
                         int repeats) {
  constexpr int kTimed = 32;
  const std::size_t size = state.position.size();
  const float *rest = model.rest.data(), *lengths = model.rest_length.data();
  float *position = state.position.data(), *velocity = state.velocity.data();
  std::vector<double> nanoseconds;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    const Timer timer;
    for (int k = 0; k < kTimed; ++k)
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size, 1 << 14), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
          position[i] += rest[i], velocity[i] += lengths[i];
      });
    nanoseconds.push_back(1e9 * timer.seconds() * threads /
                          (static_cast<double>(kTimed) * kStrands * kParticles));
  }
  return median(nanoseconds);
}

// A shaken wig, the head swinging 5 cm at 1 Hz: forces, factor, solve, advance and the length projection it
// needs.
Row strand_row(const std::string& instruction_set, int threads, int repeats) {
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
  const state::StrandModel<float> model(helices());
  state::StrandState<float> state(model);
  std::vector<Pose> before(kStrands), after(kStrands);
  state::pose_at_rest<float>(state, model, before);
  const auto executor = effects::make_cpu_executor<float>(model, instruction_set);
  state::AlignedVector<float> figures(static_cast<std::size_t>(model.layout.batches()) * kernels::kFigures *
                                      kernels::kLanes);
  constexpr double kStep = 1.0 / 192;  // 24 frames a second, 8 substeps
  constexpr int kWarm = 24, kTimed = 32;
  const kernels::StrandStep<float> step{model.view(), state.view(), state.root_motion.data(),
                                        parameters(kStep), figures.data()};
  std::vector<double> nanoseconds;
  double iterations = 0;
  const auto advance = [&](int n) {
    const auto height = [](int k) { return 0.05 * (1 - std::cos(2 * std::numbers::pi * k * kStep)); };
    for (int s = 0; s < kStrands; ++s) {
      before[s].position.z() = height(n), after[s].position.z() = height(n + 1);
      state::set_root_motion(state, model.layout, s, before[s], after[s]);
    }
    const Timer timer;
    executor->strand_step(step);
    return timer.seconds();
  };
  int n = 0;
  for (; n < kWarm; ++n) advance(n);
  const auto position = state.position, velocity = state.velocity;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    state.position = position, state.velocity = velocity;  // every repeat does the same work
    double seconds = 0;
    iterations = 0;
    for (int k = 0; k < kTimed; ++k) {
      seconds += advance(n + k);
      for (int s = 0; s < kStrands; ++s)
        iterations += figures[model.layout.at_strand(s, kernels::kFigures, kernels::kIterations)];
    }
    nanoseconds.push_back(1e9 * seconds * threads / (static_cast<double>(kTimed) * kStrands * kParticles));
  }
  return {{"row", "strand step"},
          {"instruction_set", instruction_set},
          {"threads", threads},
          {"strands", kStrands},
          {"particles", kStrands * kParticles},
          {"projection_iterations", iterations / (static_cast<double>(kTimed) * kStrands)},
          {"ns_per_particle_substep_core", median(nanoseconds)},
          {"floor_ns_per_particle_core", floor_nanoseconds(model, state, threads, repeats)},
          {"ms_per_substep", 1e-6 * median(nanoseconds) * kStrands * kParticles / threads}};
}

// ---- Whole scenes
// -------------------------------------------------------------------------------------------------

Row scene_row(const std::string& file, const BenchOptions& options) {
  const Timer load_timer;
  const scene::Scene scene = scene::load(file);
  const auto simulation = pipeline::Simulation::create(scene, options.options);
  const double load_seconds = load_timer.seconds();
  pipeline::FrameTimes times;
  pipeline::RunControl control;
  control.on_frame = [&](int, double seconds, const pipeline::StageSeconds& stages) {
    times.add(seconds, stages);
  };
  pipeline::DiscardFrames sink;
  simulation->run({scene.frames.first, scene.frames.last}, sink, control);
  const pipeline::Plan& plan = simulation->plan();
  Row row = {{"row", scene.name},
             {"strands", plan.strands},
             {"particles", plan.particles},
             {"substeps", plan.substeps},
             {"ms_per_frame", times.milliseconds()},
             {"load_seconds", load_seconds}};
  for (const auto& [name, milliseconds] : times.stage_milliseconds()) row["stages_ms"][name] = milliseconds;
  return row;
}

void print_table(const std::vector<Row>& rows) {
  fmt::print("{:<24} {:>8} {:>9} {:>8} {:>12} {:>22} {:>12}\n", "row", "strands", "particles", "threads",
             "ms", "ns/particle/substep/core", "");
  for (const Row& row : rows) {
    if (row.contains("ns_per_particle_substep_core")) {
      fmt::print(
          "{:<24} {:>8} {:>9} {:>8} {:>12.2f} {:>22.1f} {:>12}\n",
          row["row"].get<std::string>() + " " + row["instruction_set"].get<std::string>(),
          row["strands"].get<int>(), row["particles"].get<int>(), row["threads"].get<int>(),
          row["ms_per_substep"].get<double>(), row["ns_per_particle_substep_core"].get<double>(),
          fmt::format("{:.2f} projections, floor {:.1f} ns", row["projection_iterations"].get<double>(),
                      row["floor_ns_per_particle_core"].get<double>()));
    } else {
      std::string stages;
      for (const auto& [name, ms] : row["stages_ms"].items())
        stages += fmt::format("{} {:.1f}  ", name, ms.get<double>());
      fmt::print("{:<24} {:>8} {:>9} {:>8} {:>12.1f} a frame: {}\n", row["row"].get<std::string>(),
                 row["strands"].get<int>(), row["particles"].get<int>(), "",
                 row["ms_per_frame"].get<double>(), stages);
    }
  }
}

}  // namespace

int run_bench(const BenchOptions& options) {
  const int cores = tbb::info::default_concurrency();
  const int threads = options.threads > 0 ? options.threads : cores;
  std::vector<Row> rows;
  for (const auto set : {kernels::InstructionSet::kGeneric, kernels::InstructionSet::kAvx2,
                         kernels::InstructionSet::kAvx512}) {
    const std::string name = kernels::name_of(set);
    if (set > kernels::best_instruction_set()) continue;
    if (!options.options.instruction_set.empty() && options.options.instruction_set != name) continue;
    rows.push_back(strand_row(name, 1, options.repeats));
    if (threads > 1) rows.push_back(strand_row(name, threads, options.repeats));
  }
  {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    for (const std::string& file : options.scenes) rows.push_back(scene_row(file, options));
  }
  if (options.json) {
    fmt::print("{}\n", Row({{"processor", processor_name()}, {"cores", cores}, {"rows", rows}}).dump(2));
  } else {
    fmt::print("{}, {} cores\n", processor_name(), cores);
    print_table(rows);
  }
  return 0;
}

}  // namespace ringlet::app
