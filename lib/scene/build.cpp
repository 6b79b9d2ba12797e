#include "scene/build.h"

#include <algorithm>
#include <numbers>

#include "scene/checks.h"

namespace ringlet::scene {
namespace fs = std::filesystem;
namespace {

// The enumerator of a word. The schema names the words, a test holds the two together.
template <class E>
E word(const Json& value, std::initializer_list<std::pair<const char*, E>> words) {
  for (const auto& [name, enumerator] : words)
    if (value == name) return enumerator;
  throw std::logic_error("scene schema: the word " + value.dump());
}

template <class T>
std::optional<T> optional(const Json& block, const char* key) {
  return block.contains(key) ? std::optional<T>(block[key].get<T>()) : std::nullopt;
}

Vec3 vec3(const Json& value) {
  return Vec3(value[0].get<double>(), value[1].get<double>(), value[2].get<double>());
}

Axis axis(const Json& value) {
  return word<Axis>(value, {{"x", Axis::kX}, {"y", Axis::kY}, {"z", Axis::kZ}});
}

Quat rotation(const Json& q) {
  return Quat(q[3].get<double>(), q[0].get<double>(), q[1].get<double>(), q[2].get<double>()).normalized();
}

class Builder {
 public:
  Builder(const Json& document, const fs::path& file) : document_(document), file_(file) {}

  Scene scene() const {
    const Json& effects = document_["effects"];
    const Json& limits = document_["limits"];
    Scene scene;
    scene.name = document_["name"];
    scene.file = file_;
    scene.frames = frames();
    scene.units = {metres(document_["units"]["length"]), axis(document_["units"]["up"])};
    if (document_.contains("head")) scene.head = head();
    for (const auto& [pointer, groom] : grooms_of(document_))
      scene.grooms.push_back(make_groom(pointer, *groom));
    scene.model = model();
    if (effects.contains("gravity")) scene.effects.gravity = vec3(effects["gravity"]);
    if (effects.contains("inextensible")) scene.effects.inextensible = inextensible(effects["inextensible"]);
    if (effects.contains("non_hookean")) scene.effects.non_hookean = non_hookean(effects["non_hookean"]);
    if (effects.contains("wind")) scene.effects.wind = wind(effects["wind"]);
    if (effects.contains("hair_hair")) scene.effects.hair_hair = hair_hair(effects["hair_hair"]);
    if (!scene.effects.wind && scene.effects.hair_hair && scene.effects.hair_hair->grid)
      scene.effects.hair_hair->grid->shelter.reset();  // from a wind that never blows
    if (effects.contains("grooming")) scene.effects.grooming = grooming(effects["grooming"]);
    for (std::size_t i = 0; i < effects["solids"].size(); ++i)
      scene.effects.solids.push_back(solid("/effects/solids" + pointer_token(i), effects["solids"][i]));
    scene.effects.collision = {effects["collision"]["iterations"]};
    scene.limits = {limits["edge_strain"], limits["speed"]};
    scene.cache = cache();
    return scene;
  }

 private:
  fs::path path(const Json& value) const {
    return (file_.parent_path() / value.get<std::string>()).lexically_normal();
  }

  Frames frames() const {
    const Json& frames = document_["frames"];
    return {frames["first"], frames["last"], frames["fps"], frames["preroll"]};
  }

  static UnitsOverride units(const Json& block) {
    UnitsOverride units;
    if (!block.contains("units")) return units;
    if (block["units"].contains("length")) units.metres_per_unit = metres(block["units"]["length"]);
    if (block["units"].contains("up")) units.up = axis(block["units"]["up"]);
    return units;
  }

  static std::vector<Key> keys(const Json& list) {
    std::vector<Key> keys;
    for (const Json& key : list) {
      keys.push_back(
          {key["frame"], vec3(key["translate"]), rotation(key["rotate"]), key.value("scale", 1.0)});
    }
    return keys;
  }

  static Interpolation interpolation(const Json& block) {
    return word<Interpolation>(block["interpolation"],
                               {{"smooth", Interpolation::kSmooth}, {"linear", Interpolation::kLinear}});
  }

  // Of what has no animation of its own.
  Animation motion() const {
    const Json& motion = document_["motion"];
    Animation animation{};
    animation.carrier = keys(motion["keys"]);
    animation.carrier_interpolation = interpolation(motion);
    animation.speed = motion["speed"];
    return animation;
  }

