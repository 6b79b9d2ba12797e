// Bad scenes: every rule of the schema broken, and the text that the user reads.
#include <gmock/gmock.h>

#include "scene/schema.h"
#include "unit/scene_testing.h"

namespace ringlet::scene {
namespace {

using BadScene = SceneTest;

struct Case {
  const char* patch;     // merged into the minimal scene; null removes
  const char* expected;  // every line of the error
};

// One scene per kind of rule, word for word.
constexpr Case kSchemaCases[] = {
    // required
    {R"({"name": null})",
     R"(scene#/name: found nothing, expected text of at most 100 characters that matches ^[A-Za-z0-9_][A-Za-z0-9_.-]*$)"},
    {R"({"frames": {"last": null}})",
     "scene#/frames/last: found nothing, expected an integer from 0 to 999999"},
    {R"({"groom": null})",
     "scene#/groom: found nothing, expected an object, or a list of at least 1, each an object"},
    {R"({"head": {}})", "scene#/head/mesh: found nothing, expected the path of a mesh file"},
    // additionalProperties, with the nearest key where there is one
    {R"({"frames": {"lst": 5}})",
     "scene#/frames/lst: found an unknown key, expected one of first, fps, last, preroll (did you mean "
     "last?)"},
    {R"({"limits": {"temperature": 5}})",
     "scene#/limits/temperature: found an unknown key, expected one of edge_strain, speed"},
    {R"({"effects": {"smoke": {}}})",
     "scene#/effects/smoke: found an unknown key, expected one of collision, gravity, grooming, hair_hair, "
     "inextensible, "
     "non_hookean, solids, wind"},
    {R"({"units": {"a/b~c": 1}})", "scene#/units/a~1b~0c: found an unknown key, expected one of length, up"},
    // type
    {R"({"frames": 24})", "scene#/frames: found 24, expected an object"},
    {R"({"frames": {"last": "ten"}})",
     R"(scene#/frames/last: found "ten", expected an integer from 0 to 999999)"},
    {R"({"frames": {"last": 2.5}})", "scene#/frames/last: found 2.5, expected an integer from 0 to 999999"},
    {R"({"frames": {"fps": [24]}})",
     "scene#/frames/fps: found [24], expected a number above 0, at most 10000 [1/s]"},
    {R"({"model": {"preload": 1}})", "scene#/model/preload: found 1, expected true or false"},
    {R"({"head": {"mesh": 7}})", "scene#/head/mesh: found 7, expected the path of a mesh file"},
    {R"({"effects": {"solids": {}}})", "scene#/effects/solids: found {}, expected a list, each an object"},
    // enum
    {R"({"units": {"up": "w"}})", R"(scene#/units/up: found "w", expected "x", "y" or "z")"},
    {R"({"model": {"type": "rods"}})",
     R"(scene#/model/type: found "rods", expected "ams", "mass_spring" or "hair_mesh")"},
    // minimum, maximum, exclusiveMinimum
    {R"({"model": {"substeps": 0}})",
     "scene#/model/substeps: found 0, expected an integer from 1 to 1000, or an object"},
    {R"({"model": {"substeps": 1001}})",
     "scene#/model/substeps: found 1001, expected an integer from 1 to 1000, or an object"},
    {R"({"model": {"substeps": {"tolerance": 0}}})",
     "scene#/model/substeps/tolerance: found 0, expected a number above 0, at most 1"},
    {R"({"model": {"substeps": 18446744073709551617}})",
     "scene#/model/substeps: found 1.8446744073709552e+19, expected an integer from 1 to 1000, or an object"},
    {R"({"model": {"drag": -1}})", "scene#/model/drag: found -1, expected a number from 0 to 1e+06 [1/s]"},
    {R"({"cache": {"error": 0}})", "scene#/cache/error: found 0, expected a number above 0 [units.length]"},
    // pattern, minLength, maxLength
    {R"({"name": "a/b"})",
     R"(scene#/name: found "a/b", expected text of at most 100 characters that matches ^[A-Za-z0-9_][A-Za-z0-9_.-]*$)"},
    {R"({"groom": {"name": ""}})",
     R"(scene#/groom/name: found "", expected text of at most 255 characters, not empty)"},
    {R"({"groom": {"file": ""}})",
     R"(scene#/groom/file: found "", expected the path of a file, or a list of at least 1, each the path of a file)"},
    // minItems, maxItems, items, uniqueItems
    {R"({"groom": []})",
     "scene#/groom: found [], expected an object, or a list of at least 1, each an object"},
    {R"({"effects": {"gravity": [0, -9.81]}})",
     "scene#/effects/gravity: found [0,-9.81], expected a list of 3, each a number from -1e+06 to 1e+06 "
     "[m/s^2]"},
    {R"({"effects": {"gravity": [0, -9.81, 0, 0]}})",
     "scene#/effects/gravity: found [0,-9.81,0,0], expected a list of 3, each a number from -1e+06 to 1e+06 "
     "[m/s^2]"},
    {R"({"effects": {"gravity": [0, "down", 0]}})",
     R"(scene#/effects/gravity/1: found "down", expected a number from -1e+06 to 1e+06 [m/s^2])"},
    {R"({"cache": {"fields": ["position", "position"]}})",
     R"(scene#/cache/fields: found ["position","position"], expected a list, different, each "position", "velocity", "elongation" or "solids")"},
    {R"({"effects": {"non_hookean": {"curve": []}}})",
     "scene#/effects/non_hookean/curve: found [], expected a list of 1 to 16, each a list of 2, each a "
     "number "
     "above 0, at most 1e+06"},
    // if/then/else
    {R"({"groom": 5})", "scene#/groom: found 5, expected an object, or a list of at least 1, each an object"},
    {R"({"groom": [{"file": "a.hair", "attach": "glue"}]})",
     R"(scene#/groom/0/attach: found "glue", expected "nearest", "stored" or "fixed")"},
    {R"({"units": {"length": "km"}})",
     R"(scene#/units/length: found "km", expected a number from 1e-06 to 1e+06 [m], or "m", "cm", "mm", "in" or "ft")"},
    {R"({"units": {"length": 0}})",
     R"(scene#/units/length: found 0, expected a number from 1e-06 to 1e+06 [m], or "m", "cm", "mm", "in" or "ft")"},
    {R"({"effects": {"solids": [{"source": 1}]}})",
     R"(scene#/effects/solids/0/source: found 1, expected the path of a mesh file, or "head")"},
    // several at once, files among them
    {R"({"frames": {"fps": 0}, "limits": {"sped": 1, "speed": "fast"}, "head": {"mesh": "missing.obj"}})",
     R"(scene#/frames/fps: found 0, expected a number above 0, at most 10000 [1/s]
scene#/limits/sped: found an unknown key, expected one of edge_strain, speed (did you mean speed?)
scene#/limits/speed: found "fast", expected a number above 0 [m/s]
scene#/head/mesh: found "missing.obj", expected the path of a mesh file (there is no DIR/missing.obj))"},
};

TEST_F(BadScene, BreaksARuleOfTheSchema) {
  for (const Case& c : kSchemaCases) {
    Json scene = minimal();
    scene.merge_patch(Json::parse(c.patch));
    SCOPED_TRACE(c.patch);
    EXPECT_EQ(error_of(scene), c.expected);
  }
}

constexpr Case kMeaningCases[] = {
    // files
    {R"({"groom": {"file": "none.hair"}})",
     R"(scene#/groom/file: found "none.hair", expected the path of a file (there is no DIR/none.hair))"},
    {R"({"groom": {"file": ["a.hair", "sequence"]}})",
     R"(scene#/groom/file/1: found "sequence", expected the path of a file (DIR/sequence is a folder))"},
    {R"({"head": {"mesh": "sequence/body.####.obj"}})",
     R"(scene#/head/mesh: found "sequence/body.####.obj", expected the path of a mesh file (no file matches DIR/sequence/body.####.obj))"},
    {R"({"head": {"mesh": "sequence/face.#####.obj"}})",
     R"(scene#/head/mesh: found "sequence/face.#####.obj", expected the path of a mesh file (no file matches DIR/sequence/face.#####.obj))"},
    {R"({"head": {"mesh": "sequence/face.###.obj"}})",
     R"(scene#/head/mesh: found "sequence/face.###.obj", expected the path of a mesh file (no file matches DIR/sequence/face.###.obj))"},
    {R"({"head": {"mesh": "sequence/face.##_##.obj"}})",
     R"(scene#/head/mesh: found "sequence/face.##_##.obj", expected the path of a mesh file (the # of a sequence stand together))"},
    // frames and keys
    {R"({"frames": {"first": 5}})", "scene#/frames/last: found 2, expected a frame from first, 5, on"},
    {R"({"head": {"mesh": "head.obj", "animation": {"keys": [{"frame": 3}, {"frame": 3}]}}})",
     "scene#/head/animation/keys/1/frame: found 3.0, expected a frame after the previous key's 3.0"},
    {R"({"groom": {"animation": {"keys": [{"frame": 3, "rotate": [0, 0, 0, 0]}]}}})",
     "scene#/groom/animation/keys/0/rotate: found [0.0,0.0,0.0,0.0], expected a quaternion that is not zero"},
    {R"({"motion": {"keys": [{"frame": 3}, {"frame": 2, "rotate": [0, 0, 0, 0]}]}})",
     "scene#/motion/keys/1/frame: found 2.0, expected a frame after the previous key's 3.0\n"
     "scene#/motion/keys/1/rotate: found [0.0,0.0,0.0,0.0], expected a quaternion that is not zero"},
    // grooms
    {R"({"groom": {"file": null}})",
     "scene#/groom: found none of file, grow, hair_mesh, expected one of file, grow, hair_mesh"},
    {R"({"head": {"mesh": "head.obj"}, "groom": {"grow": {"strands": 9}}})",
     "scene#/groom: found file and grow, expected one of file, grow, hair_mesh"},
    {R"({"groom": {"root_offset": "snap"}})",
     R"(scene#/groom/root_offset: found "snap" of a fixed groom, expected "keep", or roots held by the head)"},
    {R"({"groom": {"attach": "nearest"}})",
     R"(scene#/groom/attach: found "nearest" without a head, expected a head in the scene, or "fixed")"},
    {R"({"groom": {"file": null, "grow": {"strands": 9}}})",
     "scene#/groom/grow: found growth without a head, expected a head in the scene"},
    {R"({"head": {"mesh": "head.obj"}, "groom": {"file": null, "grow": {}}})",
     "scene#/groom/grow: found neither strands nor strands_per_triangle above 0, expected one of them"},
    {R"({"head": {"mesh": "head.obj"}, "groom": {"file": null, "grow": {"strands": 9, "strands_per_triangle": 1}}})",
     "scene#/groom/grow: found both strands and strands_per_triangle, expected one of them"},
    {R"({"head": {"mesh": "head.obj"}, "groom": {"file": null, "width": 0.1, "grow": {"strands": 9}}})",
     "scene#/groom/width: found 0.1, expected none with grow (it belongs to a groom from a file)"},
    {R"({"head": {"mesh": "head.obj"},
         "groom": {"file": null, "grow": {"strands": 9, "scalp": {"box": [[0, 2, 0], [1, 1, 1]]}}}})",
     "scene#/groom/grow/scalp/box: found [[0.0,2.0,0.0],[1.0,1.0,1.0]], expected the lower corner, then the "
     "upper one"},
    {R"({"head": {"mesh": "head.obj"},
         "groom": {"file": null, "grow": {"strands": 9, "scalp": {"direction": [0, 0, 0]}}}})",
     "scene#/groom/grow/scalp/direction: found [0.0,0.0,0.0], expected a direction that is not zero"},
    {R"({"groom": {"file": ["a.hair", "b.hair"], "skin": "c.tfxskin"}})",
     R"(scene#/groom/skin: found "c.tfxskin", expected none with several files (each finds the one of its own name))"},
    {R"({"head": {"mesh": "head.obj"}, "groom": {"attach": "stored", "animation": {"keys": [{"frame": 1}]}}})",
     R"(scene#/groom/animation: found keys, expected none with attach "stored" (only a fixed groom has its own motion))"},
    {R"({"groom": {"stiffness": [{"curve": [[0.5, 1], [0.5, 2]]}]}})",
     "scene#/groom/stiffness/0/curve/1/0: found 0.5, expected a position after the previous point's 0.5"},
    {R"({"groom": {"stiffness": [{"curve": [[0.5, 1], [1.5, 2]]}]}})",
     "scene#/groom/stiffness/0/curve/1/0: found 1.5, expected a position from 0 (root) to 1 (tip)"},
    {R"({"groom": [{"file": "a.hair", "attach": "fixed"}, {"file": "b.hair", "name": "a", "attach": "fixed"}]})",
     R"(scene#/groom/1/name: found "a", expected a name other than that of /groom/0)"},
    {R"({"model": {"substeps": {"min": 9, "max": 8}}})",
     "scene#/model/substeps/min: found 9, expected at most max, 8"},
    // non-Hookean integrity
    {R"({"model": {"type": "mass_spring"}, "effects": {"non_hookean": {}}})",
     R"(scene#/effects/non_hookean: found softening with model "mass_spring", expected model "ams" (only its integrity coupling softens))"},
    {R"({"effects": {"non_hookean": {"curve": [[0.5, 0.4]]}}})",
     "scene#/effects/non_hookean/curve/0/1: found 0.4, expected the first point on Hooke's line, 0.5"},
    {R"({"effects": {"non_hookean": {"curve": [[0.5, 0.5], [0.5, 0.6], [0.7, 0.55]]}}})",
     "scene#/effects/non_hookean/curve/1/0: found 0.5, expected an elongation after the previous point's "
     "0.5\n"
     "scene#/effects/non_hookean/curve/2/1: found 0.55, expected a tension not under the previous point's "
     "0.6 "
     "(the curve must not fall)"},
    // wind
    {R"({"effects": {"wind": {}}})",
     "scene#/effects/wind: found neither velocity nor keys, expected one of them, or both"},
    {R"({"effects": {"wind": {"keys": [{"frame": 2, "velocity": [1, 0, 0]}, {"frame": 1, "velocity": [1, 0, 0]}]}}})",
     "scene#/effects/wind/keys/1/frame: found 1.0, expected a frame after the previous key's 2.0"},
    {R"({"effects": {"wind": {"velocity": [0, 1, 0], "shelter": {}}}})",
     "scene#/effects/wind/shelter: found shelter without a head, expected a head in the scene"},
    // hair against hair
    {R"({"effects": {"hair_hair": {}}})",
     "scene#/effects/hair_hair: found neither grid nor contacts, expected one of them, or both ({} takes the "
     "defaults of either)"},
    {R"({"effects": {"hair_hair": {"grid": {"shelter": {}}}}})",
     "scene#/effects/hair_hair/grid/shelter: found shelter without a wind, expected effects.wind in the "
     "scene"},
    // grooming and interpolation
    {R"({"effects": {"grooming": [{"frame": 3, "trim": {}}]}})",
     "scene#/effects/grooming/0/frame: found 3, expected a frame from first to last, 1 to 2\n"
     "scene#/effects/grooming/0/trim: found none of plane, box, sphere, mesh, length, expected one of plane, "
     "box, sphere, mesh, length"},
    {R"({"effects": {"grooming": [{"frame": 1, "groom": "wig", "rest": {}, "lengthen": {"by": 1, "to": 2}}]}})",
     "scene#/effects/grooming/0: found lengthen and rest, expected one of trim, lengthen, comb, rest\n"
     "scene#/effects/grooming/0/groom: found \"wig\", expected the name of a groom of the scene\n"
     "scene#/effects/grooming/0/lengthen: found by and to, expected one of by, to, factor"},
    {R"({"effects": {"grooming": [{"frame": 1, "trim": {"plane": {"point": [0, 0, 0], "normal": [0, 0, 0]}}},
                                  {"frame": 1, "trim": {"box": [[0, 1, 0], [1, 0, 1]]}},
                                  {"frame": 1, "trim": {"length": 1, "keep": "inside", "units": {}}},
                                  {"frame": 1, "comb": {"curve": [[0, 0, 0], [0, 0, 0]], "radius": 1}}]}})",
     "scene#/effects/grooming/0/trim/plane/normal: found [0.0,0.0,0.0], expected a direction that is not "
     "zero\n"
     "scene#/effects/grooming/1/trim/box: found [[0.0,1.0,0.0],[1.0,0.0,1.0]], expected the lower corner, "
     "then the upper one\n"
     "scene#/effects/grooming/2/trim/keep: found \"inside\" with length, expected none: a length keeps what "
     "is "
     "next to the root\n"
     "scene#/effects/grooming/2/trim/units: found {}, expected none without mesh (they are the mesh file's)\n"
     "scene#/effects/grooming/3/comb/curve/1: found [0.0,0.0,0.0], expected a point other than the one "
     "before"},
    {R"({"model": {"type": "mass_spring"}, "effects": {"grooming": [{"frame": 1, "rest": {}}]}})",
     R"(scene#/effects/grooming: found grooming of strands of the model "mass_spring", expected the model "ams" (ringlet groom edits a groom before the run))"},
    {R"({"groom": {"interpolate": {"count": 2}}, "effects": {"grooming": [{"frame": 1, "rest": {}}]}})",
     "scene#/effects/grooming/0: found an operation on interpolated strands, expected a groom without "
     "/groom/interpolate (ringlet groom edits a groom before the run)"},
    {R"({"groom": {"interpolate": {}}})",
     "scene#/groom/interpolate: found none of count, group, strands, expected one of count, group, strands"},
    {R"({"groom": {"interpolate": {"count": 2, "strands": [1]}}})",
     "scene#/groom/interpolate: found count and strands, expected one of count, group, strands"},
    {R"({"cache": {"strands": "guides"}})",
     R"(scene#/cache/strands: found "guides", expected "all" without a groom that interpolates)"},
    // solids
    {R"({"effects": {"solids": [{"source": "head"}]}})",
     R"(scene#/effects/solids/0/source: found "head" without a head, expected a head in the scene, or a mesh file)"},
    {R"({"head": {"mesh": "head.obj"}, "effects": {"solids": [{"source": "head", "units": {"length": "cm"}}]}})",
     R"(scene#/effects/solids/0/units: found {"length":"cm"}, expected none with source "head" (the head's own is /head/units))"},
    {R"({"effects": {"solids": [{"source": "sphere.obj"}, {"source": "./sphere.obj"}]}})",
     R"(scene#/effects/solids/1/name: found "sphere", expected a name other than that of /effects/solids/0)"},
    // cache
    {R"({"cache": {"fields": ["position", "elongation"]}})",
     R"(scene#/cache/fields: found "elongation", expected none without effects.non_hookean)"},
    {R"({"cache": {"fields": ["velocity"]}})",
     R"(scene#/cache/fields: found ["velocity"], expected a list with "position")"},
    // several at once
    {R"({"frames": {"first": 5}, "head": {"mesh": "none.obj"}, "cache": {"fields": []}})",
     R"(scene#/head/mesh: found "none.obj", expected the path of a mesh file (there is no DIR/none.obj)
scene#/frames/last: found 2, expected a frame from first, 5, on
scene#/cache/fields: found [], expected a list with "position")"},
};

