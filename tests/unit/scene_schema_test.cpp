// The schema is the single source of defaults and words: the code's are those.
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <set>
#include <variant>

#include "scene/schema_text.h"
#include "unit/scene_testing.h"

namespace ringlet::scene {
namespace {

using SceneSchema = SceneTest;

// ---- Defaults
// ----------------------------------------------------------------------------------------------------

// Pointers of all scalar defaults (and of numbers and words in lists) in the schema.
void collect_defaults(const Json& node, const std::string& pointer, std::set<std::string>& found) {
  if (!node.is_structured()) return;
  for (const auto& [key, inner] : node.items()) {
    const std::string here = pointer + "/" + key;
    const bool is_default = key == "default" && node.is_object();
    if (is_default && !(inner.is_structured() && inner.empty()))
      found.insert(here);
    else
      collect_defaults(inner, here, found);
  }
}

struct DefaultCase {
  std::string in_schema;    // pointer, without its /default
  std::string in_resolved;  // pointer
  Json in_struct;
};

Json minimal_hair_mesh() {
  return Json::parse(R"({
    "name": "mesh", "frames": {"last": 2}, "groom": [{"hair_mesh": {"file": "a.hair", "density": 9}, "attach": "fixed"},
              {"hair_mesh": {"file": "b.hair", "strands": 9}, "attach": "fixed"}],
    "model": {"type": "hair_mesh", "hair_mesh": {"ellipsoids": [{"centre": [0, 0, 0], "radii": [1, 1, 1]}]}}})");
}

// Of that scene.
std::vector<DefaultCase> hair_mesh_defaults(const Scene& s) {
  const HairMeshStrands& strands = *s.grooms[0].hair_mesh;
  const HairMeshModel& model = *s.model.hair_mesh;
  const Ellipsoid& ellipsoid = model.ellipsoids[0];
  const std::string in_strands = "/definitions/hair_mesh_strands/properties/",
                    in_model = "/definitions/hair_mesh_model/properties/",
                    in_ellipsoid = "/definitions/ellipsoid/properties/",
                    of_type = "/definitions/model/then/properties/";
  std::vector<DefaultCase> cases = {
      {of_type + "substeps", "/model/substeps", s.model.substeps},
      {of_type + "geometric_stiffness", "/model/geometric_stiffness", s.model.geometric_stiffness},
      {of_type + "material_damping", "/model/material_damping", s.model.material_damping},
      {of_type + "angular_tangent", "/model/angular_tangent",
       s.model.angular_tangent == AngularTangent::kConsistent ? "consistent" : "another"},
      {of_type + "integrity_tangent", "/model/integrity_tangent",
       s.model.integrity_tangent == IntegrityTangent::kExact ? "exact" : "another"},
      {in_model + "start", "/model/hair_mesh/start",
       model.start == HairMeshStart::kRest ? "rest" : "another"},
      {in_ellipsoid + "rotate", "/model/hair_mesh/ellipsoids/0/rotate",
       Json::array(
           {ellipsoid.rotation.x(), ellipsoid.rotation.y(), ellipsoid.rotation.z(), ellipsoid.rotation.w()})},
      {in_ellipsoid + "follow", "/model/hair_mesh/ellipsoids/0/follow",
       ellipsoid.follows_head ? "head" : "another"},
      {in_ellipsoid + "friction", "/model/hair_mesh/ellipsoids/0/friction", ellipsoid.friction}};
  const auto add = [&](const std::string& in_schema, const std::string& block, const char* key,
                       const Json& value) {
    cases.push_back({in_schema + key, block + key, value});
  };
  const std::string groom = "/groom/0/hair_mesh/", of_model = "/model/hair_mesh/";
  add(in_strands, "/groom/1/hair_mesh/", "density", s.grooms[1].hair_mesh->density);
  add(in_strands, groom, "strands", strands.strands), add(in_strands, groom, "particles", strands.particles);
  add(in_strands, groom, "seed", strands.seed), add(in_strands, groom, "curl_radius", strands.curl_radius);
  add(in_strands, groom, "curl_turns", strands.curl_turns), add(in_strands, groom, "noise", strands.noise);
  add(in_strands, groom, "noise_waves", strands.noise_waves);
  add(in_model, of_model, "density", model.density), add(in_model, of_model, "stretch", model.stretch);
  add(in_model, of_model, "stretch_across", model.stretch_across),
      add(in_model, of_model, "shear", model.shear);
  add(in_model, of_model, "horizontal", model.horizontal), add(in_model, of_model, "bend", model.bend);
  add(in_model, of_model, "bend_across", model.bend_across), add(in_model, of_model, "volume", model.volume);
  add(in_model, of_model, "damping", model.damping), add(in_model, of_model, "drag", model.drag);
  add(in_model, of_model, "residual", model.residual),
      add(in_model, of_model, "max_iterations", model.max_iterations);
  add(in_model, of_model, "deformation_minimisation", model.deformation_minimisation);
  return cases;
}

TEST_F(SceneSchema, FillsInExactlyTheSchemasDefaults) {
  const Scene s = load_json(Json::parse(R"({
    "name": "defaults", "frames": {"last": 2}, "motion": {"keys": [{"frame": 1}]},
    "head": {"mesh": "head.obj", "animation": {"keys": [{"frame": 1}]}},
    "groom": [{"file": "a.hair", "stiffness": [{"curve": [[0, 1]]}]}, {"grow": {"strands_per_triangle": 1}},
              {"file": "b.hair", "attach": "fixed"},
              {"name": "few", "grow": {"strands": 5}, "interpolate": {"count": 2}}],
    "effects": {"grooming": [{"frame": 1, "groom": "b", "trim": {"box": [[0, 0, 0], [1, 1, 1]]}},
                             {"frame": 1, "groom": "b", "lengthen": {"by": 1}},
                             {"frame": 1, "groom": "b", "comb": {"curve": [[0, 0, 0], [1, 1, 1]], "radius": 1}}],
                "inextensible": {}, "non_hookean": {},
                "hair_hair": {"grid": {"shelter": {}}, "contacts": {}}, "solids": [{"source": "head"}],
                "wind": {"velocity": [1, 0, 0], "gusts": {}, "turbulence": {}, "shelter": {}}}})"));
  const Key &key = s.head->animation.keys[0], &carrier = s.head->animation.carrier[0];
  const Groom& groom = s.grooms[0];
  const Grow& grow = *s.grooms[1].grow;
  const Solid& solid = s.effects.solids[0];
  const Wind& wind = *s.effects.wind;
  const HairGrid& grid = *s.effects.hair_hair->grid;
  const HairContacts& contacts = *s.effects.hair_hair->contacts;
  const auto is = [](auto value, auto expected) { return value == expected; };
  const auto word = [](bool right, const char* name) { return right ? Json(name) : Json("another word"); };
  const std::string props = "/properties/", defs = "/definitions/", air = "/definitions/wind/properties/";
  const std::vector<DefaultCase> cases = {
      {props + "frames/properties/first", "/frames/first", s.frames.first},
      {props + "frames/properties/fps", "/frames/fps", s.frames.fps},
      {props + "frames/properties/preroll", "/frames/preroll", s.frames.preroll},
      {props + "units/properties/length", "/units/length", word(is(s.units.metres_per_unit, 1.0), "m")},
      {props + "units/properties/up", "/units/up", word(is(s.units.up, Axis::kY), "y")},
      {props + "effects/properties/collision/properties/iterations", "/effects/collision/iterations",
       s.effects.collision.iterations},
      {defs + "non_hookean/properties/memory", "/effects/non_hookean/memory",
       word(is(s.effects.non_hookean->memory, Memory::kPermanent), "permanent")},
      {defs + "non_hookean/properties/curve", "/effects/non_hookean/curve", s.effects.non_hookean->curve},
      {air + "gusts/properties/strength", "/effects/wind/gusts/strength", wind.gusts->strength},
      {air + "gusts/properties/period", "/effects/wind/gusts/period", wind.gusts->period},
      {air + "gusts/properties/seed", "/effects/wind/gusts/seed", wind.gusts->seed},
      {air + "turbulence/properties/strength", "/effects/wind/turbulence/strength",
       wind.turbulence->strength},
      {air + "turbulence/properties/scale", "/effects/wind/turbulence/scale", wind.turbulence->scale},
      {air + "turbulence/properties/octaves", "/effects/wind/turbulence/octaves", wind.turbulence->octaves},
      {air + "turbulence/properties/seed", "/effects/wind/turbulence/seed", wind.turbulence->seed},
      {air + "normal_drag/properties/linear", "/effects/wind/normal_drag/linear", wind.normal.linear},
      {air + "normal_drag/properties/quadratic", "/effects/wind/normal_drag/quadratic",
       wind.normal.quadratic},
      {air + "tangential_drag/properties/linear", "/effects/wind/tangential_drag/linear",
       wind.tangential.linear},
      {air + "tangential_drag/properties/quadratic", "/effects/wind/tangential_drag/quadratic",
       wind.tangential.quadratic},
      {air + "linear_density", "/effects/wind/linear_density", wind.linear_density},
      {air + "shelter/properties/strength", "/effects/wind/shelter/strength", wind.shelter->strength},
      {air + "shelter/properties/wake", "/effects/wind/shelter/wake", wind.shelter->wake},
      {defs + "trim/properties/keep", "/effects/grooming/0/trim/keep",
       word(!std::get<Trim>(s.effects.grooming[0].what).keep_inside, "outside")},
      {defs + "lengthen/properties/mode", "/effects/grooming/1/lengthen/mode",
       word(is(std::get<Lengthen>(s.effects.grooming[1].what).mode, Lengthening::kExtend), "extend")},
      {defs + "comb/properties/strength", "/effects/grooming/2/comb/strength",
       std::get<Comb>(s.effects.grooming[2].what).strength},
      {defs + "interpolate/properties/neighbours", "/groom/3/interpolate/neighbours",
       s.grooms[3].interpolate->neighbours},
      {props + "limits/properties/edge_strain", "/limits/edge_strain", s.limits.edge_strain},
      {props + "limits/properties/speed", "/limits/speed", s.limits.speed},
      {props + "cache/properties/fields", "/cache/fields", s.cache.fields},
      {props + "cache/properties/strands", "/cache/strands",
       word(is(s.cache.strands, StoredStrands::kAll), "all")},
      {props + "cache/properties/compression", "/cache/compression",
       word(is(s.cache.compression, Compression::kDefault), "default")},
      {props + "cache/properties/error", "/cache/error", s.cache.error},
      {props + "motion/properties/interpolation", "/motion/interpolation",
       word(is(s.head->animation.carrier_interpolation, Interpolation::kSmooth), "smooth")},
      {props + "motion/properties/speed", "/motion/speed", s.head->animation.speed},
      {props + "motion/properties/keys/items/properties/translate",
       "/motion/keys/0/translate",
       {carrier.translate.x(), carrier.translate.y(), carrier.translate.z()}},
      {props + "motion/properties/keys/items/properties/rotate",
       "/motion/keys/0/rotate",
       {carrier.rotate.x(), carrier.rotate.y(), carrier.rotate.z(), carrier.rotate.w()}},
      {defs + "key/properties/translate",
       "/head/animation/keys/0/translate",
       {key.translate.x(), key.translate.y(), key.translate.z()}},
      {defs + "key/properties/rotate",
       "/head/animation/keys/0/rotate",
       {key.rotate.x(), key.rotate.y(), key.rotate.z(), key.rotate.w()}},
      {defs + "key/properties/scale", "/head/animation/keys/0/scale", key.scale},
      {defs + "mesh_animation/properties/loop", "/head/animation/loop", s.head->animation.loop},
      {defs + "mesh_animation/properties/interpolation", "/head/animation/interpolation",
       word(is(s.head->animation.interpolation, Interpolation::kSmooth), "smooth")},
      {defs + "groom_animation/properties/interpolation", "/groom/0/animation/interpolation",
       word(is(groom.animation.interpolation, Interpolation::kSmooth), "smooth")},
      {defs + "groom/properties/attach", "/groom/0/attach",
       word(is(groom.attach, Attach::kNearest), "nearest")},
      {defs + "groom/properties/attach_distance", "/groom/0/attach_distance", groom.attach_distance},
      {defs + "groom/properties/root_offset", "/groom/0/root_offset",
       word(is(groom.root_offset, RootOffset::kKeep), "keep")},
      {defs + "groom/properties/penetration", "/groom/0/penetration",
       word(is(groom.penetration, Penetration::kPushOut), "push_out")},
      {defs + "groom/then/properties/name", "/groom/1/name", s.grooms[1].name},
      {defs + "groom/else/properties/width", "/groom/0/width", groom.width},
      {defs + "stiffness_scale/properties/group", "/groom/0/stiffness/0/group", groom.stiffness[0].group},
      {defs + "stiffness_scale/properties/coupling", "/groom/0/stiffness/0/coupling",
       groom.stiffness[0].coupling},
      {defs + "grow/properties/scalp/properties/max_angle_degrees", "/groom/1/grow/scalp/max_angle_degrees",
       grow.scalp.max_angle * 180 / std::numbers::pi},
      {defs + "grow/properties/strands_per_triangle", "/groom/3/grow/strands_per_triangle",
       s.grooms[3].grow->strands_per_triangle},
      {defs + "grow/properties/strands", "/groom/1/grow/strands", grow.strands},
      {defs + "grow/properties/seed", "/groom/1/grow/seed", grow.seed},
      {defs + "grow/properties/particles", "/groom/1/grow/particles", grow.particles},
      {defs + "grow/properties/step", "/groom/1/grow/step", grow.step},
      {defs + "grow/properties/length_variation", "/groom/1/grow/length_variation", grow.length_variation},
      {defs + "grow/properties/direction_noise", "/groom/1/grow/direction_noise", grow.direction_noise},
      {defs + "grow/properties/gravity_influence", "/groom/1/grow/gravity_influence", grow.gravity_influence},
      {defs + "grow/properties/max_deviation", "/groom/1/grow/max_deviation", grow.max_deviation},
      {defs + "grow/properties/helix_radius", "/groom/1/grow/helix_radius", grow.helix_radius},
      {defs + "grow/properties/helix_frequency", "/groom/1/grow/helix_frequency", grow.helix_frequency},
      {defs + "grow/properties/helix_impact", "/groom/1/grow/helix_impact", grow.helix_impact},
      {defs + "grow/properties/width", "/groom/1/grow/width", grow.width},
      {defs + "model/properties/type", "/model/type", word(is(s.model.type, ModelType::kAms), "ams")},
      {defs + "model/properties/scheme", "/model/scheme",
       word(is(s.model.scheme, Scheme::kProjected), "projected")},
      {defs + "model/properties/stiffness/properties/edge", "/model/stiffness/edge", s.model.stiffness.edge},
      {defs + "model/properties/stiffness/properties/bend", "/model/stiffness/bend", s.model.stiffness.bend},
      {defs + "model/properties/stiffness/properties/twist", "/model/stiffness/twist",
       s.model.stiffness.twist},
      {defs + "model/properties/stiffness/properties/integrity", "/model/stiffness/integrity",
       s.model.stiffness.integrity},
      {defs + "model/properties/stiffness/properties/angular", "/model/stiffness/angular",
       s.model.stiffness.angular},
      {defs + "model/properties/particle_mass", "/model/particle_mass", s.model.particle_mass},
      {defs + "model/else/properties/substeps", "/model/substeps", s.model.substeps},
      {defs + "model/properties/drag", "/model/drag", s.model.drag},
      {defs + "model/properties/clamped_particles", "/model/clamped_particles", s.model.clamped_particles},
      {defs + "model/properties/preload", "/model/preload", s.model.preload},
      {defs + "model/else/else/properties/geometric_stiffness", "/model/geometric_stiffness",
       s.model.geometric_stiffness},
      {defs + "model/else/else/properties/material_damping", "/model/material_damping",
       s.model.material_damping},
      {defs + "model/else/else/properties/angular_tangent", "/model/angular_tangent",
       word(is(s.model.angular_tangent, AngularTangent::kConsistent), "consistent")},
      {defs + "model/else/else/properties/integrity_tangent", "/model/integrity_tangent",
       word(is(s.model.integrity_tangent, IntegrityTangent::kExact), "exact")},
      {defs + "inextensible/properties/tolerance", "/effects/inextensible/tolerance",
       s.effects.inextensible->tolerance},
      {defs + "inextensible/properties/max_iterations", "/effects/inextensible/max_iterations",
       s.effects.inextensible->max_iterations},
      {defs + "inextensible/properties/metric", "/effects/inextensible/metric",
       word(is(s.effects.inextensible->metric, LengthMetric::kAuto), "auto")},
      {defs + "inextensible/properties/per", "/effects/inextensible/per",
       word(is(s.effects.inextensible->cadence, Cadence::kSubstep), "substep")},
      {defs + "hair_grid/properties/resolution", "/effects/hair_hair/grid/resolution", grid.resolution},
      {defs + "hair_grid/properties/pic", "/effects/hair_hair/grid/pic", grid.pic},
      {defs + "hair_grid/properties/residual", "/effects/hair_hair/grid/residual", grid.residual},
      {defs + "hair_grid/properties/max_iterations", "/effects/hair_hair/grid/max_iterations",
       grid.max_iterations},
      {defs + "hair_grid/properties/passes", "/effects/hair_hair/grid/passes", grid.passes},
      {defs + "hair_grid/properties/cadence", "/effects/hair_hair/grid/cadence",
       word(is(grid.cadence, Cadence::kFrame), "frame")},
      {defs + "hair_grid/properties/shelter/properties/strength", "/effects/hair_hair/grid/shelter/strength",
       *grid.shelter},
      {defs + "hair_contacts/properties/friction", "/effects/hair_hair/contacts/friction", contacts.friction},
      {defs + "hair_contacts/properties/passes", "/effects/hair_hair/contacts/passes", contacts.passes},
      {defs + "hair_contacts/properties/cadence", "/effects/hair_hair/contacts/cadence",
       word(is(contacts.cadence, Cadence::kFrame), "frame")},
      {defs + "solid/properties/friction", "/effects/solids/0/friction", solid.friction},
      {defs + "solid/properties/offset", "/effects/solids/0/offset", solid.offset},
      {defs + "solid/properties/resolution", "/effects/solids/0/resolution", solid.resolution},
      {defs + "solid/properties/half_width", "/effects/solids/0/half_width", solid.half_width},
  };
  const Json schema = Json::parse(schema_text());
  const Json resolved = Json::parse(s.resolved);
  std::set<std::string> in_schema, tested;
  collect_defaults(schema, "", in_schema);
  const auto test = [&](const Json& as_resolved, const std::vector<DefaultCase>& list) {
    for (const DefaultCase& c : list) {
      const Json& value = schema.at(Json::json_pointer(c.in_schema + "/default"));
      EXPECT_EQ(as_resolved.at(Json::json_pointer(c.in_resolved)), value) << c.in_schema;
      EXPECT_EQ(c.in_struct, value) << c.in_schema;
      tested.insert(c.in_schema + "/default");
    }
  };
  test(resolved, {std::begin(cases), std::end(cases)});
  const Scene chosen = load_json(minimal(), {"/model/substeps={}"});
  const SubstepChoice& choice = *chosen.model.substep_choice;
  const std::string of_choice = defs + "substep_choice/properties/";
  test(Json::parse(chosen.resolved),
       {{of_choice + "tolerance", "/model/substeps/tolerance", choice.tolerance},
        {of_choice + "min", "/model/substeps/min", choice.min},
        {of_choice + "max", "/model/substeps/max", choice.max}});
  const Scene mesh = load_json(minimal_hair_mesh());
  test(Json::parse(mesh.resolved), hair_mesh_defaults(mesh));
  for (const char* name : {"geometric_stiffness", "material_damping", "angular_tangent", "integrity_tangent"})
    tested.insert(defs + "model/else/then/properties/" + name + "/default");  // below
  EXPECT_EQ(tested, in_schema) << "a default without a test, or a test without a default";
}

// The drag of a thin cylinder in air, force per metre [N/m] at a speed [m/s]: across it by the correlation of
// Sucker and Brauer (1975), along it by that of Glauert and Lighthill (1955) for its boundary layer, averaged
// over 0.2 m.
constexpr double kDiameter = 8e-5, kViscosity = 1.5e-5, kDensity = 1.2;  // [m], kinematic [m^2/s], [kg/m^3]

double drag_across(double speed) {
  const double re = speed * kDiameter / kViscosity;
  const double coefficient =
      1.18 + 6.8 / std::pow(re, 0.89) + 1.96 / std::sqrt(re) - 4e-4 * re / (1 + 3.64e-7 * re * re);
  return 0.5 * kDensity * speed * speed * kDiameter * coefficient;
}

double drag_along(double speed) {
  constexpr double kLength = 0.2, kEuler = 0.5772156649, kRadius = kDiameter / 2;
  constexpr int kParts = 1000;
  double sum = 0;
  for (int k = 0; k < kParts; ++k) {
    const double x = kLength * (k + 0.5) / kParts;
    const double layer = std::log(4 * kViscosity * x / (speed * kRadius * kRadius)) - kEuler;
    if (layer > 1)
      sum += 4 * std::numbers::pi * kDensity * kViscosity * speed / layer;  // behind the very front
  }
  return sum / kParts;
}

TEST_F(SceneSchema, DefaultDragIsThatOfAHairInAir) {
  const Wind wind = *load_json(minimal(), {"/effects/wind/velocity=[1,0,0]"}).effects.wind;
  for (double speed = 0.3; speed < 20.1; speed *= 1.1) {
    const auto force = [&](const DragCoefficients& drag) {
      return drag.linear * speed + drag.quadratic * speed * speed;
    };
    EXPECT_NEAR(force(wind.normal) / drag_across(speed), 1, 0.12) << speed;
    EXPECT_NEAR(force(wind.tangential) / drag_along(speed), 1, 0.14) << speed;
  }
}

TEST_F(SceneSchema, TakesThePapersVariantsFromItsScheme) {
  const Json variants = Json::parse(schema_text())["definitions"]["model"]["else"]["then"]["properties"];
  const Scene paper = load_json(minimal(), {"/model/scheme=\"paper\""});
  const Json resolved = Json::parse(paper.resolved)["model"];
  EXPECT_EQ(resolved["geometric_stiffness"], variants["geometric_stiffness"]["default"]);
  EXPECT_EQ(resolved["material_damping"], variants["material_damping"]["default"]);
  EXPECT_EQ(resolved["angular_tangent"], variants["angular_tangent"]["default"]);
  EXPECT_EQ(resolved["integrity_tangent"], variants["integrity_tangent"]["default"]);
  EXPECT_EQ(paper.model.scheme, Scheme::kPaper);
  EXPECT_FALSE(paper.model.geometric_stiffness);
  EXPECT_EQ(paper.model.material_damping, 0);
  EXPECT_EQ(paper.model.angular_tangent, AngularTangent::kPaper);
  EXPECT_EQ(paper.model.integrity_tangent, IntegrityTangent::kPaper);
  EXPECT_TRUE(paper.model.preload) << "stays on";

  const Scene own = load_json(minimal(), {"/model/scheme=\"paper\"", "/model/material_damping=0.01",
                                          "/model/integrity_tangent=\"exact\""});
  EXPECT_EQ(own.model.material_damping, 0.01) << "what the scene says wins";
  EXPECT_EQ(own.model.integrity_tangent, IntegrityTangent::kExact);
  EXPECT_FALSE(own.model.geometric_stiffness);
}

// ---- The schema itself
// -------------------------------------------------------------------------------------------

// Calls visit(node, pointer) for each schema that describes a value (not those of if/then/else's conditions).
template <class Visit>
void each_value_schema(const Json& node, const std::string& pointer, const Visit& visit) {
  if (!node.is_object()) return;
  visit(node, pointer);
  if (node.contains("properties"))
    for (const auto& [key, inner] : node["properties"].items())
      each_value_schema(inner, pointer + "/properties/" + key, visit);
  if (node.contains("items")) each_value_schema(node["items"], pointer + "/items", visit);
  if (node.contains("definitions"))
    for (const auto& [key, inner] : node["definitions"].items())
      each_value_schema(inner, pointer + "/definitions/" + key, visit);
  if (node.contains("properties") || !node.contains("if")) return;
  for (const char* branch : {"then", "else"})
    if (node.contains(branch)) each_value_schema(node[branch], pointer + "/" + branch, visit);
}

TEST_F(SceneSchema, IsTheOneInTheRepository) {
  std::ifstream stream(RINGLET_SOURCE_DIR "/schemas/scene.schema.json");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), schema_text());
}