  // Of a mesh, or of a groom, whose animation has no clip.
  Animation animation(const Json& block) const {
    Animation animation = motion();
    animation.keys = keys(block["keys"]);
    animation.interpolation = interpolation(block);
    animation.clip = optional<std::string>(block, "clip");
    animation.loop = block.contains("loop") && block["loop"].get<bool>();
    return animation;
  }

  MeshDesc head() const {
    const Json& head = document_["head"];
    return {path(head["mesh"]), units(head), animation(head["animation"]), "/head"};
  }

  Groom make_groom(const std::string& pointer, const Json& block) const {
    Groom groom;
    groom.name = block["name"];
    if (block.contains("file")) {
      const Json files = block["file"].is_array() ? block["file"] : Json::array({block["file"]});
      groom.file = path(files[0]);
      for (std::size_t i = 1; i < files.size(); ++i) groom.more.push_back(path(files[i]));
      groom.width = block["width"];
    }
    if (block.contains("skin")) groom.skin = path(block["skin"]);
    if (block.contains("grow")) {
      groom.grow = grow(block["grow"]);
      groom.width = groom.grow->width;
    }
    if (block.contains("hair_mesh")) {
      groom.hair_mesh = hair_mesh_strands(block["hair_mesh"]);
      groom.width = block["width"];
    }
    groom.units = units(block);
    groom.attach =
        word<Attach>(block["attach"],
                     {{"nearest", Attach::kNearest}, {"stored", Attach::kStored}, {"fixed", Attach::kFixed}});
    groom.attach_distance = block["attach_distance"];
    groom.root_offset =
        word<RootOffset>(block["root_offset"], {{"keep", RootOffset::kKeep}, {"snap", RootOffset::kSnap}});
    groom.penetration = word<Penetration>(
        block["penetration"],
        {{"push_out", Penetration::kPushOut}, {"keep", Penetration::kKeep}, {"prune", Penetration::kPrune}});
    groom.animation = animation(block["animation"]);
    for (const Json& scale : block["stiffness"])
      groom.stiffness.push_back({scale["group"], scale["coupling"], scale["curve"].get<Curve>()});
    if (block.contains("interpolate"))
      groom.interpolate = interpolate(pointer + "/interpolate", block["interpolate"]);
    groom.particles = optional<int>(block, "particles");
    groom.pointer = pointer;
    return groom;
  }

  static Grow grow(const Json& block) {
    Grow grow;
    grow.scalp = scalp(block["scalp"]);
    grow.strands_per_triangle = block["strands_per_triangle"];
    grow.strands = block["strands"];
    grow.seed = block["seed"];
    grow.particles = block["particles"];
    grow.step = block["step"];
    grow.length_variation = block["length_variation"];
    grow.direction_noise = block["direction_noise"];
    grow.gravity_influence = block["gravity_influence"];
    grow.max_deviation = block["max_deviation"];
    grow.helix_radius = block["helix_radius"];
    grow.helix_frequency = block["helix_frequency"];
    grow.helix_impact = block["helix_impact"];
    grow.width = block["width"];
    return grow;
  }

  HairMeshStrands hair_mesh_strands(const Json& block) const {
    return {path(block["file"]),  block["strands"],    block["density"], block["particles"],  block["seed"],
            block["curl_radius"], block["curl_turns"], block["noise"],   block["noise_waves"]};
  }

  static Interpolate interpolate(const std::string& pointer, const Json& block) {
    const auto strands = block.value("strands", std::vector<int>{});
    return {block.value("count", 0), optional<std::string>(block, "group"), strands, block["neighbours"],
            pointer};
  }

  static ScalpSelection scalp(const Json& block) {
    ScalpSelection scalp;
    scalp.mesh = optional<std::string>(block, "mesh");
    if (block.contains("box")) scalp.box = {vec3(block["box"][0]), vec3(block["box"][1])};
    if (block.contains("direction")) scalp.direction = vec3(block["direction"]).normalized();
    scalp.max_angle = block["max_angle_degrees"].get<double>() * (std::numbers::pi / 180.0);
    return scalp;
  }