TEST_F(BadScene, ContradictsItself) {
  for (const Case& c : kMeaningCases) {
    Json scene = minimal();
    scene.merge_patch(Json::parse(c.patch));
    SCOPED_TRACE(c.patch);
    EXPECT_EQ(error_of(scene), c.expected);
  }
}

TEST_F(BadScene, BrokenJsonIsGivenWithLineAndColumn) {
  EXPECT_EQ(
      error_of_text("{\n  \"name\": \"a\",\n  \"frames\" 5\n}"),
      "scene:3:12: syntax error while parsing object separator - unexpected number literal; expected ':'");
  EXPECT_EQ(error_of_text("{\"name\": \"a\",\n}"),
            "scene:2:1: syntax error while parsing object key - unexpected '}'; expected string literal");
  EXPECT_EQ(error_of_text("{\"drag\":\n 1e999}"), "scene:2:6: number overflow parsing '1e999'");
  EXPECT_THAT(error_of_text("{\"drag\": NaN}"), testing::StartsWith("scene:1:10: syntax error"));
  EXPECT_THAT(error_of_text("{\"name\": \"a"), testing::StartsWith("scene:1:12: syntax error"));
  EXPECT_THAT(error_of_text("{} {}"), testing::StartsWith("scene:1:4: syntax error"));
  EXPECT_THAT(error_of_text("{\"name\": \"\xff\"}"),
              testing::HasSubstr("invalid string: ill-formed UTF-8 byte"));
  EXPECT_THAT(error_of_text(""), testing::StartsWith("scene:1:1: syntax error"));
}

