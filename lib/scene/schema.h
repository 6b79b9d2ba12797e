// The scene schema: what it says about each place of a scene. Defaults, units and paths are read from it
// alone.
//
// The dialect is draft-07, of which schemas/scene.schema.json uses: type, properties, required,
// additionalProperties (false), items (one schema), enum, const, the limits of numbers, strings and lists,
// $ref into `definitions`, and if/then/else whose condition uses type, const, required and properties.
// valijson validates (validate.h); here the schema is walked beside a value.
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/json_text.h"

namespace ringlet::scene {

class Schema {
 public:
  Schema();

  const Json& root() const { return root_; }

  // What applies to `value` at `node`: $ref followed (its siblings are annotations and win) and the branch of
  // if/then/else that fits merged in.
  Json effective(Json node, const Json& value) const;

  // The node of `document`'s value at the place that `path` names; null where the schema knows no such place.
  Json node_at(const std::vector<std::string>& path, const Json& document) const;

  // What `node` accepts, in words: `an integer from 1 to 1000`.
  std::string describe(Json node) const;

  // Puts in every default that `document` leaves out, and makes a whole number of type `number` a floating
  // point one, so that 1 and 1.0 are the same scene. `document` is valid.
  void fill_defaults(Json& document) const;

  // Metres in one unit of the scene's lengths. `document` is valid.
  double metres_per_unit(const Json& document) const;

  // The scene with every length in metres. `document` is valid.
  Json in_metres(Json document) const;

  // Calls visit(effective node, value, JSON pointer) for the document and everything in it, parents first.
  // Members that the schema does not know are passed over, so that an invalid document can be visited too.
  using Visit = std::function<void(const Json& node, Json& value, const std::string& pointer)>;
  void walk(Json& document, const Visit& visit) const { walk(root_, document, "", visit); }

 private:
  void walk(const Json& node, Json& value, const std::string& pointer, const Visit& visit) const;
  void fill(const Json& node, Json& value, double metres_per_unit) const;
  Json default_of(const Json& node, double metres_per_unit) const;
  void scale_lengths(const Json& node, Json& value, const std::function<double(double)>& scale) const;

  Json root_;
};

// Metres in a length unit as a scene gives it: one of the schema's names, or a number.
double metres(const Json& length_unit);

}  // namespace ringlet::scene
