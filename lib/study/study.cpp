#include "study/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "cache/files.h"
#include "cache/reader.h"
#include "core/error.h"
#include "core/json_text.h"
#include "core/log.h"
#include "core/processor.h"
#include "study/plot.h"
#include "study/record.h"
#include "study/report.h"

namespace ringlet::study {
namespace fs = std::filesystem;
namespace {

void write_text(const fs::path& file, const std::string& text) {
  cache::write_atomically(file, std::as_bytes(std::span(text.data(), text.size())));
}

// Errors under the reference's last change are as large as that, for all that is known.
std::vector<Point> points_of(const Study& study) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double unknown = 0;
  for (const Level& level : study.levels)
    if (!level.diverged) unknown = level.change ? level.change->rms : 0;
  std::vector<Point> points;
  for (const Row& row : study.rows) {
    const auto& error = row.measured.errors.position;
    points.push_back(
        {row.timed ? row.timed->milliseconds : kNone, error ? std::max(error->rms, unknown) : kNone});
  }
  return points;
}

// What only says how well a step is solved is not to hold up the reference; but for its lengths' tolerance,
// which is one that single precision reaches too, so that its error can be told.
std::vector<std::string> precise_settings(const scene::Scene& base) {
  constexpr double kLengthTolerance = 1e-5;
  const auto& lengths = base.effects.inextensible;
  if (!lengths || lengths->cadence == scene::Cadence::kFrame) return {};
  std::vector<std::string> settings = {"/effects/inextensible/metric=\"step\""};
  if (lengths->tolerance > kLengthTolerance)
    settings.push_back(fmt::format("/effects/inextensible/tolerance={}", kLengthTolerance));
  return settings;
}

// The study as it goes on: rows, reference, files.
class Running {
 public:
  explicit Running(const Options& options)
      : options_(options), variants_(make_variants(options.base, options.axes, options.product)) {
    const scene::Scene base = scene::load(options.base.file, {options.base.overrides});
    describe(base);
    int most = 1;
    look_for_grids(base);
    for (const Variant& variant : variants_) {
      Row& row = study_.rows.emplace_back();
      row.label = variant.label, row.key = variant.key, row.axis = variant.axis;
      row.columns = variant.columns, row.options = variant.options, row.left_out = variant.left_out;
      row.precision = machine_value("precision", variant.machine);
      most = std::max(most, most_substeps(variant.scene));
    }
    look_at_what_is_there();
    Reference::Plan plan{options.base.file,
                         options.base.overrides,
                         options.base.machine,
                         options.directory / "reference",
                         most,
                         options.reference_cap};
    const std::vector<std::string>& settings = study_.reference_overrides;
    plan.overrides.insert(plan.overrides.end(), settings.begin(), settings.end());
    reference_.emplace(std::move(plan), study_.levels);
    for (const std::string& setting : options.reference)
      if (of_frames(setting.substr(0, setting.find('='))))
        throw Error(ErrorKind::kUsage, "--reference " + setting,
                    "frames of the same number would be of different times, which are not compared",
                    "--set changes the times of all runs and the reference, --frames takes other frames");
    std::vector<std::string> overrides = options.base.overrides;
    overrides.insert(overrides.end(), settings.begin(), settings.end());
    scene::load(options.base.file, {overrides, "--reference"});
    rehearse_rows();
  }

  Study run() {
    cache::make_directory(options_.directory);
    remove_replaced();
    study_.complete = steps();
    save();
    write_text(options_.directory / "plot.svg", plot(study_));
    write_text(options_.directory / "report.md", report(study_));
    return study_;
  }

