// The command line. Errors leave here as `error: WHERE: WHAT (HINT)` on stderr and an exit code
// (core/error.h).
#include <fmt/format.h>

#include <cstdio>
#include <new>

#include "bench.h"
#include "command.h"
#include "compare.h"
#include "core/log.h"
#include "info.h"
#include "plan.h"
#include "run.h"
#include "scene/scene.h"
#include "study.h"

namespace ringlet::app {

void add_scene(CLI::App& command, std::string& file, std::vector<std::string>& overrides) {
  command.add_option("SCENE", file, "scene file (JSON)")->required();
  command.add_option("--set", overrides, "change a value of the scene; null removes; repeatable")
      ->allow_extra_args(false)
      ->option_text("POINTER=JSON");
}

namespace {

template <class Enum>
CLI::CheckedTransformer words(const std::map<std::string, Enum>& values) {
  return CLI::CheckedTransformer(values, CLI::ignore_case);
}

void add_machine(CLI::App& command, pipeline::Options& options, int& threads) {
  command.add_option("--backend", options.backend, "auto, cpu or cuda")
      ->transform(words(pipeline::backend_words()))
      ->option_text("auto/cpu/cuda");
  command.add_option("--precision", options.precision, "float or double")
      ->transform(words(pipeline::precision_words()))
      ->option_text("float/double");
  command
      .add_option("--instruction-set", options.instruction_set, "of the CPU; the widest there is by default")
      ->check(CLI::IsMember(pipeline::instruction_set_words()))
      ->option_text("generic/avx2/avx512");
  command.add_option("--threads", threads, "CPU threads; all by default")
      ->check(CLI::Range(1, pipeline::kMostThreads))
      ->option_text("N");
}

void add_run(CLI::App& app, const bool& quiet, Job& job) {
  CLI::App* command = app.add_subcommand("run", "simulate a scene and write its cache");
  const auto options = std::make_shared<RunOptions>();
  add_scene(*command, options->scene.file, options->scene.overrides);
  add_machine(*command, options->scene.options, options->scene.threads);
  command->add_option("-o,--output", options->output, "directory of the cache; out/NAME by default")
      ->option_text("DIR");
  command->add_option("--frames", options->frames, "frames to write")->option_text("A-B");
  CLI::Option* resume = command->add_flag("--resume", options->resume, "go on from the last complete frame");
  command->add_flag("--overwrite", options->overwrite, "replace a cache that is there")->excludes(resume);
  command->add_option("--progress", options->progress, "how to tell how far it is")
      ->check(CLI::IsMember({"auto", "bar", "plain", "json", "none"}))
      ->option_text("auto/bar/plain/json/none");
  command
      ->add_option("--trace", options->trace, "write where the time went, for chrome://tracing or Perfetto")
      ->option_text("FILE");
  command->callback([options, &quiet, &job] {
    job = [options, &quiet] {
      if (quiet && options->progress == "auto") options->progress = "none";
      return run_run(*options);
    };
  });
}

void add_plan(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("plan", "what would run: stages, memory, launches");
  const auto options = std::make_shared<PlanOptions>();
  add_scene(*command, options->scene.file, options->scene.overrides);
  add_machine(*command, options->scene.options, options->scene.threads);
  command->add_flag("--json", options->json, "as JSON");
  command->callback([options, &job] { job = [options] { return run_plan(*options); }; });
}

void add_validate(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("validate", "check a scene; every error at once");
  const auto settings = std::make_shared<SceneSettings>();
  add_scene(*command, settings->file, settings->overrides);
  command->callback([settings, &job] {
    job = [settings] {
      const scene::Scene scene = scene::load(settings->file, {settings->overrides});
      fmt::print("{}: valid (scene `{}`, {})\n", settings->file, scene.name, scene.hash);
      return 0;
    };
  });
}

void add_info(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("info", "what a cache, groom, mesh or scene holds");
  const auto options = std::make_shared<InfoOptions>();
  command->add_option("FILE", options->file, "cache, groom, mesh or scene")->required();
  command->add_option("--strand", options->strand, "one strand's points and length")->option_text("N");
  command->add_flag("--json", options->json, "as JSON");
  command->callback([options, &job] { job = [options] { return run_info(*options); }; });
}

void add_compare(CLI::App& app, Job& job) {
  CLI::App* command =
      app.add_subcommand("compare", "compare two caches frame by frame; exit 1 where they differ");
  const auto options = std::make_shared<CompareOptions>();
  command->add_option("A", options->a, "cache")->required();
  command->add_option("B", options->b, "cache")->required();
  CLI::Option* tolerance =
      command
          ->add_option("--tolerance", options->tolerance, "largest distance allowed, in A's unit of length")
          ->check(CLI::NonNegativeNumber)
          ->option_text("D");
  command->add_flag("--exact", options->exact, "the same bits")->excludes(tolerance);
  command->add_flag("--json", options->json, "as JSON");
  command->callback([options, &job] { job = [options] { return run_compare(*options); }; });
}

void add_bench(CLI::App& app, Job& job) {
  CLI::App* command = app.add_subcommand("bench", "time the strand step, and whole scenes by stage");
  const auto options = std::make_shared<BenchOptions>();
  command->add_option("SCENES", options->scenes, "scene files to time as well");
  add_machine(*command, options->options, options->threads);
  command->add_option("--repeats", options->repeats, "of each timing; the median is told")
      ->check(CLI::Range(1, 1000));
  command->add_flag("--json", options->json, "as JSON");
  command->callback([options, &job] { job = [options] { return run_bench(*options); }; });
}

void add_study(CLI::App& app, const bool& quiet, const bool& verbose, Job& job) {
  CLI::App* command = app.add_subcommand("study", "what accuracy costs: time and error of settings");
  const auto options = std::make_shared<StudyOptions>();
  add_scene(*command, options->scene.file, options->scene.overrides);
  add_machine(*command, options->scene.options, options->scene.threads);
  command
      ->add_option(
          "--vary", options->vary,
          "a pointer into the scene, or precision, backend, threads, instruction-set, and its values; "
          "repeatable; /model/substeps=1,2,4,8,16,32 by default")
      ->allow_extra_args(false)
      ->option_text("POINTER=V1,V2,...");
  command->add_flag("--product", options->product, "every combination, not one setting at a time");
  command
      ->add_option("--budget", options->budget,
                   "print the most accurate settings within this time of a frame")
      ->option_text("40ms");
  command->add_option("--target", options->target, "print the quickest settings within this error")
      ->option_text("1e-3");
  command
      ->add_option("--reference", options->reference,
                   "what the reference has that the scene has not; repeatable")
      ->allow_extra_args(false)
      ->option_text("POINTER=JSON");
  command->add_option("--reference-cap", options->reference_cap, "most substeps of the reference")
      ->check(CLI::Range(1, 1000))
      ->option_text("N");
  command->add_option("-o,--output", options->output, "directory of the study; out/NAME_study by default")
      ->option_text("DIR");
  command->add_option("--frames", options->frames, "frames to measure")->option_text("A-B");
  command->add_option("--repeats", options->repeats, "of each timing; medians are told")
      ->check(CLI::Range(1, 1000));
  CLI::Option* resume = command->add_flag("--resume", options->resume, "go on with the runs that are there");
  command->add_flag("--overwrite", options->overwrite, "replace a study that is there")->excludes(resume);
  command->add_flag("--json", options->json, "print study.json");
  command->callback([options, &quiet, &verbose, &job] {
    job = [options, &quiet, &verbose] {
      if (!verbose) set_log_level(LogLevel::kWarning);  // every run would tell its choices again
      options->quiet = quiet;
      return run_study(*options);
    };
  });
}

// The word of the command line that should be a subcommand and is none; else empty.
std::string unknown_subcommand(const CLI::App& app, int argc, char** argv) {
  const CLI::App* at = &app;
  for (int i = 1; i < argc && !at->get_subcommands({}).empty(); ++i) {
    const std::string word = argv[i];
    if (word.starts_with('-')) continue;
    const auto named = at->get_subcommands([&](const CLI::App* one) { return one->check_name(word); });
    if (named.empty()) return word;
    at = named.front();
  }
  return {};
}

int report(const Error& error) {
  for (const Problem& problem : error.problems()) fmt::print(stderr, "error: {}\n", to_string(problem));
  return static_cast<int>(error.kind());
}

int main(int argc, char** argv) {
  CLI::App app("Ringlet simulates hair: a scene in, a strand cache out.", "ringlet");
  app.set_version_flag("--version", RINGLET_VERSION);
  app.require_subcommand(1);
  bool quiet = false, verbose = false;
  app.add_flag("-q,--quiet", quiet, "warnings only, and no progress unless asked for");
  app.add_flag("-v,--verbose", verbose, "more of what is done");
  Job job;
  app.fallthrough();  // -q and -v after the subcommand too
  add_run(app, quiet, job);
  add_plan(app, job);
  add_validate(app, job);
  add_info(app, job);
  add_compare(app, job);
  add_groom(app, job);
  add_bench(app, job);
  add_study(app, quiet, verbose, job);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked = error.get_exit_code() == 0;  // --help, --version
    if (asked) return app.exit(error);
    const std::string unknown = unknown_subcommand(app, argc, argv);
    const std::string what = unknown.empty() ? error.what() : fmt::format("`{}` is no subcommand", unknown);
    fmt::print(stderr, "error: command line: {} (see `ringlet --help`)\n", what);
    return static_cast<int>(ErrorKind::kUsage);
  }
  set_log_level(verbose ? LogLevel::kDebug : quiet ? LogLevel::kWarning : LogLevel::kInfo);
  try {
    const int code = job();
    if (std::fflush(stdout) != 0)  // a report cut short must not pass for a whole one
      throw Error(ErrorKind::kIo, "standard output", "cannot be written");
    return code;
  } catch (const Error& error) {
    return report(error);
  } catch (const std::bad_alloc&) {
    return report(Error(ErrorKind::kIo, "memory", "not enough memory for this scene", "see `ringlet plan`"));
  } catch (const std::exception& error) {
    return report(Error(ErrorKind::kIo, "", error.what()));
  }
}

}  // namespace
}  // namespace ringlet::app

int main(int argc, char** argv) { return ringlet::app::main(argc, argv); }
