// Loading scenes: values, units, defaults, overrides, the resolved text and its hash.
#include <gmock/gmock.h>

#include <fstream>
#include <numbers>
#include <variant>

#include "scene/schema_text.h"
#include "unit/scene_testing.h"

namespace ringlet::scene {
namespace {

using SceneLoad = SceneTest;

TEST_F(SceneLoad, TakesEveryValueOver) {
  const Scene s = load_json(full());
  EXPECT_EQ(s.name, "full");
  EXPECT_EQ(s.file, file_);
  EXPECT_EQ(s.frames.first, 1);
  EXPECT_EQ(s.frames.last, 96);
  EXPECT_EQ(s.frames.fps, 24);
  EXPECT_EQ(s.frames.preroll, 8);
  EXPECT_EQ(s.model.type, ModelType::kAms);
  EXPECT_EQ(s.model.scheme, Scheme::kProjected);
  EXPECT_EQ(s.model.stiffness.edge, 1e5);
  EXPECT_EQ(s.model.stiffness.bend, 1e4);
  EXPECT_EQ(s.model.stiffness.twist, 1e3);
  EXPECT_EQ(s.model.stiffness.integrity, 10);
  EXPECT_EQ(s.model.stiffness.angular, 20);
  EXPECT_EQ(s.model.particle_mass, 2);
  EXPECT_EQ(s.model.substeps, 4);
  EXPECT_FALSE(s.model.substep_choice);
  EXPECT_EQ(s.model.drag, 0.5);
  EXPECT_EQ(s.model.clamped_particles, 2);
  EXPECT_FALSE(s.model.preload);
  EXPECT_FALSE(s.model.geometric_stiffness);
  EXPECT_EQ(s.model.material_damping, 0.01);
  EXPECT_EQ(s.model.angular_tangent, AngularTangent::kPaper);
  EXPECT_EQ(s.model.integrity_tangent, IntegrityTangent::kPaper);
  EXPECT_EQ(s.limits.edge_strain, 5);
  EXPECT_EQ(s.limits.speed, 500);
  EXPECT_THAT(s.cache.fields, testing::ElementsAre("position", "velocity"));
  EXPECT_EQ(s.cache.compression, Compression::kQuantised);
}

TEST_F(SceneLoad, ReadsHairMeshes) {
  const Scene s = load_json(full_hair_mesh());  // in centimetres
  ASSERT_TRUE(s.grooms[0].hair_mesh && s.model.hair_mesh);
  const HairMeshStrands& strands = *s.grooms[0].hair_mesh;
  EXPECT_EQ(strands.density, 5e4);
  EXPECT_EQ(strands.particles, 9);
  EXPECT_DOUBLE_EQ(strands.curl_radius, 0.005);
  EXPECT_EQ(strands.curl_turns, 3);
  EXPECT_DOUBLE_EQ(strands.noise, 0.0025);
  EXPECT_DOUBLE_EQ(s.grooms[0].width, 1e-4);
  const HairMeshModel& model = *s.model.hair_mesh;
  ASSERT_TRUE(s.model.substep_choice);
  EXPECT_EQ(s.model.substep_choice->tolerance, 1e-3);
  EXPECT_EQ(s.model.substep_choice->min, 2);
  EXPECT_EQ(s.model.substep_choice->max, 8);
  EXPECT_EQ(s.model.substeps, 8);
  EXPECT_EQ(model.density, 90);
  EXPECT_EQ(model.stretch, 1e4);
  EXPECT_EQ(model.stretch_across, 200);
  EXPECT_EQ(model.shear, 300);
  EXPECT_EQ(model.horizontal, 400);
  EXPECT_EQ(model.bend, 0.1);
  EXPECT_EQ(model.bend_across, 0.2);
  EXPECT_EQ(model.volume, 500);
  EXPECT_EQ(model.damping, 0.01);
  EXPECT_EQ(model.drag, 0.75);
  EXPECT_EQ(model.residual, 1e-5);
  EXPECT_EQ(model.max_iterations, 50);
  EXPECT_FALSE(model.deformation_minimisation);
  EXPECT_EQ(model.start, HairMeshStart::kCollapsed);
  ASSERT_EQ(model.ellipsoids.size(), 1u);
  EXPECT_TRUE(model.ellipsoids[0].centre.isApprox(Vec3(0.01, 0.02, 0.03), 1e-15));
  EXPECT_TRUE(model.ellipsoids[0].radii.isApprox(Vec3(0.04, 0.05, 0.06), 1e-15));
  EXPECT_FALSE(model.ellipsoids[0].follows_head);
  EXPECT_EQ(load_json(minimal()).model.hair_mesh.has_value(), false);
}

TEST_F(SceneLoad, MakesMetresOfLengthsAndNothingElse) {
  const Scene s = load_json(full());  // in centimetres
  EXPECT_EQ(s.units.metres_per_unit, 0.01);
  EXPECT_EQ(s.units.up, Axis::kZ);
  EXPECT_EQ(s.head->units.metres_per_unit, 0.0254);
  EXPECT_EQ(s.head->units.up, Axis::kY);
  EXPECT_TRUE(s.head->animation.keys[0].translate.isApprox(Vec3(0.01, 0.02, 0.03), 1e-15));
  EXPECT_EQ(s.head->animation.keys[0].scale, 2);
  EXPECT_DOUBLE_EQ(s.grooms[0].attach_distance, 0.03);
  EXPECT_DOUBLE_EQ(s.grooms[0].width, 1e-4);
  EXPECT_EQ(s.grooms[0].units.metres_per_unit, 0.5);
  EXPECT_EQ(s.grooms[0].units.up, Axis::kX);
  EXPECT_EQ(s.grooms[1].units.metres_per_unit, std::nullopt);
  EXPECT_EQ(s.grooms[1].units.up, std::nullopt);
  const Grow& grow = *s.grooms[2].grow;
  EXPECT_DOUBLE_EQ(grow.step, 0.005);
  EXPECT_DOUBLE_EQ(grow.width, 2e-4);
  EXPECT_TRUE((*grow.scalp.box)[0].isApprox(Vec3(0, 0.01, 0.02), 1e-15));
  EXPECT_TRUE((*grow.scalp.box)[1].isApprox(Vec3(0.03, 0.04, 0.05), 1e-15));
  EXPECT_EQ(*grow.scalp.direction, Vec3(0, 0, 1));
  EXPECT_DOUBLE_EQ(grow.scalp.max_angle, std::numbers::pi / 3);
  EXPECT_EQ(grow.helix_radius, 5);
  EXPECT_DOUBLE_EQ(s.effects.solids[0].offset, 0.001);
  EXPECT_DOUBLE_EQ(*s.effects.solids[0].voxel, 0.002);
  EXPECT_EQ(*s.effects.gravity, Vec3(0, 0, -9.81));
  EXPECT_EQ(s.limits.speed, 500);
  EXPECT_DOUBLE_EQ(s.cache.error, 1e-5);
}

TEST_F(SceneLoad, KnowsEveryLengthUnit) {
  const std::pair<const char*, double> units[] = {{"\"m\"", 1},       {"\"cm\"", 0.01},   {"\"mm\"", 0.001},
                                                  {"\"in\"", 0.0254}, {"\"ft\"", 0.3048}, {"0.0027", 0.0027}};
  for (const auto& [unit, metres] : units) {
    const Scene s =
        load_json(minimal(), {std::string("/units/length=") + unit, "/effects/solids/0/source=\"sphere.obj\"",
                              "/effects/solids/0/voxel=2"});
    EXPECT_EQ(s.units.metres_per_unit, metres);
    EXPECT_DOUBLE_EQ(*s.effects.solids[0].voxel, 2 * metres);
    EXPECT_DOUBLE_EQ(s.grooms[0].attach_distance, 0.02) << "defaults of lengths are metres";
  }
}

TEST_F(SceneLoad, ReadsMotion) {
  const Scene s = load_json(full());
  const Animation& head = s.head->animation;
  EXPECT_EQ(head.clip, "nod");
  EXPECT_TRUE(head.loop);
  EXPECT_EQ(head.interpolation, Interpolation::kLinear);
  ASSERT_EQ(head.keys.size(), 2u);
  EXPECT_EQ(head.keys[0].rotate.coeffs(), Quat::Identity().coeffs()) << "normalised, x y z w";
  EXPECT_EQ(head.keys[1].rotate.coeffs(), Quat(0, 1, 0, 0).coeffs());
  EXPECT_EQ(head.keys[1].frame, 2.5);
  EXPECT_EQ(s.grooms[1].animation.keys.size(), 1u);
  EXPECT_FALSE(s.grooms[1].animation.clip);
  EXPECT_EQ(s.effects.solids[1].mesh->animation.clip, "") << "the file's first";
  const Scene still = load_json(minimal(), {"/head/mesh=\"head.obj\""});
  EXPECT_TRUE(still.head->animation.keys.empty());
  EXPECT_FALSE(still.head->animation.clip);
}

TEST_F(SceneLoad, ReadsTheScenesMotionIntoEveryAnimation) {
  const Scene s = load_json(full());
  for (const Animation& a : {s.head->animation, s.grooms[1].animation, s.effects.solids[1].mesh->animation}) {
    EXPECT_EQ(a.speed, 3);
    EXPECT_EQ(a.carrier_interpolation, Interpolation::kLinear);
    ASSERT_EQ(a.carrier.size(), 2u);
    EXPECT_EQ(a.carrier[1].frame, 5);
    EXPECT_EQ(a.carrier[1].translate, Vec3(0.02, 0, 0));
    EXPECT_EQ(a.carrier[1].rotate.coeffs(), Quat(0, 0, 1, 0).coeffs());
  }
  EXPECT_TRUE(load_json(minimal(), {"/motion/keys=[{\"frame\": 1}]"}).grooms[0].animation.keyed());
  EXPECT_FALSE(load_json(minimal()).grooms[0].animation.keyed());
}

TEST_F(SceneLoad, ReadsGrooms) {
  const Scene s = load_json(full());
  ASSERT_EQ(s.grooms.size(), 4u);
  EXPECT_EQ(s.grooms[0].name, "a") << "the file's";
  EXPECT_EQ(s.grooms[0].file, folder_ / "a.hair");
  EXPECT_THAT(s.grooms[0].more, testing::ElementsAre(folder_ / "b.hair"));
  EXPECT_EQ(s.grooms[0].attach, Attach::kNearest);
  EXPECT_EQ(s.grooms[2].root_offset, RootOffset::kSnap);
  EXPECT_EQ(s.grooms[0].penetration, Penetration::kKeep);
  ASSERT_EQ(s.grooms[0].stiffness.size(), 1u);
  EXPECT_EQ(s.grooms[0].stiffness[0].group, "a");
  EXPECT_EQ(s.grooms[0].stiffness[0].coupling, "edge");
  EXPECT_EQ(s.grooms[0].stiffness[0].curve, (Curve{{0, 1}, {0.5, 0.25}}));
  EXPECT_EQ(s.grooms[0].particles, 20);
  EXPECT_FALSE(s.grooms[1].particles);
  EXPECT_EQ(s.grooms[1].skin, folder_ / "c.tfxskin");
  EXPECT_EQ(s.grooms[1].attach, Attach::kFixed);
  EXPECT_EQ(s.grooms[2].name, "grown");
  EXPECT_FALSE(s.grooms[2].file);
  EXPECT_EQ(s.grooms[2].grow->seed, 7);
  EXPECT_EQ(s.grooms[2].pointer, "/groom/2");
  EXPECT_EQ(load_json(minimal()).grooms[0].pointer, "/groom");
}

TEST_F(SceneLoad, ReadsSolids) {
  const Scene s = load_json(full());
  const Solid& head = s.effects.solids[0];
  EXPECT_TRUE(head.is_head);
  EXPECT_EQ(head.name, "head");
  EXPECT_FALSE(head.mesh);
  EXPECT_EQ(head.proxy->file, folder_ / "proxy.obj");
  EXPECT_EQ(head.proxy->animation.clip, "nod") << "moved as the head is";
  EXPECT_EQ(head.proxy->units.metres_per_unit, 0.0254) << "in the head's units";
  EXPECT_EQ(head.friction, 0.3);
  EXPECT_EQ(head.resolution, 64);
  EXPECT_EQ(head.half_width, 4);
  EXPECT_EQ(head.level_set_cache, folder_ / "levels");
  const Solid& ball = s.effects.solids[1];
  EXPECT_FALSE(ball.is_head);
  EXPECT_EQ(ball.name, "ball");
  EXPECT_EQ(ball.mesh->file, folder_ / "sphere.obj");
  EXPECT_EQ(ball.mesh->units.metres_per_unit, 0.3048);
  EXPECT_EQ(ball.pointer, "/effects/solids/1");
  EXPECT_EQ(s.effects.collision.iterations, 6);
  const Scene own = load_json(minimal(), {"/effects/solids/0={\"source\": \"./head\"}"});
  EXPECT_FALSE(own.effects.solids[0].is_head) << "a file called head";
}

TEST_F(SceneLoad, ReadsTheNonHookeanCurve) {
  const NonHookean n = load_json(full()).effects.non_hookean.value();
  EXPECT_EQ(n.memory, Memory::kReversible);
  EXPECT_EQ(n.curve, (Curve{{0.25, 0.25}, {0.5, 0.375}}));
}

TEST_F(SceneLoad, ReadsHairAgainstHair) {
  const HairHair h = load_json(full()).effects.hair_hair.value();
  EXPECT_EQ(h.grid->resolution, 64);
  EXPECT_EQ(h.grid->pic, 0.1);
  EXPECT_EQ(h.grid->residual, 1e-3);
  EXPECT_EQ(h.grid->max_iterations, 50);
  EXPECT_EQ(h.grid->passes, 3);
  EXPECT_EQ(h.grid->cadence, Cadence::kSubstep);
  EXPECT_EQ(h.grid->shelter, 0.5);
  EXPECT_EQ(h.contacts->friction, 0.2);
  EXPECT_EQ(h.contacts->passes, 2);
  EXPECT_EQ(h.contacts->cadence, Cadence::kSubstep);
  EXPECT_DOUBLE_EQ(*h.contacts->radius, 5e-4) << "centimetres";
  const auto effects = [&](const std::string& hair_hair, const std::string& more = "{}") {
    return load_json(minimal(), {"/effects=" + more, "/effects/hair_hair=" + hair_hair}).effects;
  };
  EXPECT_FALSE(load_json(minimal()).effects.hair_hair);
  EXPECT_FALSE(effects(R"({"grid": {}})").hair_hair->contacts);
  EXPECT_FALSE(effects(R"({"grid": {}})").hair_hair->grid->shelter);
  EXPECT_FALSE(effects(R"({"contacts": {}})").hair_hair->grid);
  EXPECT_FALSE(effects(R"({"contacts": {}})").hair_hair->contacts->radius) << "the strands' own";
  EXPECT_FALSE(effects(R"({"grid": {"shelter": {}}})", R"({"wind": {"velocity": [0, 0, 0]}})")
                   .hair_hair->grid->shelter)
      << "from a wind that never blows";
  EXPECT_TRUE(load_json(minimal(), {"/effects/hair_hair={\"grid\": {}}", "/model/type=\"mass_spring\""})
                  .effects.hair_hair);
}

TEST_F(SceneLoad, ReadsInterpolation) {
  const Scene s = load_json(full());
  EXPECT_EQ(s.grooms[0].interpolate->group, "b");
  EXPECT_EQ(s.grooms[0].interpolate->count, 0);
  EXPECT_EQ(s.grooms[0].interpolate->neighbours, 2);
  EXPECT_EQ(s.grooms[0].interpolate->pointer, "/groom/0/interpolate");
  EXPECT_THAT(s.grooms[1].interpolate->strands, testing::ElementsAre(0, 2));
  EXPECT_EQ(s.grooms[2].interpolate->count, 10);
  EXPECT_FALSE(s.grooms[3].interpolate);
  EXPECT_EQ(s.cache.strands, StoredStrands::kBoth);
}

TEST_F(SceneLoad, ReadsGroomingInItsOrder) {
  const Scene s = load_json(full());
  const auto& operations = s.effects.grooming;
  ASSERT_EQ(operations.size(), 10u);
  const auto trim = [&](std::size_t i) { return std::get<Trim>(operations[i].what); };
  EXPECT_EQ(operations[0].frame, 8) << "by frame";
  EXPECT_EQ(operations[0].groom, "cut");
  EXPECT_EQ(operations[0].pointer, "/effects/grooming/3/trim");
  EXPECT_EQ(trim(0).mesh->file, folder_ / "sphere.obj");
  EXPECT_EQ(trim(0).mesh->units.metres_per_unit, 0.3048);
  EXPECT_EQ(trim(0).mesh->units.up, Axis::kY);
  EXPECT_TRUE(trim(1).plane->point.isApprox(Vec3(0.01, 0.02, 0.03)));
  EXPECT_EQ(trim(1).plane->normal, Vec3(0, 0, 1));
  EXPECT_TRUE((*trim(2).box)[1].isApprox(Vec3(0.03, 0.04, 0.05)));
  EXPECT_TRUE(trim(2).keep_inside);
  EXPECT_FALSE(trim(3).keep_inside);
  EXPECT_EQ(trim(3).sphere->radius, 0.04);
  EXPECT_EQ(std::get<Lengthen>(operations[4].what).by, 0.05);
  EXPECT_EQ(std::get<Lengthen>(operations[5].what).to, 0.5);
  EXPECT_EQ(std::get<Lengthen>(operations[6].what).factor, 1.5);
  EXPECT_EQ(std::get<Lengthen>(operations[6].what).mode, Lengthening::kScale);
  const Comb comb = std::get<Comb>(operations[7].what);
  EXPECT_TRUE(comb.curve[1].isApprox(Vec3(0.01, 0.02, 0.03)));
  EXPECT_EQ(comb.radius, 0.02);
  EXPECT_EQ(comb.strength, 0.5);
  EXPECT_TRUE(std::holds_alternative<Rest>(operations[8].what));
  EXPECT_EQ(operations[8].pointer, "/effects/grooming/9/rest");
  EXPECT_EQ(trim(9).length, 0.05);
}

TEST_F(SceneLoad, ReadsTheModelsType) {
  EXPECT_EQ(load_json(minimal(), {"/model/type=\"mass_spring\""}).model.type, ModelType::kMassSpring);
}

TEST_F(SceneLoad, ReadsWind) {
  const Wind w = load_json(full()).effects.wind.value();
  ASSERT_EQ(w.keys.size(), 2u);
  EXPECT_EQ(w.keys[0].frame, 1);
  EXPECT_EQ(w.keys[0].velocity, Vec3(2, 2, 3));  // m/s, although the scene is in centimetres
  EXPECT_EQ(w.keys[1].velocity, Vec3(1, 0, 0));
  EXPECT_EQ(w.gusts->strength, 0.25);
  EXPECT_EQ(w.gusts->period, 3);
  EXPECT_EQ(w.gusts->seed, 5);
  EXPECT_EQ(w.turbulence->strength, 0.5);
  EXPECT_EQ(w.turbulence->scale, 0.2);
  EXPECT_EQ(w.turbulence->octaves, 2);
  EXPECT_EQ(w.turbulence->seed, 6);
  EXPECT_EQ(w.normal.linear, 1e-4);
  EXPECT_EQ(w.normal.quadratic, 2e-5);
  EXPECT_EQ(w.tangential.linear, 3e-4);
  EXPECT_EQ(w.tangential.quadratic, 4e-5);
  EXPECT_EQ(w.linear_density, 1e-5);
  EXPECT_EQ(w.shelter->strength, 0.5);
  EXPECT_EQ(w.shelter->wake, 0.3);
  const Wind constant = *load_json(minimal(), {"/effects/wind/velocity=[4,0,1]"}).effects.wind;
  ASSERT_EQ(constant.keys.size(), 1u);
  EXPECT_EQ(constant.keys[0].velocity, Vec3(4, 0, 1));
}

TEST_F(SceneLoad, TakesAWindThatNeverBlowsForNone) {
  EXPECT_FALSE(
      load_json(minimal(), {"/effects/wind={\"velocity\": [0, 0, 0], \"turbulence\": {}}"}).effects.wind);
  EXPECT_FALSE(load_json(minimal(), {R"(/effects/wind={"keys": [{"frame": 1, "velocity": [0, 0, 0]}]})"})
                   .effects.wind);
  EXPECT_TRUE(load_json(minimal(), {R"(/effects/wind={"keys": [{"frame": 1, "velocity": [0, 0, 0]},
                                                               {"frame": 2, "velocity": [0, 1, 0]}]})"})
                  .effects.wind);
}

TEST_F(SceneLoad, RunsNoEffectThatIsAbsent) {
  const Scene s = load_json(minimal());
  EXPECT_FALSE(s.effects.gravity);
  EXPECT_FALSE(s.effects.inextensible);
  EXPECT_FALSE(s.effects.non_hookean);
  EXPECT_FALSE(s.effects.wind);
  EXPECT_TRUE(s.effects.solids.empty());
  EXPECT_FALSE(s.head);
}

TEST_F(SceneLoad, FindsTheFilesOfASequence) {
  const Scene s = load_json(minimal(), {"/head/mesh=\"sequence/face.####.obj\""});
  EXPECT_EQ(s.head->file, folder_ / "sequence/face.####.obj");
  std::ofstream(folder_ / "sequence/body.1200.obj") << "present";
  load_json(minimal(), {"/head/mesh=\"sequence/body.##.obj\""});  // frames beyond 99
}

// ---- Overrides
// ---------------------------------------------------------------------------------------------------

TEST_F(SceneLoad, AppliesOverridesInOrder) {
  const Scene s =
      load_json(full(), {"/frames/last=100", "/frames/last=120", "/effects/gravity=null",
                         "/effects/solids/1=null", "/effects/solids/-={\"source\": \"sphere.obj\"}",
                         "/effects/solids/1/friction=0.9", "/cache=null", "/effects/no/such/thing=null",
                         "/effects/solids/7=null", "/name=\"a=b\"", "/name=\"wedge\""});
  EXPECT_EQ(s.frames.last, 120);
  EXPECT_FALSE(s.effects.gravity);
  ASSERT_EQ(s.effects.solids.size(), 2u);
  EXPECT_EQ(s.effects.solids[1].name, "sphere");
  EXPECT_EQ(s.effects.solids[1].friction, 0.9);
  EXPECT_THAT(s.cache.fields, testing::ElementsAre("position"));
  EXPECT_EQ(s.name, "wedge");
  const Scene made = load_json(
      minimal(), {"/effects/inextensible/tolerance=1e-3", "/effects/solids/-/source=\"sphere.obj\""});
  EXPECT_EQ(made.effects.inextensible->tolerance, 1e-3) << "missing parents are made";
  EXPECT_EQ(made.effects.solids.size(), 1u);
}

TEST_F(SceneLoad, RefusesMalformedOverrides) {
  const auto error = [&](const char* text) {
    return error_of_text(minimal().dump(), {text}, ErrorKind::kUsage);
  };
  EXPECT_EQ(error("/frames/last"),
            "--set /frames/last: expected POINTER=JSON (for instance /frames/last=48)");
  EXPECT_EQ(error("frames=1"),
            "--set frames=1: a JSON pointer begins with '/' (for instance /frames/last=48)");
  EXPECT_EQ(error("=1"), "--set =1: a JSON pointer begins with '/' (for instance /frames/last=48)");
  EXPECT_EQ(error("/a~2=1"), "--set /a~2=1: '~' in a JSON pointer is written ~0");
  EXPECT_EQ(error("/a~=1"), "--set /a~=1: '~' in a JSON pointer is written ~0");
  EXPECT_THAT(error("/name=wedge"),
              testing::AllOf(testing::StartsWith("--set /name=wedge: the value is not JSON: "),
                             testing::EndsWith("(text needs its double quotes: /name=\"wedge\")")));
  EXPECT_THAT(error("/name="), testing::StartsWith("--set /name=: the value is not JSON: "));
  EXPECT_THAT(error("/limits/speed=1e999"), testing::HasSubstr("number overflow parsing '1e999'"));
  EXPECT_EQ(error("/name/first=1"),
            "--set /name/first=1: 'first' is no member of \"tiny\", which is no object or list");
  EXPECT_EQ(error_of_text(full().dump(), {"/groom/5/name=\"x\""}, ErrorKind::kUsage),
            "--set /groom/5/name=\"x\": '5' is no index of a list of 4 (0 to 4, or - to append)");
  EXPECT_EQ(error_of_text(full().dump(), {"/groom/01/name=\"x\""}, ErrorKind::kUsage),
            "--set /groom/01/name=\"x\": '01' is no index of a list of 4 (0 to 4, or - to append)");
}

TEST_F(SceneLoad, SaysThatAnOverrideIsToBlame) {
  EXPECT_EQ(error_of(minimal(), {"/frames={\"last\": 0}", "/limits/sped=1"}),
            "scene#/limits/sped: found an unknown key, expected one of edge_strain, speed (did you mean "
            "speed?; given "
            "by --set)");
  EXPECT_EQ(error_of(minimal(), {"/frames={\"last\": 0}"}),
            "scene#/frames/last: found 0, expected a frame from first, 1, on (given by --set)");
}

// ---- Resolved text and hash
// ---------------------------------------------------------------------------------------

TEST_F(SceneLoad, ResolvesToASceneThatResolvesToItself) {
  for (const Json& json : {minimal(), full()}) {
    const Scene s = load_json(json);
    const Scene again = load_text(s.resolved);
    EXPECT_EQ(again.resolved, s.resolved);
    EXPECT_EQ(again.hash, s.hash);
  }
}

TEST_F(SceneLoad, KeepsWhatTheUserWroteInTheResolvedScene) {
  const Json resolved = Json::parse(load_json(full()).resolved);
  EXPECT_FALSE(resolved.contains("$schema"));
  const Json flat_resolved = resolved.flatten(), written = full().flatten();
  for (const auto& [pointer, value] : written.items())
    if (pointer != "/$schema" && !value.is_null()) {  // flatten makes null of an empty list
      EXPECT_EQ(flat_resolved[pointer], value) << pointer;
    }
}

TEST_F(SceneLoad, GivesDefaultLengthsInTheScenesUnit) {
  const Json resolved = Json::parse(load_json(minimal(), {"/units/length=\"cm\""}).resolved);
  EXPECT_EQ(resolved["groom"]["attach_distance"], 2.0);
  EXPECT_EQ(resolved["groom"]["width"], 0.008);
  EXPECT_EQ(resolved["cache"]["error"], 0.001);
}

TEST_F(SceneLoad, HashesWhatTheSceneMeans) {
  const std::string hash =
      load_text(
          R"({"name": "a", "frames": {"first": 1, "last": 2}, "groom": {"file": "a.hair", "attach": "fixed"}})")
          .hash;
  EXPECT_THAT(hash, testing::MatchesRegex("[0-9a-f]{16}"));
  EXPECT_EQ(hash, load_text(R"({
    "$schema": "elsewhere.json",
    "groom": {"attach": "fixed", "file": "a.hair"},
    "frames": {"last": 2, "first": 1, "fps": 24.0},
    "model": {"drag": 0},
    "name": "a"
  })")
                      .hash)
      << "order, white space, defaults written out, 24 or 24.0";
  EXPECT_NE(
      hash,
      load_text(
          R"({"name": "a", "frames": {"first": 1, "last": 3}, "groom": {"file": "a.hair", "attach": "fixed"}})")
          .hash);
}

TEST_F(SceneLoad, HashIsFnv1aOfTheResolvedText) {
  const Scene s = load_json(minimal());
  unsigned __int128 hash = 14695981039346656037u;  // the published offset basis and prime
  for (const unsigned char c : s.resolved) hash = ((hash ^ c) * 1099511628211u) & ~std::uint64_t{0};
  EXPECT_EQ(std::stoull(s.hash, nullptr, 16), static_cast<std::uint64_t>(hash));
}

}  // namespace
}  // namespace ringlet::scene
