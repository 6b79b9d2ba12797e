#include "study/study.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "core/log.h"
#include "frame_range.h"
#include "interrupt.h"
#include "scene/scene.h"
#include "study.h"
#include "study/record.h"
#include "study/report.h"

namespace ringlet::app {
namespace {

// A number with one of the units behind it, each with its factor; without a unit the factor is 1.
double quantity(const char* option, const std::string& text,
                const std::vector<std::pair<std::string, double>>& units, const char* expected) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  double factor = unit.empty() ? 1 : 0;
  for (const auto& [name, of_unit] : units)
    if (unit == name) factor = of_unit;
  if (error != std::errc() || !(factor > 0) || !(value > 0) || !std::isfinite(value))
    throw Error(ErrorKind::kUsage, option, fmt::format("found `{}`, expected {}", text, expected));
  return value * factor;
}

study::Options study_options(const StudyOptions& options, const scene::Scene& scene) {
  study::Options out;
  out.base = {options.scene.file, options.scene.overrides, {options.scene.options, options.scene.threads}};
  for (const std::string& text : options.vary) out.axes.push_back(study::parse_axis(text));
  if (out.axes.empty()) out.axes.push_back(study::parse_axis("/model/substeps=1,2,4,8,16,32"));
  for (std::size_t a = 0; a < out.axes.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (out.axes[a].name == out.axes[b].name)
        throw Error(ErrorKind::kUsage, "--vary " + out.axes[a].name, "is given twice",
                    "give all its values at once");
  out.product = options.product;
  out.reference = options.reference;
  out.reference_cap = options.reference_cap;
  if (!options.budget.empty())
    out.wanted.budget =
        quantity("--budget", options.budget, {{"ms", 1}, {"s", 1000}}, "a time such as 40ms or 0.04s");
  if (!options.target.empty())
    out.wanted.target =
        quantity("--target", options.target, {}, "an error such as 1e-3, in the scene's unit of length");
  out.common.frames = parse_range(options.frames, scene.frames);
  if (out.common.frames.last == scene.frames.first - scene.frames.preroll)
    throw Error(ErrorKind::kUsage, "--frames", "no frame of these is stepped", "take in a later one");
  out.common.repeats = options.repeats;
  out.directory = options.output;
  if (out.directory.empty()) out.directory = std::filesystem::path("out") / (scene.name + "_study");
  out.resume = options.resume;
  return out;
}

// A study that is there is gone on with or replaced only where that is asked for.
void check_destination(const std::filesystem::path& directory, const StudyOptions& options) {
  const std::filesystem::path file = directory / "study.json";
  if (!std::filesystem::exists(file) || options.resume) return;
  if (!options.overwrite)
    throw Error(ErrorKind::kUsage, file.string(), "there is a study already",
                "--resume goes on with it, --overwrite replaces it, -o takes another directory");
}

void print(const study::Study& study, const std::filesystem::path& directory) {
  const study::Answers answers = study::answer(study);
  fmt::print("\n{}\n", study::table(study));
  if (!study::reference_converges(study)) fmt::print("the reference does not converge: no answers\n");
  if (answers.digit_cost)
    fmt::print("a tenth of the error takes {:.3g} times as long\n", *answers.digit_cost);
  if (answers.knee) fmt::print("the knee is {}\n", study.rows[*answers.knee].label);
  if (study.wanted.budget || study.wanted.target) fmt::print("{}", study::picked_text(study));
  fmt::print("wrote {}\n", (directory / "report.md").string());
}

}  // namespace

int run_study(const StudyOptions& options) {
  const std::atomic<int>& stop = catch_signals();
  const scene::Scene scene = scene::load(options.scene.file, {options.scene.overrides});
  study::Options job = study_options(options, scene);
  check_destination(job.directory, options);
  job.common.stop = &stop;
  job.overwrite = options.overwrite;
  if (!options.quiet && !options.json)
    job.tell = [](const std::string& line) {
      fmt::print("{}\n", line);
      std::fflush(stdout);
    };
  const study::Study study = study::run_study(job);
  if (options.json)
    fmt::print("{}", study::to_json(study));
  else
    print(study, job.directory);
  if (!study.complete) {
    log_warning(fmt::format("stopped by signal {}; --resume continues", stop.load()));
    return 128 + stop;
  }
  const bool wanted = study.wanted.budget || study.wanted.target;
  return wanted && !study::answer(study).picked ? 1 : 0;
}

}  // namespace ringlet::app
