#include "study/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "study/penetration.h"
#include "study/record.h"

namespace ringlet::study {
namespace {

std::string code(const std::string& text) {
  std::string out = "`";
  for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);  // tables part at it
  return out + "`";
}

std::string cell(const std::optional<double>& value, const char* format) {
  if (!value) return "-";
  if (!std::isfinite(*value)) return "not finite";
  return fmt::format(fmt::runtime(format), *value);
}

std::optional<double> rms(const std::optional<Spread>& spread) {
  return spread ? std::optional<double>(spread->rms) : std::nullopt;
}
std::optional<double> p99(const std::optional<Spread>& spread) {
  return spread ? std::optional<double>(spread->p99) : std::nullopt;
}

class Page {
 public:
  explicit Page(const Study& study) : study_(study), answers_(answer(study)) {}

  std::string write() {
    head();
    if (reference_converges(study_)) {
      cost();
      waste();
      knee();
    } else {
      say("**The reference does not converge**, so nothing is said of what accuracy costs, which settings "
          "waste time and which is the knee: errors are distances from its last level, whose own error is "
          "not known.\n");
    }
    picked();
    runs();
    convergence();
    single();
    pressure();
    notes();
    return out_;
  }

 private:
  template <class... Parts>
  void say(fmt::format_string<Parts...> format, Parts&&... parts) {
    out_ += fmt::format(format, std::forward<Parts>(parts)...) + "\n";
  }
  const Row& row(std::size_t k) const { return study_.rows[k]; }
  Point point(std::size_t k) const {
    return {row(k).timed->milliseconds, row(k).measured.errors.position->rms};
  }
  std::string unit() const { return study_.length_unit; }

  void head() {
    say("# {}: what accuracy costs\n", study_.scene);
    say("{} runs, frames {} to {}; times are medians over frames and {} repeat{}, warmed, on {}.",
        std::count_if(study_.rows.begin(), study_.rows.end(),
                      [](const Row& r) { return r.status != Status::kNew; }),
        study_.frames.first, study_.frames.last, study_.repeats, study_.repeats == 1 ? "" : "s",
        study_.processor);
    say("{}", study_.product ? "Every combination of the values was run."
                             : "One setting at a time is changed, the others stay as the scene has them.");
    given();
    if (!study_.complete) say("**The study is not complete; `--resume` goes on.**");
    say("\n![Error against time](plot.svg)\n");
  }

  // What the scene has where a setting is varied.
  void given() {
    for (const Row& r : study_.rows) {
      if (r.label != kAsGiven) continue;
      std::string settings;
      for (std::size_t a = 0; a < study_.names.size(); ++a)
        settings += fmt::format("{}{}={}", a ? ", " : "", study_.names[a], r.columns[a]);
      say("`as given` is {}.", code(settings));
    }
  }

  void cost() {
    say("## What does the next digit cost?\n");
    if (!answers_.digit_cost) {
      say("Not known: that takes two runs of which the slower is more accurate by a twentieth of a digit.\n");
      return;
    }
    say("Along the Pareto front **a tenth of the error takes {:.3g} times as long**. Step by step:\n",
        *answers_.digit_cost);
    say("| from | to | error falls | time grows | a digit here costs |");
    say("| --- | --- | --- | --- | --- |");
    for (std::size_t k = 0; k + 1 < answers_.front.size(); ++k) {
      const std::size_t a = answers_.front[k], b = answers_.front[k + 1];
      const Point from = point(a), to = point(b);
      const auto digit = digit_cost(from, to);
      say("| {} | {} | {:.3g} times | {:.3g} times | {} |", code(row(a).label), code(row(b).label),
          from.error / to.error, to.milliseconds / from.milliseconds,
          digit ? fmt::format("{:.3g} times the time", *digit) : std::string("hardly a gain"));
    }
    say("");
  }