 private:
  void describe(const scene::Scene& base) {
    study_.scene = base.name, study_.scene_hash = base.hash;
    const Json document = Json::parse(base.resolved);
    const Json& unit = document["units"]["length"];
    study_.length_unit = unit.is_string() ? unit.get<std::string>() : fmt::format("{} m", unit.get<double>());
    study_.processor = processor_name();
    study_.frames = options_.common.frames;
    study_.repeats = options_.common.repeats;
    study_.product = options_.product;
    study_.wanted = options_.wanted;
    study_.axes = options_.axes, study_.names = short_names(options_.axes);
    study_.reference_overrides = precise_settings(base);
    study_.reference_overrides.insert(study_.reference_overrides.end(), options_.reference.begin(),
                                      options_.reference.end());
    study_.reference_cap = options_.reference_cap;
    study_.measures_penetration = !base.effects.solids.empty();
    study_.measures_volume = base.model.type == scene::ModelType::kHairMesh ||
                             (base.effects.hair_hair && base.effects.hair_hair->grid);
    study_.identity = Json({{"program_version", RINGLET_VERSION},
                            {"scene_hash", base.hash},
                            {"frames", {study_.frames.first, study_.frames.last}},
                            {"reference", study_.reference_overrides},
                            {"processor", study_.processor},
                            {"threads", machine_value("threads", options_.base.machine)},
                            {"instruction_set", machine_value("instruction-set", options_.base.machine)}})
                          .dump();
  }

  void look_for_grids(const scene::Scene& base) {
    const auto has_grid = [](const scene::Scene& scene) {
      return scene.effects.hair_hair && scene.effects.hair_hair->grid;
    };
    study_.has_grid =
        has_grid(base) || std::any_of(variants_.begin(), variants_.end(),
                                      [&](const Variant& variant) { return has_grid(variant.scene); });
  }

  // What is wrong with a run is told before any begins. A combination that is refused, of values that other
  // runs take, is a row that says so.
  void rehearse_rows() {
    std::vector<std::optional<Error>> refusals(variants_.size());
    for (std::size_t k = 0; k < variants_.size(); ++k) {
      if (study_.rows[k].status != Status::kNew) continue;
      try {
        rehearse(variants_[k]);
      } catch (const Error& error) {
        if (error.kind() != ErrorKind::kInput) throw;
        study_.rows[k].status = Status::kRefused, study_.rows[k].message = error.what();
        refusals[k] = error;
      }
    }
    for (std::size_t k = 0; k < variants_.size(); ++k) {
      if (!refusals[k]) continue;
      for (std::size_t a = 0; a < study_.axes.size(); ++a)
        if (!taken_by_another(a, study_.rows[k].columns[a])) throw *refusals[k];
      log_warning(fmt::format("{} is left out: {}", study_.rows[k].label, study_.rows[k].message));
    }
  }
  bool taken_by_another(std::size_t axis, const std::string& value) const {
    return std::any_of(study_.rows.begin(), study_.rows.end(), [&](const Row& row) {
      return row.status != Status::kRefused && row.columns[axis] == value;
    });
  }

  void look_at_what_is_there() {
    const fs::path file = options_.directory / "study.json";
    if (!(options_.resume || options_.overwrite) || !fs::exists(file)) return;
    std::ifstream stream(file, std::ios::binary);
    const std::string text{std::istreambuf_iterator<char>(stream), {}};
    if (options_.resume) {
      const int rows = take_over(text, file.string(), study_);
      log_info(fmt::format("{}: {} runs are taken over", file.string(), rows));
    } else {
      replaced_ = levels_left(text, file.string());
    }
  }

  // The reference's caches of the study that is replaced; what else lies beside them is not the study's.
  void remove_replaced() const {
    const fs::path directory = options_.directory / "reference";
    std::error_code error;  // what cannot be removed is told where it is in the way
    for (const int substeps : replaced_)
      if (substeps > 0) fs::remove_all(directory / std::to_string(substeps), error);
    fs::remove(directory, error);  // where it is empty
  }

  // False: stopped.
  bool steps() {
    while (!reference_->started())
      if (!refine()) return false;
    if (reference_->substeps() == 0)
      throw Error(ErrorKind::kDiverged, "reference", "it diverges whatever its substeps",
                  "softer springs or wider limits; there is nothing to measure against");
    while (true) {
      for (std::size_t k = 0; k < variants_.size(); ++k)
        if (!finish_row(k)) return false;
      study_.reference_converged = converged();
      if (study_.reference_converged || reference_->resolved() || !reference_->can_refine()) break;
      if (!refine()) return false;
    }
    return measure_single() && verify_pressure();
  }