TEST_F(BadScene, KeysGivenTwiceAreAllNamed) {
  EXPECT_EQ(
      error_of_text(R"({"name": "a", "frames": {"last": 1, "last": 2}, "groom": [{}, {"file": 1, "file": 2}],
                              "name": "b"})"),
      "scene#/frames/last: the key is given twice\n"
      "scene#/groom/1/file: the key is given twice\n"
      "scene#/name: the key is given twice");
}

TEST_F(BadScene, DeepNestingEndsInAnError) {
  EXPECT_EQ(
      error_of_text(std::string(1000000, '[')), "scene#" + [] {
        std::string zeros;
        for (int i = 0; i < 63; ++i) zeros += "/0";
        return zeros;
      }() + ": nested deeper than 64 levels");
}

TEST_F(BadScene, LongValuesAreShortened) {
  Json scene = minimal();
  scene["units"] = {{"up", std::string(55, 'z') + "\xc3\xa4\xc3\xa4\xc3\xa4"}};
  EXPECT_EQ(error_of(scene),
            "scene#/units/up: found \"" + std::string(55, 'z') + R"(..., expected "x", "y" or "z")");
}

TEST_F(BadScene, NeedsAFileThatCanBeRead) {
  const auto message = [](const std::filesystem::path& file) -> std::string {
    try {
      load(file);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kInput);
      return error.what();
    }
    return "no error";
  };
  EXPECT_EQ(message("no/such.json"), "no/such.json: there is no such file");
  EXPECT_EQ(message(folder_), folder_.string() + ": found a folder, expected a scene");
  std::ofstream(file_) << "5";
  EXPECT_EQ(message(file_), file_.string() + "#: found 5, expected an object");
}

