#include "study/record.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/json_text.h"

namespace ringlet::study {
namespace {

using Out = nlohmann::ordered_json;

Out number(double value) { return std::isfinite(value) ? Out(value) : Out(nullptr); }

Out spread(const std::optional<Spread>& spread) {
  if (!spread) return nullptr;
  return {{"rms", number(spread->rms)}, {"p99", number(spread->p99)}};
}

Out optional_number(const std::optional<double>& value) { return value ? number(*value) : Out(nullptr); }

Out errors(const Errors& errors) {
  Out out = {{"strands", errors.strands}};
  for (const auto& [name, value] : errors.named()) out[name] = spread(value);
  out["median_strand"] = optional_number(errors.median_strand);
  return out;
}

std::optional<double> read_number(const Json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

std::optional<Spread> read_spread(const Json& json) {
  if (json.is_null()) return std::nullopt;
  const auto value = [&](const char* key) {
    return json[key].is_null() ? INFINITY : json[key].get<double>();
  };
  return Spread{value("rms"), value("p99")};
}

Errors read_errors(const Json& json) {
  return {read_spread(json["error"]),           read_spread(json["velocity"]),    read_spread(json["length"]),
          read_spread(json["volume"]),          read_spread(json["penetration"]), json["strands"],
          read_number(json.at("median_strand"))};
}

Out row_json(const Study& study, const Row& row) {
  Out out = {{"label", row.label}, {"settings", Out::object()}, {"arguments", row.options}};
  for (std::size_t a = 0; a < study.axes.size(); ++a)
    out["settings"][study.axes[a].name] =
        Json::accept(row.columns[a]) ? Out::parse(row.columns[a]) : Out(row.columns[a]);
  out["left_out"] = row.left_out;
  out["status"] = to_string(row.status);
  if (!row.message.empty()) out["message"] = row.message;
  out["ms_per_frame"] = row.timed ? number(row.timed->milliseconds) : Out(nullptr);
  out["stages_ms"] = Out::object();
  if (row.timed)
    for (const auto& [stage, spent] : row.timed->stages) out["stages_ms"][stage] = spent;
  out["frames_timed"] = row.timed ? row.timed->frames : 0;
  out["errors"] = errors(row.measured.errors);
  out["resampled"] = row.measured.resampled;
  out["reference_substeps"] = row.reference_substeps;
  out["strands"] = row.measured.strands;
  out["particles"] = row.measured.particles;
  out["precision"] = row.precision;
  out["backend"] = row.measured.backend;
  out["instruction_set"] = row.measured.instruction_set;
  out["key"] = row.key;
  return out;
}

Out reference_json(const Study& study) {
  Out levels = Out::array();
  for (const Level& level : study.levels)
    levels.push_back({{"substeps", level.substeps},
                      {"diverged", level.diverged},
                      {"change", spread(level.change)},
                      {"order", optional_number(level.order)},
                      {"change_of_median_strand", optional_number(level.median_strand)},
                      {"order_of_median_strand", optional_number(level.median_strand_order)}});
  return {{"precision", "double"},
          {"substeps", study.reference_substeps},
          {"cap", study.reference_cap},
          {"set", study.reference_overrides},
          {"converged", study.reference_converged},
          {"resolution", study.resolution},
          {"levels", levels},
          {"level_begun", study.level_begun},
          {"float_error",
           {{"substeps", study.single.substeps},
            {"message", study.single.message},
            {"errors", errors(study.single.errors)}}}};
}

Out pressure_json(const Study& study) {
  if (!study.has_grid) return nullptr;
  Out levels = Out::array();
  const PressureOrders orders = pressure_orders(study.pressure);
  for (std::size_t k = 0; k < study.pressure.size(); ++k) {
    const PressureLevel& level = study.pressure[k];
    const auto order = [&](const std::vector<double>& of) {
      return k > 0 ? number(of[k - 1]) : Out(nullptr);
    };
    levels.push_back({{"cells_across", level.edge},
                      {"cells", level.cells},
                      {"rms", number(level.rms)},
                      {"largest", number(level.largest)},
                      {"order_rms", order(orders.rms)},
                      {"order_largest", order(orders.largest)},
                      {"iterations", level.iterations},
                      {"residual", number(level.residual)}});
  }
  return {{"expected_order", kPressureOrder}, {"residual", kPressureResidual}, {"levels", levels}};
}

Out answers_json(const Study& study) {
  const Answers answers = answer(study);
  const auto label = [&](const std::optional<std::size_t>& row) {
    return row ? Out(study.rows[*row].label) : Out(nullptr);
  };
  Out out = {{"digit_cost", answers.digit_cost ? number(*answers.digit_cost) : Out(nullptr)},
             {"knee", label(answers.knee)},
             {"front", Out::array()},
             {"wasted", Out::array()},
             {"orders", Out::array()}};
  for (const std::size_t row : answers.front) out["front"].push_back(study.rows[row].label);
  for (std::size_t row = 0; row < study.rows.size(); ++row)
    if (answers.beaten[row])
      out["wasted"].push_back({{"run", study.rows[row].label}, {"instead", label(answers.beaten[row])}});
  for (const Order& order : orders_of(study)) {
    Out found = {{"axis", study.axes[order.axis].name}, {"values", order.values}, {"orders", Out::array()}};
    for (const double value : order.orders) found["orders"].push_back(number(value));
    found["orders_of_median_strand"] = Out::array();
    for (const double value : order.median_strand) found["orders_of_median_strand"].push_back(number(value));
    out["orders"].push_back(found);
  }
  if (!study.wanted.budget && !study.wanted.target) return out;
  out["budget_ms"] = study.wanted.budget ? Out(*study.wanted.budget) : Out(nullptr);
  out["target"] = study.wanted.target ? Out(*study.wanted.target) : Out(nullptr);
  out["picked"] = label(answers.picked);
  out["picked_arguments"] = answers.picked ? Out(study.rows[*answers.picked].options) : Out(nullptr);
  return out;
}

// `stages`: in the order they run, which `json` has lost.
void read_row(const Json& json, const Out& stages, Row& row) {
  const std::string status = json["status"];
  row.status = status == to_string(Status::kOk)        ? Status::kOk
               : status == to_string(Status::kRefused) ? Status::kRefused
                                                       : Status::kDiverged;
  row.message = json.value("message", "");
  if (!json["ms_per_frame"].is_null()) {
    Timed& timed = row.timed.emplace();
    timed.milliseconds = json["ms_per_frame"], timed.frames = json["frames_timed"];
    for (const auto& [stage, spent] : stages.items()) timed.stages.emplace_back(stage, spent);
  }
  row.measured.errors = read_errors(json["errors"]);
  row.measured.resampled = json["resampled"];
  row.reference_substeps = json["reference_substeps"];
  row.measured.strands = json["strands"], row.measured.particles = json["particles"];
  row.measured.backend = json["backend"], row.measured.instruction_set = json["instruction_set"];
}

void read_reference(const Json& json, Study& study) {
  study.levels.clear();
  for (const Json& level : json["levels"]) {
    study.levels.push_back({level["substeps"], level["diverged"], read_spread(level["change"]),
                            read_number(level["order"]), read_number(level.at("change_of_median_strand")),
                            read_number(level.at("order_of_median_strand"))});
  }
  const Json& single = json["float_error"];
  study.single = {single["substeps"], read_errors(single["errors"]), single["message"]};
}

// Levels solved to another residual, or of other grids, are measured anew.
void read_pressure(const Json& json, Study& study) {
  if (!study.has_grid || json.is_null() || json["residual"] != kPressureResidual) return;
  for (const Json& level : json["levels"]) {
    const auto value = [&](const char* key) {
      return level[key].is_null() ? INFINITY : level[key].get<double>();
    };
    if (study.pressure.size() == std::size(kPressureEdges) ||
        level["cells_across"] != kPressureEdges[study.pressure.size()])
      return study.pressure.clear();
    study.pressure.push_back({level["cells_across"], level["cells"], value("rms"), value("largest"),
                              level["iterations"], value("residual")});
  }
}

// A field of a CSV file: quoted where it has to be.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\n") == text.npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string field(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? Json(*value).dump() : "";
}

// Every stage of any run, in the order they run.
std::vector<std::string> all_stages(const Study& study) {
  std::vector<std::string> names;
  for (const Row& row : study.rows)
    if (row.timed)
      for (const auto& [stage, spent] : row.timed->stages)
        if (std::find(names.begin(), names.end(), stage) == names.end()) names.push_back(stage);
  return names;
}

Json parse_study(const std::string& text, const std::string& file) {
  Json json = parse_json(text, file);
  if (!json.is_object() || json.value("format", Json()) != "ringlet-study")
    throw Error(ErrorKind::kInput, file, "is no study", "-o takes another directory");
  return json;
}

void expect_identity(const Json& found, const Json& expected, const std::string& file) {
  std::string differing;
  for (const auto& [name, value] : expected.items()) {
    const Json theirs = found.value(name, Json());
    if (theirs != value)
      differing += (differing.empty() ? "" : ", ") + name + " is " + theirs.dump() + " there and " +
                   value.dump() + " here";
  }
  if (!differing.empty())
    throw Error(ErrorKind::kUsage, file, "is of a study that cannot be gone on with: " + differing,
                "--overwrite replaces it, -o takes another directory");
}

}  // namespace

const char* to_string(Status status) {
  switch (status) {
    case Status::kOk:
      return "ok";
    case Status::kDiverged:
      return "diverged";
    case Status::kRefused:
      return "refused";
    case Status::kNew:
      break;
  }
  return "not run";
}

std::string to_json(const Study& study) {
  Out out = {{"format", "ringlet-study"},
             {"identity", Out::parse(study.identity)},
             {"scene", study.scene},
             {"scene_hash", study.scene_hash},
             {"length_unit", study.length_unit},
             {"processor", study.processor},
             {"frames", {study.frames.first, study.frames.last}},
             {"repeats", study.repeats},
             {"product", study.product},
             {"complete", study.complete},
             {"axes", Out::array()},
             {"reference", reference_json(study)},
             {"pressure", pressure_json(study)},
             {"answers", answers_json(study)},
             {"rows", Out::array()}};
  for (const Axis& axis : study.axes) {
    Out values = Out::array();
    for (const Value& value : axis.values) values.push_back(value.text);
    out["axes"].push_back({{"name", axis.name}, {"values", values}});
  }
  for (const Row& row : study.rows)
    if (row.status != Status::kNew) out["rows"].push_back(row_json(study, row));
  return out.dump(2) + "\n";
}

std::string to_csv(const Study& study) {
  const std::vector<std::string> stages = all_stages(study);
  std::string text;
  const auto add = [&](const std::string& value) {
    text += (text.empty() || text.back() == '\n' ? "" : ",") + value;
  };
  for (const Axis& axis : study.axes) add(field(axis.name));
  add("ms_per_frame");
  for (const auto& [name, value] : Errors{}.named()) add(name + "_rms"), add(name + "_p99");
  add("error_median_strand");
  for (const std::string& stage : stages) add("ms_" + stage);
  for (const char* name : {"strands", "particles", "strands_compared"}) add(name);
  // Those that are varied have their columns already.
  const auto varied = [&](const char* name) {
    return std::any_of(study.axes.begin(), study.axes.end(),
                       [&](const Axis& axis) { return axis.name == name; });
  };
  const bool precision = !varied("precision"), backend = !varied("backend");
  if (precision) add("precision");
  if (backend) add("backend");
  add("status");
  text += "\n";
  for (const Row& row : study.rows) {
    if (row.status == Status::kNew) continue;
    for (const std::string& column : row.columns) add(field(column));
    add(field(row.timed ? std::optional<double>(row.timed->milliseconds) : std::nullopt));
    for (const auto& [name, value] : row.measured.errors.named()) {
      add(field(value ? std::optional<double>(value->rms) : std::nullopt));
      add(field(value ? std::optional<double>(value->p99) : std::nullopt));
    }
    add(field(row.measured.errors.median_strand));
    for (const std::string& stage : stages) {
      std::optional<double> spent;
      if (row.timed)
        for (const auto& [name, milliseconds] : row.timed->stages)
          if (name == stage) spent = milliseconds;
      add(field(spent));
    }
    add(std::to_string(row.measured.strands)), add(std::to_string(row.measured.particles));
    add(std::to_string(row.measured.errors.strands));
    if (precision) add(row.precision);
    if (backend) add(row.measured.backend);
    add(to_string(row.status));
    text += "\n";
  }
  return text;
}

int take_over(const std::string& text, const std::string& file, Study& study) {
  const Json json = parse_study(text, file);
  try {
    expect_identity(json.at("identity"), Json::parse(study.identity), file);
    int rows = 0;
    const Out ordered = Out::parse(text);
    for (std::size_t k = 0; k < json.at("rows").size(); ++k) {
      const Json& row = json["rows"][k];
      for (Row& mine : study.rows)
        if (mine.key == row.at("key")) read_row(row, ordered["rows"][k]["stages_ms"], mine), ++rows;
    }
    read_reference(json.at("reference"), study);
    read_pressure(json.value("pressure", Json()), study);
    return rows;
  } catch (const nlohmann::json::exception& error) {
    throw Error(ErrorKind::kInput, file, std::string("is no study that can be gone on with: ") + error.what(),
                "--overwrite begins anew");
  }
}

std::vector<int> levels_left(const std::string& text, const std::string& file) {
  const Json json = parse_study(text, file);
  std::vector<int> left;
  try {
    const Json& reference = json.at("reference");
    for (const Json& level : reference.at("levels")) left.push_back(level.at("substeps"));
    left.push_back(reference.at("level_begun"));
  } catch (const nlohmann::json::exception&) {  // of an earlier version, whose other directories stay
  }
  return left;
}

}  // namespace ringlet::study
