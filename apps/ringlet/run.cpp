#include "run.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "cache/writer.h"
#include "core/log.h"
#include "core/trace.h"
#include "frame_range.h"
#include "interrupt.h"
#include "progress.h"
#include "scene/scene.h"

namespace ringlet::app {
namespace {

cache::WriterOptions writer_options(const scene::Scene& scene, cache::Existing existing) {
  cache::WriterOptions options;
  switch (scene.cache.compression) {
    case scene::Compression::kNone:
      options.compression = cache::Compression::kNone;
      break;
    case scene::Compression::kDefault:
      options.compression = cache::Compression::kDefault;
      break;
    case scene::Compression::kQuantised:
      options.compression = cache::Compression::kQuantised;
      break;
  }
  options.error = scene.cache.error / scene.units.metres_per_unit;
  options.existing = existing;
  return options;
}

void report_failure(const pipeline::Diverged& failure, const std::filesystem::path& directory,
                    const state::RunHeader& header) {
  const std::filesystem::path file = directory / (header.name + ".failed.h5");
  const std::int64_t particle = failure.particle < 0 ? -1 : header.offsets[failure.strand] + failure.particle;
  cache::write_failed_state(file, header, failure.frame,
                            {failure.what(), failure.stage, failure.strand, particle});
  log_warning(fmt::format("the failing state is in {}", file.string()));
}

scene::Scene load_scene(const SceneSettings& settings) {
  const trace::Span span("scene", "set-up");
  return scene::load(settings.file, {settings.overrides});
}

std::unique_ptr<pipeline::Simulation> make_simulation(const scene::Scene& scene,
                                                      const pipeline::Options& options) {
  trace::Span span("simulation", "set-up");
  auto simulation = pipeline::Simulation::create(scene, options);
  const pipeline::Plan& plan = simulation->plan();
  for (const pipeline::PlannedStage& stage : plan.stages)
    if (stage.runs) trace::count("memory", {{stage.name, static_cast<double>(stage.bytes)}});
  span.tell("strands", static_cast<double>(plan.strands));
  span.tell("particles", static_cast<double>(plan.particles));
  span.tell("least_substeps", plan.least_substeps), span.tell("substeps", plan.substeps);
  return simulation;
}

// Runs to the end of the range, or to a signal. Throws Diverged when the failing state is in its file.
bool run_to_end(pipeline::Simulation& simulation, const pipeline::FrameRange& range,
                const std::filesystem::path& output, const state::RunHeader& header,
                cache::CacheWriter& writer, const pipeline::RunControl& control, Progress& progress) {
  try {
    const bool completed = simulation.run(range, writer, control);
    writer.finish();
    progress.end();
    return completed;
  } catch (const pipeline::Diverged& failure) {
    progress.end();
    writer.finish();
    report_failure(failure, output, header);
    throw;
  }
}

}  // namespace

int run_run(const RunOptions& options) {
  const std::atomic<int>& stop = catch_signals();
  std::optional<trace::Recording> recording;  // outlives whatever is recorded
  if (!options.trace.empty()) trace::check_destination(options.trace), recording.emplace();
  trace::name_thread("stepping");
  const scene::Scene scene = load_scene(options.scene);
  const pipeline::FrameRange range = parse_range(options.frames, scene.frames);
  const std::filesystem::path output =
      options.output.empty() ? std::filesystem::path("out") / scene.name : options.output;
  const cache::Existing existing = options.resume      ? cache::Existing::kResume
                                   : options.overwrite ? cache::Existing::kOverwrite
                                                       : cache::Existing::kRefuse;
  cache::check_destination(output, scene.name, existing);
  std::optional<tbb::global_control> threads;
  if (options.scene.threads > 0)
    threads.emplace(tbb::global_control::max_allowed_parallelism, options.scene.threads);

  const auto simulation = make_simulation(scene, options.scene.options);
  const state::RunHeader header = simulation->header(range);
  cache::CacheWriter writer(output, header, writer_options(scene, existing));
  if (recording) recording->open(options.trace);
  const auto progress = make_progress(options.progress, range.last);
  pipeline::RunControl control;
  control.resume = writer.take_resume_point();
  control.stop = &stop;
  const int begin = control.resume ? control.resume->frame : scene.frames.first - scene.frames.preroll;
  const int total = range.last - begin;
  int done = 0;
  control.on_frame = [&](int frame, double seconds, const pipeline::StageSeconds& stages) {
    progress->frame(frame, ++done, total, seconds, stages);
  };
  const bool completed = run_to_end(*simulation, range, output, header, writer, control, *progress);
  if (recording) recording->finish();
  if (!completed) {
    log_warning(fmt::format("stopped by signal {}; --resume continues", stop.load()));
    return 128 + stop;
  }
  if (options.progress != "json" && options.progress != "none")
    fmt::print("wrote {}\n", (output / (scene.name + ".h5")).string());
  return 0;
}

}  // namespace ringlet::app