// A value of none of the types that the schema knows for it.
Json of_wrong_type(const Json& value) {
  if (value.is_structured()) return true;
  if (value.is_number()) return "wrong";
  return Json::parse(R"({"wrong": 1})");
}

// Every place of a scene that uses every key, with something wrong there: always one problem, and at that
// place.
class EveryRule : public SceneTest {
 protected:
  void expect_one_problem(const Json& scene, const std::string& place) const {
    EXPECT_THAT(error_of(scene), testing::AllOf(testing::StartsWith("scene#" + place + ": found "),
                                                testing::Not(testing::HasSubstr("\n"))));
  }

  // Between them these have every key.
  static std::vector<Json> wholes() { return {full(), full_hair_mesh()}; }

  Schema schema_;
};

TEST_F(EveryRule, IsKeptByTheFullScene) {
  std::map<std::string, std::set<std::string>>
      unused;  // keys of an object of the schema, joined -> those not seen
  for (Json scene : wholes()) {
    load_json(scene);
    schema_.walk(scene, [&](const Json& node, Json& value, const std::string&) {
      if (!value.is_object()) return;
      std::string all;
      for (const auto& [key, ignored] : node["properties"].items()) all += key + " ";
      if (!unused.contains(all))
        for (const auto& [key, ignored] : node["properties"].items()) unused[all].insert(key);
      for (const auto& [key, ignored] : value.items()) unused[all].erase(key);
    });
  }
  for (const auto& [all, keys] : unused) EXPECT_THAT(keys, testing::IsEmpty()) << all;
}

