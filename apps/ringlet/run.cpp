#include "run.h"

#include <fmt/format.h>
#include <tbb/global_control.h>

#include "cache/writer.h"
#include "core/log.h"
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
  const std::int64_t particle = header.offsets[failure.strand] + failure.particle;
  cache::write_failed_state(file, header, failure.frame,
                            {failure.what(), failure.stage, failure.strand, particle});
  log_warning(fmt::format("the failing state is in {}", file.string()));
}

}  // namespace

int run_run(const RunOptions& options) {
  const std::atomic<int>& stop = catch_signals();
  const scene::Scene scene = scene::load(options.scene.file, {options.scene.overrides});
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

  const auto simulation = pipeline::Simulation::create(scene, options.scene.options);
  const state::RunHeader header = simulation->header(range);
  cache::CacheWriter writer(output, header, writer_options(scene, existing));
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
  try {
    const bool completed = simulation->run(range, writer, control);
    writer.finish();
    progress->end();
    if (!completed) {
      log_warning(fmt::format("stopped by signal {}; --resume continues", stop.load()));
      return 128 + stop;
    }
  } catch (const pipeline::Diverged& failure) {
    progress->end();
    writer.finish();
    report_failure(failure, output, header);
    throw;
  }
  if (options.progress != "json" && options.progress != "none")
    fmt::print("wrote {}\n", (output / (scene.name + ".h5")).string());
  return 0;
}

}  // namespace ringlet::app