  bool refine() {
    study_.level_begun = reference_->next();
    save();
    const Ending ending = reference_->refine(options_.common);
    study_.levels = reference_->levels();
    if (ending == Ending::kStopped) return false;
    const Level& level = study_.levels.back();
    std::string line = fmt::format("reference: {} substeps", level.substeps);
    if (level.diverged) line += ", diverged";
    if (level.change)
      line += fmt::format(", {:.2e} {} from the one before", level.change->rms, study_.length_unit);
    if (level.order) line += fmt::format(", order {:.2f}", *level.order);
    tell(line);
    save();
    return true;
  }

  // The last change is under a tenth of the smallest error; true where no run has an error.
  bool converged() const {
    if (!reference_->change()) return false;
    for (const Row& row : study_.rows)
      if (row.status == Status::kOk && row.measured.errors.position &&
          !(reference_->change()->rms <= 0.1 * row.measured.errors.position->rms))
        return false;
    return true;
  }

  bool finish_row(std::size_t k) {
    Row& row = study_.rows[k];
    const Variant& variant = variants_[k];
    if (row.status == Status::kDiverged || row.status == Status::kRefused) return true;
    if (row.reference_substeps != reference_->substeps()) {
      const int substeps = reference_->substeps();
      const cache::CacheReader reader(reference_->cache());
      const Measured measured =
          measure_run(variant, options_.base.file, options_.common, reference_->scene(substeps), reader);
      if (measured.outcome.ending == Ending::kStopped) return false;
      row.measured = measured, row.reference_substeps = substeps;
      row.message = measured.outcome.message;
      row.status = measured.outcome.ending == Ending::kDiverged ? Status::kDiverged : Status::kOk;
    }
    if (row.status == Status::kOk && !row.timed) {
      const Timed timed = time_run(variant, options_.common);
      if (timed.outcome.ending == Ending::kStopped)
        return row.status = Status::kNew, row.reference_substeps = 0, false;
      row.timed = timed;
    }
    tell(line_of(row, k));
    save();
    return true;
  }

  std::string line_of(const Row& row, std::size_t k) const {
    std::string line = fmt::format("run {}/{} {}: ", k + 1, variants_.size(), row.label);
    if (row.status == Status::kDiverged) return line + row.message;
    line += fmt::format("{:.4g} ms a frame", row.timed->milliseconds);
    const auto& error = row.measured.errors.position;
    return line + (error ? fmt::format(", error {:.2e} {}", error->rms, study_.length_unit)
                         : std::string(", no strand to compare"));
  }

  // The reference once more in single precision: what is left between the two is float's.
  bool measure_single() {
    const int substeps = reference_->substeps();
    if (study_.single.substeps == substeps) return true;
    Variant variant;
    variant.overrides = reference_->overrides(substeps);
    variant.machine = options_.base.machine;
    variant.machine.options.precision = pipeline::Precision::kFloat;
    variant.machine.options.backend = pipeline::Backend::kCpu;
    study_.single = {substeps, {}, {}};
    try {
      const cache::CacheReader reader(reference_->cache());
      const Measured measured =
          measure_run(variant, options_.base.file, options_.common, reference_->scene(substeps), reader);
      if (measured.outcome.ending == Ending::kStopped) return study_.single = {}, false;
      study_.single.errors = measured.errors;
      study_.single.message = measured.outcome.message;
    } catch (const Error& error) {  // a scene that single precision is refused for
      if (error.kind() != ErrorKind::kInput && error.kind() != ErrorKind::kUsage) throw;
      study_.single.message = error.what();
    }
    return true;
  }