  void waste() {
    say("## Which settings waste time?\n");
    if (!study_.complete) return say("Not known before all runs are measured.\n");
    bool any = false;
    for (std::size_t k = 0; k < study_.rows.size(); ++k) {
      if (!answers_.beaten[k]) continue;
      const std::size_t other = *answers_.beaten[k];
      any = true;
      const double gain = point(k).error / point(other).error;
      say("- {}: {} has {} in {:.0f} % of its time.", code(row(k).label), code(row(other).label),
          gain > 1.01 ? fmt::format("{:.3g} times less error", gain) : std::string("the same error"),
          100 * point(other).milliseconds / point(k).milliseconds);
    }
    if (!any) say("None: every run is the quickest of its accuracy.");
    say("");
  }

  void knee() {
    say("## Which setting is the knee?\n");
    if (!answers_.knee) {
      say("None: no run of the front lies below the line between its ends.\n");
      return;
    }
    const std::size_t k = *answers_.knee;
    say("{}: {:.4g} ms a frame, error {:.2e} {}. Before it accuracy is cheap, behind it time buys little.\n",
        code(row(k).label), point(k).milliseconds, point(k).error, unit());
  }

  void picked() {
    if (!study_.wanted.budget && !study_.wanted.target) return;
    say("## What meets what is wanted?\n");
    say("```\n{}```\n", picked_text(study_));
  }

