// `ringlet study`: what accuracy costs. Runs a scene with one setting after another changed, measures time
// and error of each, and answers from them.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "study/front.h"
#include "study/pressure_order.h"
#include "study/reference.h"

namespace ringlet::study {

struct Options {
  Base base;
  std::vector<Axis> axes;
  bool product = false;
  std::vector<std::string> reference;  // overrides that the reference has beside those of the scene
  int reference_cap = 1000;            // most substeps of the reference
  Wanted wanted;
  std::filesystem::path directory;
  Common common;
  bool resume = false, overwrite = false;
  std::function<void(const std::string&)> tell;  // after each run, a line for people
};

// kRefused: its values do not go together, though each goes with others.
enum class Status { kNew, kOk, kDiverged, kRefused };

struct Row {
  std::string label, key;
  std::vector<std::string> columns;            // [axes]
  std::vector<std::string> options, left_out;  // as Variant's
  int axis = -1;
  Status status = Status::kNew;
  std::string message;
  std::string precision;
  Measured measured;
  std::optional<Timed> timed;
  int reference_substeps = 0;  // of the reference that the errors are from
};

// Float's own error: the reference in single precision against itself in double.
struct Single {
  int substeps = 0;  // 0: not measured
  Errors errors;
  std::string message;  // why there are none
};

struct Answers {
  std::vector<std::size_t> front;  // indices of rows
  std::vector<std::optional<std::size_t>>
      beaten;  // [rows] the row of the front that is quicker and as accurate
  std::optional<std::size_t> knee, picked;
  std::optional<double> digit_cost;
};

struct Order {  // of convergence along an axis, all other settings the same
  std::size_t axis;
  std::vector<std::size_t> rows;       // by value
  std::vector<double> values, orders;  // one order fewer than values; of the RMS error
  std::vector<double> median_strand;   // of the median strand's
};

struct Study {
  std::string identity;  // JSON: what rows must share to be compared
  std::string scene, scene_hash, length_unit, processor;
  pipeline::FrameRange frames{};
  int repeats = 0;
  bool product = false, complete = false;
  Wanted wanted;
  std::vector<Axis> axes;
  std::vector<std::string> names;  // short, of the axes
  std::vector<Row> rows;
  std::vector<std::string> reference_overrides;
  std::vector<Level> levels;
  int level_begun = 0;  // substeps of the level that was begun last; 0: none
  int reference_substeps = 0, reference_cap = 0;
  bool reference_converged = false;  // the last change is under a tenth of the smallest error
  double resolution = 0;
  Single single;
  bool has_grid = false;                // some run of it
  std::vector<PressureLevel> pressure;  // of kPressureEdges, as far as it got; none without a grid
  bool measures_volume = false, measures_penetration = false, resampled = false;
};

// Runs what is missing and writes study.json, study.csv, plot.svg and report.md into the directory, the first
// two after every run. With `resume` it goes on with the study of the same identity there; with `overwrite`
// it removes what its study.json tells of. Returns early, with `complete` false, where options.common.stop
// says so. Throws Error{kInput, kUsage} before anything runs or is removed, for settings that cannot be and
// for `resume` of another study; Error{kDiverged} where no reference can be made; Error{kIo}.
Study run_study(const Options& options);

// False where the reference's last change is no smaller than the one before, though larger than what single
// precision shows: then nothing is known of how far it is from what it stands for.
bool reference_converges(const Study& study);

// Without any answer where the reference does not converge.
Answers answer(const Study& study);
std::vector<Order> orders_of(const Study& study);

}  // namespace ringlet::study