  // The grid's pressure solver on a problem whose solution is known, where a run has one.
  bool verify_pressure() {
    if (!study_.has_grid) return true;
    std::vector<PressureLevel>& levels = study_.pressure;
    while (levels.size() < std::size(kPressureEdges)) {
      if (options_.common.stop && *options_.common.stop) return false;
      levels.push_back(
          pressure_level(kPressureEdges[levels.size()], kPressureResidual, options_.base.machine));
      std::string line =
          fmt::format("pressure: {} cells across, error {:.2e}", levels.back().edge, levels.back().rms);
      if (levels.size() > 1) line += fmt::format(", order {:.2f}", pressure_orders(levels).rms.back());
      tell(line);
      save();
    }
    return true;
  }

  void tell(const std::string& line) const {
    if (options_.tell) options_.tell(line);
  }

  void save() {
    study_.levels = reference_->levels();
    study_.reference_substeps = reference_->substeps();
    study_.resolution = reference_->resolution();
    study_.resampled = std::any_of(study_.rows.begin(), study_.rows.end(),
                                   [](const Row& row) { return row.measured.resampled; });
    write_text(options_.directory / "study.json", to_json(study_));
    write_text(options_.directory / "study.csv", to_csv(study_));
  }

  const Options& options_;
  std::vector<Variant> variants_;
  Study study_;
  std::optional<Reference> reference_;
  std::vector<int> replaced_;  // levels of the study that is overwritten
};

std::optional<double> numeric(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

Study run_study(const Options& options) { return Running(options).run(); }

bool reference_converges(const Study& study) {
  if (study.reference_converged) return true;
  const Level* last = nullptr;  // that is complete
  for (const Level& level : study.levels)
    if (!level.diverged) last = &level;
  return !last || !last->order || *last->order > 0 || last->change->rms <= study.resolution;
}

Answers answer(const Study& study) {
  const std::vector<Point> points = points_of(study);
  Answers answers;
  answers.beaten.resize(points.size());
  if (!reference_converges(study)) return answers;
  answers.front = pareto_front(points);
  for (std::size_t k = 0; k < points.size(); ++k) answers.beaten[k] = dominating(points, answers.front, k);
  for (std::size_t k = 0; k < points.size(); ++k)
    if (!std::isfinite(points[k].milliseconds) || !std::isfinite(points[k].error)) answers.beaten[k].reset();
  answers.knee = knee(points, answers.front);
  answers.digit_cost = digit_cost(points, answers.front);
  if (study.wanted.budget || study.wanted.target) answers.picked = pick(points, study.wanted);
  return answers;
}

std::vector<Order> orders_of(const Study& study) {
  std::vector<Order> found;
  for (std::size_t a = 0; a < study.axes.size(); ++a) {
    std::vector<bool> done(study.rows.size(), false);
    for (std::size_t first = 0; first < study.rows.size(); ++first) {
      Order order{a, {}, {}, {}, {}};
      for (std::size_t k = first; k < study.rows.size(); ++k) {
        const Row& row = study.rows[k];
        bool same =
            !done[k] && row.status == Status::kOk && row.measured.errors.position && numeric(row.columns[a]);
        for (std::size_t other = 0; other < study.axes.size() && same; ++other)
          same = other == a || row.columns[other] == study.rows[first].columns[other];
        if (same) order.rows.push_back(k);
      }
      for (const std::size_t k : order.rows) done[k] = true;
      if (order.rows.size() < 2) continue;
      std::sort(order.rows.begin(), order.rows.end(), [&](std::size_t x, std::size_t y) {
        return *numeric(study.rows[x].columns[a]) < *numeric(study.rows[y].columns[a]);
      });
      std::vector<double> errors, median_strand;
      for (const std::size_t k : order.rows) {
        order.values.push_back(*numeric(study.rows[k].columns[a]));
        errors.push_back(study.rows[k].measured.errors.position->rms);
        median_strand.push_back(study.rows[k].measured.errors.median_strand.value_or(0));
      }
      order.orders = orders(order.values, errors), order.median_strand = orders(order.values, median_strand);
      found.push_back(std::move(order));
    }
  }
  return found;
}

}  // namespace ringlet::study