  Model model() const {
    const Json& block = document_["model"];
    const Json& stiffness = block["stiffness"];
    Model model;
    model.type = word<ModelType>(block["type"], {{"ams", ModelType::kAms},
                                                 {"mass_spring", ModelType::kMassSpring},
                                                 {"hair_mesh", ModelType::kHairMesh}});
    model.scheme =
        word<Scheme>(block["scheme"], {{"projected", Scheme::kProjected}, {"paper", Scheme::kPaper}});
    model.stiffness = {stiffness["edge"], stiffness["bend"], stiffness["twist"], stiffness["integrity"],
                       stiffness["angular"]};
    model.particle_mass = block["particle_mass"];
    const Json& substeps = block["substeps"];
    if (substeps.is_object())
      model.substep_choice = {substeps["tolerance"], substeps["min"], substeps["max"]};
    model.substeps = substeps.is_object() ? substeps["max"] : substeps;
    model.drag = block["drag"];
    model.clamped_particles = block["clamped_particles"];
    model.preload = block["preload"];
    model.geometric_stiffness = block["geometric_stiffness"];
    model.material_damping = block["material_damping"];
    model.angular_tangent = word<AngularTangent>(
        block["angular_tangent"],
        {{"consistent", AngularTangent::kConsistent}, {"paper", AngularTangent::kPaper}});
    model.integrity_tangent =
        word<IntegrityTangent>(block["integrity_tangent"],
                               {{"exact", IntegrityTangent::kExact}, {"paper", IntegrityTangent::kPaper}});
    if (model.type == ModelType::kHairMesh) model.hair_mesh = hair_mesh_model(block["hair_mesh"]);
    return model;
  }

  HairMeshModel hair_mesh_model(const Json& block) const {
    HairMeshModel model;
    model.density = block["density"];
    model.stretch = block["stretch"], model.stretch_across = block["stretch_across"];
    model.shear = block["shear"], model.horizontal = block["horizontal"], model.volume = block["volume"];
    model.bend = block["bend"], model.bend_across = block["bend_across"];
    model.damping = block["damping"], model.drag = block["drag"];
    model.residual = block["residual"], model.max_iterations = block["max_iterations"];
    model.deformation_minimisation = block["deformation_minimisation"];
    model.start = word<HairMeshStart>(
        block["start"], {{"rest", HairMeshStart::kRest}, {"collapsed", HairMeshStart::kCollapsed}});
    for (const Json& ellipsoid : block["ellipsoids"])
      model.ellipsoids.push_back({vec3(ellipsoid["centre"]), vec3(ellipsoid["radii"]),
                                  rotation(ellipsoid["rotate"]), ellipsoid["follow"] == "head", motion(),
                                  ellipsoid["friction"]});
    return model;
  }

  // In the order in which they are done.
  std::vector<GroomingOperation> grooming(const Json& list) const {
    std::vector<GroomingOperation> operations;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string pointer = "/effects/grooming" + pointer_token(i);
      operations.push_back(grooming_operation(pointer, list[i]));
    }
    const auto earlier = [](const auto& a, const auto& b) { return a.frame < b.frame; };
    std::stable_sort(operations.begin(), operations.end(), earlier);
    return operations;
  }

  GroomingOperation grooming_operation(const std::string& pointer, const Json& block) const {
    GroomingOperation operation{block["frame"], block.value("groom", ""), Rest{}, pointer};
    if (block.contains("trim")) {
      operation.pointer += "/trim";
      operation.what = trim(operation.pointer, block["trim"]);
    } else if (block.contains("lengthen")) {
      operation.pointer += "/lengthen";
      const Json& lengthen = block["lengthen"];
      operation.what = Lengthen{optional<double>(lengthen, "by"), optional<double>(lengthen, "to"),
                                optional<double>(lengthen, "factor"),
                                word<Lengthening>(lengthen["mode"], {{"extend", Lengthening::kExtend},
                                                                     {"scale", Lengthening::kScale}})};
    } else if (block.contains("comb")) {
      operation.pointer += "/comb";
      const Json& comb = block["comb"];
      std::vector<Vec3> curve;
      for (const Json& point : comb["curve"]) curve.push_back(vec3(point));
      operation.what = Comb{std::move(curve), comb["radius"], comb["strength"]};
    } else {
      operation.pointer += "/rest";
    }
    return operation;
  }

  Trim trim(const std::string& pointer, const Json& block) const {
    Trim trim{};
    if (block.contains("plane"))
      trim.plane = {vec3(block["plane"]["point"]), vec3(block["plane"]["normal"]).normalized()};
    if (block.contains("box")) trim.box = {vec3(block["box"][0]), vec3(block["box"][1])};
    if (block.contains("sphere")) trim.sphere = {vec3(block["sphere"]["centre"]), block["sphere"]["radius"]};
    if (block.contains("mesh")) trim.mesh = {path(block["mesh"]), units(block), {}, pointer + "/mesh"};
    trim.keep_inside = block["keep"] == "inside";
    trim.length = optional<double>(block, "length");
    return trim;
  }

