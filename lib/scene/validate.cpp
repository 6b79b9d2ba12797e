#include "scene/validate.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

namespace ringlet::scene {
namespace {

using Path = std::vector<std::string>;         // keys and indices from the document's root
using Failures = std::map<Path, std::string>;  // place -> the validator's last word on it

Failures run_validator(const Json& schema_document, const Json& document) {
  valijson::Schema schema;
  valijson::SchemaParser parser;
  parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(schema_document), schema);
  valijson::ValidationResults results;
  valijson::Validator validator;
  validator.validate(schema, valijson::adapters::NlohmannJsonAdapter(document), &results);
  Failures failures;
  for (const valijson::ValidationResults::Error& error : results) {
    Path path;  // the context is "<root>", "[key]", "[0]", ...
    for (std::size_t i = 1; i < error.context.size(); ++i)
      path.push_back(error.context[i].substr(1, error.context[i].size() - 2));
    failures[path] = error.description;
  }
  return failures;
}

// Levenshtein's distance: insertions, deletions and replacements that make `a` into `b`.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, replaced}));
    }
  }
  return row[b.size()];
}

class Explainer {
 public:
  Explainer(const Schema& schema, const Json& document, const std::string& file, const Failures& failures)
      : schema_(schema), document_(document), file_(file), failures_(failures) {}

  std::vector<Problem> explain() {
    for (const auto& [path, description] : failures_) explain_place(path, description);
    return std::move(problems_);
  }

 private:
  // A failure inside a value is reported for each of its parents too: only the innermost place is explained,
  // and an object's or list's own faults.
  void explain_place(const Path& path, const std::string& description) {
    Json::json_pointer pointer;
    for (const std::string& token : path) pointer /= token;
    const Json& value = document_.at(pointer);
    const Json node = schema_.node_at(path, document_);
    const std::string where = file_ + "#" + pointer.to_string();
    const Json here = schema_.effective(node, value);
    if (value.is_object() && here.value("type", "") == "object") {
      const std::size_t before = problems_.size();
      explain_missing(here, value, where);
      explain_unknown(here, value, where);
      if (problems_.size() == before && !fails_inside(path)) problems_.push_back({where, description, ""});
    } else if (value.is_array() && here.value("type", "") == "array" && has_right_size(here, value)) {
      if (!fails_inside(path)) expected(where, value, node);
    } else {
      expected(where, value, node);
    }
  }

  void expected(const std::string& where, const Json& value, const Json& node) {
    problems_.push_back({where, "found " + brief(value) + ", expected " + schema_.describe(node), ""});
  }

  void explain_missing(const Json& node, const Json& value, const std::string& where) {
    for (const std::string key : node.value("required", Json::array())) {
      if (value.contains(key)) continue;
      const std::string wanted = schema_.describe(node["properties"][key]);
      problems_.push_back({where + pointer_token(key), "found nothing, expected " + wanted, ""});
    }
  }

  void explain_unknown(const Json& node, const Json& value, const std::string& where) {
    const Json& known = node["properties"];
    for (const auto& [key, ignored] : value.items()) {
      if (known.contains(key)) continue;
      std::string keys, nearest;
      std::size_t distance = 1 + std::max<std::size_t>(2, key.size() / 3);  // farther is no misspelling
      for (const auto& [candidate, schema] : known.items()) {
        keys += (keys.empty() ? "" : ", ") + candidate;
        const std::size_t to_candidate = edit_distance(key, candidate);
        if (to_candidate < distance) {
          distance = to_candidate;
          nearest = candidate;
        }
      }
      problems_.push_back({where + pointer_token(key), "found an unknown key, expected one of " + keys,
                           nearest.empty() ? "" : "did you mean " + nearest + "?"});
    }
  }

  bool has_right_size(const Json& node, const Json& value) const {
    return value.size() >= node.value("minItems", std::size_t{0}) &&
           value.size() <= node.value("maxItems", std::numeric_limits<std::size_t>::max());
  }

  // The paths are sorted, so those inside `path` follow it directly.
  bool fails_inside(const Path& path) const {
    const auto next = failures_.upper_bound(path);
    return next != failures_.end() && next->first.size() > path.size() &&
           std::equal(path.begin(), path.end(), next->first.begin());
  }

  const Schema& schema_;
  const Json& document_;
  const std::string& file_;
  const Failures& failures_;
  std::vector<Problem> problems_;
};

}  // namespace

std::vector<Problem> validate(const Schema& schema, const Json& document, const std::string& file) {
  return Explainer(schema, document, file, run_validator(schema.root(), document)).explain();
}

}  // namespace ringlet::scene