TEST_F(EveryRule, OnTypesIsReportedWhereItIsBroken) {
  for (Json scene : wholes())
    schema_.walk(scene, [&](const Json&, Json& value, const std::string& pointer) {
      const Json right = value;
      value = of_wrong_type(right);
      expect_one_problem(scene, pointer);
      value = right;
    });
}

TEST_F(EveryRule, OnRangesIsReportedWhereItIsBroken) {
  for (Json scene : wholes())
    schema_.walk(scene, [&](const Json& node, Json& value, const std::string& pointer) {
      const Json right = value;
      const auto break_with = [&](const Json& wrong) {
        value = wrong;
        expect_one_problem(scene, pointer);
        value = right;
      };
      const bool integer = node.value("type", "") == "integer";
      const auto beyond = [&](const Json& limit, double sign) -> Json {
        if (integer) return limit.get<std::int64_t>() + static_cast<std::int64_t>(sign);
        const double x = limit;
        return x + sign * std::max(1e-9, 1e-9 * std::abs(x));
      };
      if (node.contains("minimum")) break_with(beyond(node["minimum"], -1));
      if (node.contains("maximum")) break_with(beyond(node["maximum"], 1));
      if (node.contains("exclusiveMinimum")) break_with(node["exclusiveMinimum"]);
      if (node.contains("enum")) break_with("no such word");
      if (node.contains("maxLength")) break_with(std::string(node["maxLength"].get<std::size_t>() + 1, 'x'));
      if (node.contains("minLength")) break_with("");
      if (value.is_array() && node.contains("minItems")) break_with(Json::array());
    });
}

TEST_F(EveryRule, OnKeysIsReportedWhereItIsBroken) {
  for (Json scene : wholes())
    schema_.walk(scene, [&](const Json& node, Json& value, const std::string& pointer) {
      if (!value.is_object()) return;
      value["no_such_key"] = 1;
      expect_one_problem(scene, pointer + "/no_such_key");
      value.erase("no_such_key");
      for (const std::string key : node.value("required", Json::array())) {
        const Json right = value[key];
        value.erase(key);
        expect_one_problem(scene, pointer + "/" + key);
        value[key] = right;
      }
    });
}

// Whatever part of a scene is missing, it loads or says what is wrong with it.
TEST_F(EveryRule, HoldsWithAnyPartLeftOut) {
  for (Json scene : wholes())
    schema_.walk(scene, [&](const Json&, Json& value, const std::string&) {
      if (value.is_array()) {
        const Json right = value;
        value = Json::array();
        error_of(scene);
        value = right;
      }
      if (!value.is_object()) return;
      const Json right = value;
      for (const auto& [key, ignored] : right.items()) {
        value.erase(key);
        EXPECT_NO_THROW(error_of(scene)) << key;
        value = right;
      }
    });
}

}  // namespace
}  // namespace ringlet::scene