TEST_F(SceneSchema, IsClosedDescribedAndHasUnits) {
  each_value_schema(Json::parse(schema_text()), "", [](const Json& node, const std::string& pointer) {
    const std::string type = node.value("type", "");
    if (type == "number") {
      EXPECT_TRUE(node.contains("unit")) << pointer;
    }
    if (type == "integer") {
      EXPECT_TRUE(node.contains("minimum") && node.contains("maximum")) << pointer;
    }
    if (type == "array") {
      EXPECT_TRUE(node["items"].is_object()) << pointer;
    }
    if (type != "object") return;
    EXPECT_EQ(node.value("additionalProperties", true), false) << pointer;
    for (const auto& [key, inner] : node["properties"].items()) {
      EXPECT_TRUE(inner.contains("description") || inner.contains("$ref"))
          << pointer << "/properties/" << key;
    }
  });
}

TEST_F(SceneSchema, KnowsEveryWordOfTheSchema) {
  const Json schema = Json::parse(schema_text());
  const std::tuple<const char*, const char*> words[] = {
      {"/definitions/axis/enum", "/units/up"},
      {"/definitions/length_unit/then/enum", "/units/length"},
      {"/definitions/interpolation/enum", "/head/animation/interpolation"},
      {"/definitions/groom/properties/attach/enum", "/groom/0/attach"},
      {"/definitions/groom/properties/root_offset/enum", "/groom/0/root_offset"},
      {"/definitions/groom/properties/penetration/enum", "/groom/0/penetration"},
      {"/definitions/stiffness_scale/properties/coupling/enum", "/groom/0/stiffness/0/coupling"},
      {"/definitions/model/properties/scheme/enum", "/model/scheme"},
      {"/definitions/model/properties/angular_tangent/enum", "/model/angular_tangent"},
      {"/definitions/model/properties/integrity_tangent/enum", "/model/integrity_tangent"},
      {"/definitions/inextensible/properties/metric/enum", "/effects/inextensible/metric"},
      {"/definitions/inextensible/properties/per/enum", "/effects/inextensible/per"},
      {"/definitions/non_hookean/properties/memory/enum", "/effects/non_hookean/memory"},
      {"/definitions/cadence/enum", "/effects/hair_hair/grid/cadence"},
      {"/definitions/trim/properties/keep/enum", "/effects/grooming/1/trim/keep"},
      {"/definitions/lengthen/properties/mode/enum", "/effects/grooming/7/lengthen/mode"},
      {"/properties/cache/properties/strands/enum", "/cache/strands"},
      {"/properties/cache/properties/compression/enum", "/cache/compression"},
  };
  for (const auto& [in_schema, in_scene] : words)
    for (const Json& word : schema.at(Json::json_pointer(in_schema)))
      EXPECT_NO_THROW(load_json(full(), {std::string(in_scene) + "=" + word.dump()})) << in_scene << word;
  const std::tuple<const char*, const char*> mesh_words[] = {
      {"/definitions/hair_mesh_model/properties/start/enum", "/model/hair_mesh/start"},
      {"/definitions/ellipsoid/properties/follow/enum", "/model/hair_mesh/ellipsoids/0/follow"},
  };
  for (const auto& [in_schema, in_scene] : mesh_words)
    for (const Json& word : schema.at(Json::json_pointer(in_schema)))
      EXPECT_NO_THROW(load_json(full_hair_mesh(), {std::string(in_scene) + "=" + word.dump()}))
          << in_scene << word;
  // full() softens, which ams alone does; only a hair mesh goes with every model.
  for (const Json& word : schema.at("/definitions/model/properties/type/enum"_json_pointer))
    EXPECT_NO_THROW(load_json(full_hair_mesh(), {"/model={}", "/model/type=" + word.dump()})) << word;
  std::size_t enums = 0;
  each_value_schema(schema, "",
                    [&](const Json& node, const std::string&) { enums += node.contains("enum"); });
  EXPECT_EQ(enums, std::size(words) + std::size(mesh_words) + 2)
      << "all but cache.fields, which stay words, and model.type";
}

}  // namespace
}  // namespace ringlet::scene
