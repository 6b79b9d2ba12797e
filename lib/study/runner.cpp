#include "study/runner.h"

#include "cache/writer.h"
#include "pipeline/frame_times.h"
#include "study/threads.h"

namespace ringlet::study {
namespace {

Outcome run(pipeline::Simulation& simulation, const Common& common, state::FrameSink& sink,
            pipeline::RunControl control) {
  control.stop = common.stop;
  try {
    const bool completed = simulation.run(common.frames, sink, control);
    return {completed ? Ending::kComplete : Ending::kStopped, {}};
  } catch (const pipeline::Diverged& failure) {
    return {Ending::kDiverged, failure.what()};
  }
}

}  // namespace

scene::Scene observed(const std::filesystem::path& file, std::vector<std::string> overrides, bool solids) {
  overrides.push_back(solids ? R"(/cache/fields=["position","velocity","solids"])"
                             : R"(/cache/fields=["position","velocity"])");
  overrides.emplace_back(R"(/cache/strands="all")");
  overrides.emplace_back(R"(/cache/compression="none")");
  return scene::load(file, {overrides});
}

void rehearse(const Variant& variant) {
  const Threads threads(variant.machine.threads);
  pipeline::Simulation::create(variant.scene, variant.machine.options);
}

Measured measure_run(const Variant& variant, const std::filesystem::path& file, const Common& common,
                     const scene::Scene& reference_scene, const cache::CacheReader& reference) {
  const Threads threads(variant.machine.threads);
  const scene::Scene scene = observed(file, variant.overrides, false);
  const auto simulation = pipeline::Simulation::create(scene, variant.machine.options);
  const state::RunHeader header = simulation->header(common.frames);
  Measure measure(reference_scene, reference, header);
  Measured measured;
  measured.backend = header.backend, measured.instruction_set = header.instruction_set;
  measured.strands = simulation->plan().strands, measured.particles = simulation->plan().particles;
  measured.outcome = run(*simulation, common, measure, {});
  if (measured.outcome.ending == Ending::kComplete) measured.errors = measure.errors();
  measured.resampled = measure.resampled();
  return measured;
}

Timed time_run(const Variant& variant, const Common& common) {
  const Threads threads(variant.machine.threads);
  pipeline::FrameTimes times;
  pipeline::RunControl control;
  control.on_frame = [&](int frame, double seconds, const pipeline::StageSeconds& stages) {
    if (frame >= common.frames.first) times.add(seconds, stages);
  };
  Timed timed;
  for (int repeat = 0; repeat < common.repeats; ++repeat) {
    const auto simulation = pipeline::Simulation::create(variant.scene, variant.machine.options);
    pipeline::DiscardFrames sink;
    timed.outcome = run(*simulation, common, sink, control);
    if (timed.outcome.ending != Ending::kComplete) return timed;
  }
  timed.frames = static_cast<std::int64_t>(times.frames());
  timed.milliseconds = times.milliseconds(), timed.stages = times.stage_milliseconds();
  return timed;
}

Outcome cache_run(const scene::Scene& scene, const Machine& machine, const Common& common,
                  const std::filesystem::path& directory) {
  const Threads threads(machine.threads);
  const auto simulation = pipeline::Simulation::create(scene, machine.options);
  cache::WriterOptions options;
  options.compression = cache::Compression::kNone;
  options.existing = cache::Existing::kResume;
  cache::CacheWriter writer(directory, simulation->header(common.frames), options);
  pipeline::RunControl control;
  control.resume = writer.take_resume_point();
  const Outcome outcome = run(*simulation, common, writer, std::move(control));
  writer.finish();
  return outcome;
}

}  // namespace ringlet::study