  static Cadence cadence(const Json& value) {
    return word<Cadence>(value, {{"substep", Cadence::kSubstep}, {"frame", Cadence::kFrame}});
  }

  static Inextensible inextensible(const Json& block) {
    const auto metric = word<LengthMetric>(
        block["metric"],
        {{"auto", LengthMetric::kAuto}, {"step", LengthMetric::kStep}, {"mass", LengthMetric::kMass}});
    return {block["tolerance"], block["max_iterations"], metric, cadence(block["per"])};
  }

  static HairHair hair_hair(const Json& block) {
    HairHair hair_hair;
    if (block.contains("grid")) {
      const Json& grid = block["grid"];
      hair_hair.grid = {
          grid["resolution"],       grid["pic"], grid["residual"], grid["max_iterations"], grid["passes"],
          cadence(grid["cadence"]), {}};
      if (grid.contains("shelter")) hair_hair.grid->shelter = grid["shelter"]["strength"].get<double>();
    }
    if (block.contains("contacts")) {
      const Json& contacts = block["contacts"];
      hair_hair.contacts = {contacts["friction"], contacts["passes"], cadence(contacts["cadence"]),
                            optional<double>(contacts, "radius")};
    }
    return hair_hair;
  }

  static NonHookean non_hookean(const Json& block) {
    const auto memory = word<Memory>(
        block["memory"], {{"permanent", Memory::kPermanent}, {"reversible", Memory::kReversible}});
    return {memory, block["curve"].get<Curve>()};
  }

  // Empty for one that never blows.
  static std::optional<Wind> wind(const Json& block) {
    Wind wind;
    const Vec3 constant = block.contains("velocity") ? vec3(block["velocity"]) : Vec3::Zero();
    if (!block.contains("keys")) wind.keys = {{0.0, constant}};
    if (block.contains("keys"))
      for (const Json& key : block["keys"])
        wind.keys.push_back({key["frame"], constant + vec3(key["velocity"])});
    const auto blows = [](const WindKey& key) { return key.velocity != Vec3::Zero(); };
    if (std::none_of(wind.keys.begin(), wind.keys.end(), blows)) return std::nullopt;
    if (block.contains("gusts")) {
      const Json& gusts = block["gusts"];
      wind.gusts = {gusts["strength"], gusts["period"], gusts["seed"]};
    }
    if (block.contains("turbulence")) {
      const Json& eddies = block["turbulence"];
      wind.turbulence = {eddies["strength"], eddies["scale"], eddies["octaves"], eddies["seed"]};
    }
    if (block.contains("shelter")) wind.shelter = {block["shelter"]["strength"], block["shelter"]["wake"]};
    const auto drag = [](const Json& law) { return DragCoefficients{law["linear"], law["quadratic"]}; };
    wind.normal = drag(block["normal_drag"]), wind.tangential = drag(block["tangential_drag"]);
    wind.linear_density = block["linear_density"];
    return wind;
  }

  Solid solid(const std::string& pointer, const Json& block) const {
    Solid solid;
    solid.is_head = block["source"] == "head";
    const MeshDesc mesh =
        solid.is_head ? head()
                      : MeshDesc{path(block["source"]), units(block), animation(block["animation"]), pointer};
    if (!solid.is_head) solid.mesh = mesh;
    if (block.contains("proxy"))
      solid.proxy = {path(block["proxy"]), mesh.units, mesh.animation, pointer + "/proxy"};
    solid.friction = block["friction"];
    solid.offset = block["offset"];
    solid.voxel = optional<double>(block, "voxel");
    solid.resolution = block["resolution"];
    solid.half_width = block["half_width"];
    if (block.contains("level_set_cache")) solid.level_set_cache = path(block["level_set_cache"]);
    solid.name = block["name"];
    solid.pointer = pointer;
    return solid;
  }

  Cache cache() const {
    const Json& block = document_["cache"];
    const auto compression =
        word<Compression>(block["compression"], {{"default", Compression::kDefault},
                                                 {"none", Compression::kNone},
                                                 {"quantised", Compression::kQuantised}});
    const auto strands = word<StoredStrands>(
        block["strands"],
        {{"all", StoredStrands::kAll}, {"guides", StoredStrands::kGuides}, {"both", StoredStrands::kBoth}});
    return {block["fields"], strands, compression, block["error"]};
  }

  const Json& document_;
  const fs::path& file_;
};

}  // namespace

Scene build(const Json& document, const fs::path& file) { return Builder(document, file).scene(); }

}  // namespace ringlet::scene