  void runs() {
    say("## Runs\n");
    say("Errors are RMS and, in brackets, 99th percentile: positions [{0}], velocities [{0}/s], lengths of "
        "strands "
        "[-], volume [-], depth in solids [{0}].\n",
        unit());
    say("| run | ms a frame | position | velocity | length | volume | depth | stages, ms |");
    say("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (const Row& r : study_.rows) run(r);
    say("");
  }

  void run(const Row& r) {
    if (r.status == Status::kNew) return;
    if (r.status != Status::kOk) {
      say("| {} | {}: {} | | | | | | |", code(r.label), to_string(r.status), r.message);
      return;
    }
    std::string line = fmt::format("| {} | {} ", code(r.label),
                                   r.timed ? fmt::format("{:.4g}", r.timed->milliseconds) : std::string("-"));
    for (const auto& [name, spread] : r.measured.errors.named())
      line += spread ? fmt::format("| {} ({}) ", cell(spread->rms, "{:.2e}"), cell(spread->p99, "{:.2e}"))
                     : std::string("| - ");
    std::string stages;
    if (r.timed)
      for (const auto& [stage, spent] : r.timed->stages)
        stages += fmt::format("{}{} {:.3g}", stages.empty() ? "" : ", ", stage, spent);
    say("{}| {} |", line, stages);
  }

  void convergence() {
    const std::vector<Order> orders = orders_of(study_);
    say("## Orders of convergence\n");
    if (orders.empty()) say("No setting was given two values that are numbers.");
    for (const Order& order : orders) {
      std::string steps, at;
      const auto text = [](double value) {
        return std::isfinite(value) ? fmt::format("{:.2f}", value) : std::string("-");
      };
      for (std::size_t k = 0; k < order.orders.size(); ++k)
        steps += fmt::format("{}{} to {}: {} ({})", k ? ", " : "", order.values[k], order.values[k + 1],
                             text(order.orders[k]), text(order.median_strand[k]));
      for (std::size_t a = 0; a < study_.axes.size() && study_.product; ++a)
        if (a != order.axis)
          at += fmt::format("{} {}={}", at.empty() ? " with" : ",", study_.names[a],
                            row(order.rows[0]).columns[a]);
      say("- {}{}: {}.", code(study_.axes[order.axis].name), at, steps);
    }
    say("\nOf the RMS error, and in brackets of the median strand's, which few strands that part with every "
        "step "
        "size do not show. Expected of the step in the substeps: order 1 once these resolve the motion; "
        "where "
        "lengths are held by masses alone, solids touch or hair meets hair it may fall below. Errors that "
        "something else holds up, and such as grow with a value, show as 0 or less.\n");
    say("## The reference\n");
    say("The scene as given{} in double precision, {} substeps a frame. Its substeps were doubled, at most "
        "to {}:\n",
        study_.reference_overrides.empty() ? "" : " with " + joined(study_.reference_overrides),
        study_.reference_substeps, study_.reference_cap);
    say("| substeps | change of positions from the level before, RMS [{}] | order | of the median strand "
        "[{}] | "
        "order |",
        unit(), unit());
    say("| --- | --- | --- | --- | --- |");
    for (const Level& level : study_.levels)
      say("| {} | {} | {} | {} | {} |", level.substeps,
          level.diverged ? "diverged" : cell(rms(level.change), "{:.2e}"), cell(level.order, "{:.2f}"),
          cell(level.median_strand, "{:.2e}"), cell(level.median_strand_order, "{:.2f}"));
    say("\n{}\n", verdict());
  }

  std::string verdict() const {
    if (study_.reference_converged)
      return "The last change is under a tenth of the smallest error of any run.";
    if (study_.levels.empty() || study_.reference_substeps == 0) return "It is not complete.";
    if (!reference_converges(study_))
      return "**The reference does not converge**: its last change is no smaller than the one before.";
    const auto& change = study_.levels.back().change;
    if (change && change->rms <= study_.resolution)
      return fmt::format(
          "The last change is as small as single precision, in which frames hold positions, shows: "
          "{:.1e} {}. Errors near that are not told apart.",
          study_.resolution, unit());
    return fmt::format(
        "**The last change is not under a tenth of the smallest error**: the cap of {} substeps "
        "(`--reference-cap`) was reached. Errors not ten times the last change are uncertain by it.",
        study_.reference_cap);
  }

  static std::string joined(const std::vector<std::string>& parts) {
    std::string all;
    for (const std::string& part : parts) all += (all.empty() ? "" : ", ") + code(part);
    return all;
  }

  void single() {
    say("## Float's error beside the step's\n");
    const Single& single = study_.single;
    if (single.substeps == 0) {
      say("Not measured.\n");
    } else if (!single.errors.position) {
      say("Not measured: {}\n", single.message);
    } else {
      say("The reference once more in single precision, with the same {} substeps, is {:.2e} {} from it "
          "(99th "
          "percentile {:.2e}): that is float's error alone. What a run's error has beyond it comes from its "
          "steps and "
          "settings.\n",
          single.substeps, single.errors.position->rms, unit(), single.errors.position->p99);
    }
  }

  void pressure() {
    if (!study_.has_grid) return;
    say("## The grid's pressure\n");
    say("The solver of the grid's pressure, in double precision, on a Poisson problem whose solution is "
        "known: in an octant of a ball, with coefficients that vary, walls on its planes and air beyond the "
        "sphere, to a relative residual of {:.0e}. Theory gives **order {}** in the width of a cell. "
        "Errors are over the largest pressure.\n",
        kPressureResidual, kPressureOrder);
    say("| cells across | cells | error, RMS | order | largest error | order | iterations |");
    say("| --- | --- | --- | --- | --- | --- | --- |");
    const PressureOrders orders = pressure_orders(study_.pressure);
    for (std::size_t k = 0; k < study_.pressure.size(); ++k) {
      const PressureLevel& level = study_.pressure[k];
      const auto order = [&](const std::vector<double>& of) {
        return cell(k > 0 ? std::optional(of[k - 1]) : std::nullopt, "{:.2f}");
      };
      say("| {} | {} | {} | {} | {} | {} | {} |", level.edge, level.cells, cell(level.rms, "{:.2e}"),
          order(orders.rms), cell(level.largest, "{:.2e}"), order(orders.largest), level.iterations);
    }
    say("");
    for (const PressureLevel& level : study_.pressure)
      if (!(level.residual <= kPressureResidual))
        say("**With {} cells across the solver stopped at a residual of {:.1e}**: the error there, and the "
            "orders that it enters, hold what is left.\n",
            level.edge, level.residual);
  }

  void notes() {
    say("## What was measured, and how\n");
    say("- Errors are over the particles of all stepped frames, against the reference's frame of the same "
        "number. Where a "
        "setting changes the physics the error is the distance from the scene as given.");
    std::int64_t strands = 0;
    for (const Row& r : study_.rows) strands = std::max(strands, r.measured.errors.strands);
    say("- Strands are compared with those of the same number whose roots agree{}.{}",
        study_.reference_substeps > 0 ? fmt::format(" ({} at most)", strands) : "",
        study_.resampled
            ? " Some runs have other particles than the reference: they are compared at the reference's "
              "particles, by arc length over the strand's, linearly between a run's own."
            : "");
    for (const Row& r : study_.rows)
      if (r.status == Status::kOk && r.measured.errors.strands < strands)
        say("- {}: {} strands are compared.", code(r.label), r.measured.errors.strands);
    say("- Length: the strand's over that at rest, less the reference's.");
    say("- {}", study_.measures_volume
                    ? "Volume, over the reference's: of the hair mesh, or of the cubes of the grid's cell "
                      "size that hold hair."
                    : "Volume is not measured: the scene has neither a grid nor a hair mesh.");
    say("- {}",
        study_.measures_penetration
            ? fmt::format(
                  "Depth: of the run's particles in the solids' meshes at the frame, 0 outside; of a run of "
                  "more than {} particles every n-th strand.",
                  2 * Penetration::kParticles)
            : std::string("Penetration is not measured: the scene has no solids."));
    for (const Row& r : study_.rows)
      if (!r.left_out.empty())
        say("- {} runs without what this model does not take: {}.", code(r.label), joined(r.left_out));
  }

  const Study& study_;
  Answers answers_;
  std::string out_;
};

}  // namespace

std::string report(const Study& study) { return Page(study).write(); }

std::string table(const Study& study) {
  const Answers answers = answer(study);
  std::size_t width = 4;
  for (const Row& row : study.rows) width = std::max(width, row.label.size());
  std::string out =
      fmt::format("{:<{}} {:>12} {:>12} {:>12}\n", "run", width, "ms/frame", "error rms", "error p99");
  for (std::size_t k = 0; k < study.rows.size(); ++k) {
    const Row& row = study.rows[k];
    if (row.status == Status::kNew) continue;
    const bool front = std::find(answers.front.begin(), answers.front.end(), k) != answers.front.end();
    out += fmt::format("{:<{}} {:>12} {:>12} {:>12}  {}\n", row.label, width,
                       row.timed ? fmt::format("{:.4g}", row.timed->milliseconds) : "-",
                       cell(rms(row.measured.errors.position), "{:.2e}"),
                       cell(p99(row.measured.errors.position), "{:.2e}"),
                       row.status != Status::kOk ? to_string(row.status)
                       : answers.knee == k       ? "front, knee"
                       : front                   ? "front"
                                                 : "");
  }
  return out;
}

std::string picked_text(const Study& study) {
  const Answers answers = answer(study);
  std::string wanted;
  if (study.wanted.budget) wanted += fmt::format("{} ms a frame", *study.wanted.budget);
  if (study.wanted.target)
    wanted += fmt::format("{}an error of {} {}", wanted.empty() ? "" : " and ", *study.wanted.target,
                          study.length_unit);
  if (!reference_converges(study))
    return fmt::format("which run stays within {} is not known: the reference does not converge\n", wanted);
  if (!answers.picked && !study.complete)
    return fmt::format("which run stays within {} is not known: not all are measured\n", wanted);
  if (!answers.picked) return fmt::format("no run stays within {}\n", wanted);
  const Row& row = study.rows[*answers.picked];
  std::string out =
      fmt::format("within {}: {}, {:.4g} ms a frame, error {:.2e} {}\n", wanted, row.label,
                  row.timed->milliseconds, row.measured.errors.position->rms, study.length_unit);
  for (const std::string& option : row.options) out += option + "\n";
  if (row.options.empty()) out += "(the scene as given)\n";
  return out;
}

}  // namespace ringlet::study
