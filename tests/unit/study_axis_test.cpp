// What `--vary` means, and what runs come of it.
#include <gmock/gmock.h>

#include "core/error.h"
#include "study/variants.h"
#include "unit/scene_testing.h"

namespace ringlet::study {
namespace {

using testing::ElementsAre, testing::HasSubstr;

std::vector<std::string> json_of(const std::string& text) {
  std::vector<std::string> values;
  for (const Value& value : parse_axis(text).values) values.push_back(value.json);
  return values;
}

TEST(StudyAxis, PartsValuesAtCommasOutsideOfLists) {
  EXPECT_EQ(parse_axis("/model/substeps=1,2,4").name, "/model/substeps");
  EXPECT_THAT(json_of("/model/substeps=1,2,4"), ElementsAre("1", "2", "4"));
  EXPECT_THAT(json_of(R"(/effects/wind=null,{"velocity":[1,2,3],"gusts":{}})"),
              ElementsAre("null", R"({"velocity":[1,2,3],"gusts":{}})"));
  EXPECT_THAT(json_of("/effects/gravity=[0,-9.81,0],[0,0,0]"), ElementsAre("[0,-9.81,0]", "[0,0,0]"));
  EXPECT_THAT(json_of(R"(/name="a,b]","c\",d")"), ElementsAre(R"("a,b]")", R"("c\",d")"));
}

TEST(StudyAxis, TakesWhatIsNoJsonForAString) {
  EXPECT_THAT(json_of("/model/type=ams,mass_spring"), ElementsAre(R"("ams")", R"("mass_spring")"));
  EXPECT_THAT(json_of("/a=true,1e-4,.5"), ElementsAre("true", "1e-4", R"(".5")"));
}

TEST(StudyAxis, RefusesWhatItDoesNotKnow) {
  const auto error_of = [](const std::string& text) -> std::string {
    try {
      parse_axis(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kUsage);
      return error.what();
    }
    return "no error";
  };
  EXPECT_THAT(error_of("/model/substeps"), HasSubstr("expected POINTER=V1,V2"));
  EXPECT_THAT(error_of("/model/substeps=1,,2"), HasSubstr("an empty value"));
  EXPECT_THAT(error_of("substeps=1"), HasSubstr("`substeps` is neither a JSON pointer nor a setting"));
  EXPECT_THAT(error_of("precision=float,half"), HasSubstr("found `half`, expected float or double"));
  EXPECT_THAT(error_of("threads=0"), HasSubstr("expected a number from 1 to 4096"));
  EXPECT_EQ(error_of("instruction-set=generic,avx2"), "no error");
}

TEST(StudyAxis, SetsTheMachine) {
  Machine machine;
  EXPECT_EQ(machine_value("threads", machine), "all");
  EXPECT_EQ(machine_value("instruction-set", machine), "widest");
  for (const auto& [setting, value] : {std::pair{"precision", "double"},
                                       {"backend", "cpu"},
                                       {"threads", "3"},
                                       {"instruction-set", "generic"}}) {
    set_machine(setting, value, machine);
    EXPECT_EQ(machine_value(setting, machine), value);
  }
}

TEST(StudyAxis, NamesAxesByAsMuchAsTellsThemApart) {
  const std::vector<Axis> axes = {{"/model/substeps", {}},
                                  {"/effects/solids/0/voxel", {}},
                                  {"/effects/hair_hair/grid/passes", {}},
                                  {"/effects/hair_hair/contacts/passes", {}},
                                  {"/effects/solids/0", {}},
                                  {"precision", {}}};
  EXPECT_THAT(short_names(axes),
              ElementsAre("substeps", "voxel", "grid/passes", "contacts/passes", "solids/0", "precision"));
}

class StudyVariants : public scene::SceneTest {
 protected:
  std::vector<Variant> make(const scene::Json& json, const std::vector<std::string>& vary,
                            bool product = false) {
    std::ofstream(file_) << json.dump();
    axes_.clear();
    for (const std::string& text : vary) axes_.push_back(parse_axis(text));
    return make_variants({file_, {"/frames/last=3"}, {}}, axes_, product);
  }
  static std::vector<std::string> labels(const std::vector<Variant>& variants) {
    std::vector<std::string> labels;
    for (const Variant& variant : variants) labels.push_back(variant.label);
    return labels;
  }
  std::vector<Axis> axes_;
};

TEST_F(StudyVariants, ChangeOneSettingAtATimeAndRunTheSameOnce) {
  const auto variants = make(minimal(), {"/model/substeps=4,8", "precision=float,double"});
  EXPECT_THAT(labels(variants), ElementsAre("as given", "substeps=4", "precision=double"))
      << "8, float: as given";
  EXPECT_THAT(variants[0].columns, ElementsAre("8", "float"));
  EXPECT_THAT(variants[1].columns, ElementsAre("4", "float"));
  EXPECT_EQ(most_substeps(variants[1].scene), 4);
  EXPECT_EQ(variants[1].scene.frames.last, 3) << "--set holds for all";
  EXPECT_THAT(variants[1].options, ElementsAre("--set /model/substeps=4"));
  EXPECT_THAT(variants[2].options, ElementsAre("--precision double"));
  EXPECT_EQ(variants[2].machine.options.precision, pipeline::Precision::kDouble);
}

TEST_F(StudyVariants, OfAProductAreAllCombinations) {
  const auto variants = make(minimal(), {"/model/substeps=2,4", "threads=1,2"}, true);
  EXPECT_THAT(labels(variants), ElementsAre("substeps=2, threads=1", "substeps=2, threads=2",
                                            "substeps=4, threads=1", "substeps=4, threads=2"));
}

TEST_F(StudyVariants, QuoteWhatAShellWouldTakeApart) {
  const auto variants = make(minimal(), {R"(/effects/wind={"velocity":[1,0,0]})"});
  EXPECT_THAT(variants[1].options, ElementsAre(R"(--set '/effects/wind={"velocity":[1,0,0]}')"));
  EXPECT_EQ(variants[0].columns[0], "null");
}

TEST_F(StudyVariants, OfAnotherModelLackWhatItDoesNotTake) {
  scene::Json json = full_hair_mesh();
  const auto from_mesh = make(json, {"/model/type=ams,mass_spring,hair_mesh"});
  EXPECT_THAT(labels(from_mesh), ElementsAre("as given", "type=ams", "type=mass_spring"));
  EXPECT_THAT(from_mesh[1].left_out, ElementsAre("/model/hair_mesh"));
  json["model"] = {{"type", "ams"}};
  json["effects"] = {{"inextensible", scene::Json::object()}, {"non_hookean", scene::Json::object()}};
  json["groom"]["stiffness"] = scene::Json::parse(R"([{"curve": [[0, 1]]}])");
  const auto from_strands = make(json, {"/model/type=ams,hair_mesh"});
  ASSERT_THAT(labels(from_strands), ElementsAre("as given", "type=hair_mesh"));
  EXPECT_THAT(from_strands[1].left_out,
              ElementsAre("/effects/non_hookean", "/effects/inextensible", "/groom/stiffness"));
  EXPECT_THAT(from_strands[1].options, testing::Contains("--set /effects/inextensible=null"));
}

TEST_F(StudyVariants, OfAProductWithModelsLackWhatAnotherAxisPutsBack) {
  scene::Json json = full_hair_mesh();
  json["model"] = {{"type", "ams"}};
  json["effects"] = {{"hair_hair", {{"grid", scene::Json::object()}}}};
  const std::string grid = "/effects/hair_hair/grid/resolution=16,32";
  const auto variants = make(json, {"/model/type=ams,hair_mesh", grid, "/model/substeps=2,4"}, true);
  EXPECT_THAT(labels(variants),
              ElementsAre("type=ams, resolution=16, substeps=2", "type=ams, resolution=16, substeps=4",
                          "type=ams, resolution=32, substeps=2", "type=ams, resolution=32, substeps=4",
                          "type=hair_mesh, substeps=2", "type=hair_mesh, substeps=4"));
  EXPECT_THAT(variants[4].columns, ElementsAre("hair_mesh", "null", "2"));
  EXPECT_THAT(variants[4].left_out, ElementsAre("/effects/hair_hair"));
  EXPECT_FALSE(variants[4].scene.effects.hair_hair);
  EXPECT_THAT(variants[0].left_out, testing::IsEmpty());
}

TEST_F(StudyVariants, TellEveryBadValueAtOnce) {
  try {
    make(minimal(), {"/model/substeps=0,4,2000", "/model/substep=3"});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    ASSERT_EQ(error.problems().size(), 3u);
    EXPECT_THAT(error.what(), HasSubstr("#/model/substeps: found 0"));
    EXPECT_THAT(error.what(), HasSubstr("#/model/substeps: found 2000"));
    EXPECT_THAT(error.what(), HasSubstr("given by --vary"));
  }
}

}  // namespace
}  // namespace ringlet::study
