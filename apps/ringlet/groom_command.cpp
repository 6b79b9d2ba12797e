// The options of `ringlet groom`.
#include "command.h"
#include "groom.h"

namespace ringlet::app {
namespace {

void add_output(CLI::App& command, std::filesystem::path& output) {
  command.add_option("-o,--output", output, "groom file to write (.h5)")->required()->option_text("FILE");
}

void add_files(CLI::App& command, GroomFileOptions& files) {
  command.add_option("INPUT", files.input, ".hair, .data, .tfx or .h5")->required();
  add_output(command, files.output);
  command.add_option("--skin", files.skin, ".tfxskin with the stored roots")->option_text("FILE");
  command
      .add_option("--unit", files.unit,
                  "of the input where it declares none, and of all lengths given here: m, cm, mm, in, ft or "
                  "metres; m by default")
      ->option_text("UNIT");
  command
      .add_option(
          "--up", files.up,
          "up axis of what is written and of all places given here: the file's own by default, y where it "
          "declares none")
      ->option_text("x/y/z");
}

// A subcommand that fills in `Options` and then runs.
template <class Options>
std::shared_ptr<Options> add_job(CLI::App& command, Job& job, int (*run)(const Options&)) {
  const auto options = std::make_shared<Options>();
  command.callback([options, run, &job] { job = [options, run] { return run(*options); }; });
  return options;
}

void add_grow(CLI::App& group, Job& job) {
  CLI::App& command = *group.add_subcommand("grow", "grow a scene's procedural groom into a groom file");
  const auto options = add_job(command, job, run_groom_grow);
  add_scene(command, options->scene, options->overrides);
  command.add_option("--groom", options->groom, "which groom of the scene")->option_text("NAME");
  add_output(command, options->output);
}

void add_scalp_region(CLI::App& command, GroomHairMeshOptions& options) {
  command.add_option("--mesh", options.mesh, "the mesh of the head's file that is the scalp")
      ->option_text("NAME");
  command.add_option("--box", options.box, "two corners: only what lies in the box is scalp")
      ->expected(6)
      ->option_text("AX AY AZ BX BY BZ");
  command
      .add_option("--center", options.centre,
                  "a place inside the head, that of a sphere fitted to the scalp by default")
      ->expected(3)
      ->option_text("X Y Z");
  command
      .add_option("--pole", options.pole,
                  "the direction from there to the scalp's middle, by default its mean")
      ->expected(3)
      ->option_text("X Y Z");
  command
      .add_option("--angle", options.angle,
                  "from the pole to the rim [degrees]; by default as far as the scalp goes")
      ->option_text("DEGREES");
  command.add_option("--forward", options.forward, "where the face looks; z by default where y is up")
      ->expected(3)
      ->option_text("X Y Z");
}

void add_extrusion(CLI::App& command, GroomHairMeshOptions& options) {
  command.add_option("--vertices", options.vertices, "of one layer; 91 by default")->option_text("N");
  command.add_option("--layers", options.layers, "the scalp's included; 5 by default")->option_text("N");
  command.add_option("--length", options.length, "of the hair")->option_text("LENGTH");
  command
      .add_option("--level", options.level,
                  "height along the up axis at which hair is cut; by default it is not")
      ->option_text("HEIGHT");
  command.add_option("--lift", options.lift, "how far hair stands off before it lies down; 0 by default")
      ->option_text("LENGTH");
  command
      .add_option("--gravity", options.gravity,
                  "how sharply hair bends: 0 straight out of the head; 1 by default")
      ->option_text("G");
  command.add_option("--comb", options.comb, "how strongly hair is combed back; 3 by default")
      ->option_text("C");
  command.add_option("--curl-radius", options.curl_radius, "of a helix at the tips; 0 by default")
      ->option_text("LENGTH");
  command.add_option("--curl-turns", options.curl_turns, "of it from root to tip; 0 by default")
      ->option_text("N");
}

void add_hair_mesh(CLI::App& group, Job& job) {
  CLI::App& command = *group.add_subcommand("hair-mesh", "extrude a hair mesh from a head's scalp");
  const auto options = add_job(command, job, run_groom_hair_mesh);
  command.add_option("HEAD", options->head, "mesh file of the head, in its rest pose")->required();
  command.add_option("-o,--output", options->output, "hair mesh to write (.json or .obj)")
      ->required()
      ->option_text("FILE");
  command
      .add_option(
          "--unit", options->unit,
          "of the head, whatever its file declares, and of all lengths given here; by default what the "
          "file declares, and metres")
      ->option_text("UNIT");
  command
      .add_option("--up", options->up,
                  "up axis of what is written and of all places given here; y by default")
      ->option_text("x/y/z");
  using groom::HairResolution, groom::HairStyle;
  const std::map<std::string, HairStyle> styles = {
      {"short", HairStyle::kShort}, {"shoulder", HairStyle::kShoulder}, {"long", HairStyle::kLong}};
  command.add_option("--style", options->style, "in proportion to the head; other options go before it")
      ->transform(CLI::CheckedTransformer(styles))
      ->option_text("short/shoulder/long");
  const std::map<std::string, HairResolution> resolutions = {
      {"low", HairResolution::kLow}, {"medium", HairResolution::kMedium}, {"high", HairResolution::kHigh}};
  command.add_option("--resolution", options->resolution, "of the style; low by default")
      ->transform(CLI::CheckedTransformer(resolutions))
      ->option_text("low/medium/high");
  add_scalp_region(command, *options);
  add_extrusion(command, *options);
}

void add_convert(CLI::App& group, Job& job) {
  CLI::App& command = *group.add_subcommand("convert", "read any groom and write it as Ringlet's own");
  add_files(command, *add_job(command, job, run_groom_convert));
}

void add_trim(CLI::App& group, Job& job) {
  CLI::App& command =
      *group.add_subcommand("trim", "cut every strand where it first enters what is cut away");
  const auto options = add_job(command, job, run_groom_trim);
  add_files(command, options->files);
  command.add_option("--plane", options->plane, "a point and the normal, which points to what stays")
      ->expected(6)
      ->option_text("PX PY PZ NX NY NZ");
  command.add_option("--box", options->box, "two corners")->expected(6)->option_text("AX AY AZ BX BY BZ");
  command.add_option("--sphere", options->sphere, "centre and radius")
      ->expected(4)
      ->option_text("CX CY CZ RADIUS");
  command.add_option("--mesh", options->mesh, "a mesh file, closed as those of solids")->option_text("FILE");
  command.add_option("--mesh-unit", options->mesh_unit, "of the mesh, whatever its file declares")
      ->option_text("UNIT");
  command.add_option("--length", options->length, "from the root along the strand")->option_text("LENGTH");
  const std::map<std::string, bool> sides = {{"outside", false}, {"inside", true}};
  command.add_option("--keep", options->keep_inside, "what stays; outside by default")
      ->transform(CLI::CheckedTransformer(sides))
      ->option_text("outside/inside");
}

void add_lengthen(CLI::App& group, Job& job) {
  CLI::App& command = *group.add_subcommand("lengthen", "make strands longer");
  const auto options = add_job(command, job, run_groom_lengthen);
  add_files(command, options->files);
  command.add_option("--by", options->by, "so much longer")->option_text("LENGTH");
  command.add_option("--to", options->to, "as long as this; longer ones stay")->option_text("LENGTH");
  command.add_option("--factor", options->factor, "so many times as long")->option_text("FACTOR");
  const std::map<std::string, bool> modes = {{"extend", false}, {"scale", true}};
  command
      .add_option("--mode", options->scale,
                  "extend: new particles go on with the curl, the default; scale: the whole shape grows")
      ->transform(CLI::CheckedTransformer(modes))
      ->option_text("extend/scale");
}

void add_comb(CLI::App& group, Job& job) {
  CLI::App& command = *group.add_subcommand("comb", "turn strands near a curve towards it and along it");
  const auto options = add_job(command, job, run_groom_comb);
  add_files(command, options->files);
  command.add_option("--curve", options->curve, "two points or more, in the comb's direction")
      ->expected(6, 30000)
      ->option_text("X Y Z X Y Z ...");
  command.add_option("--curve-file", options->curve_file, "a groom of which one strand is the curve")
      ->option_text("FILE");
  command.add_option("--curve-strand", options->curve_strand, "which; 0 by default")->option_text("N");
  command.add_option("--radius", options->radius, "the comb's reach")->required()->option_text("LENGTH");
  command.add_option("--strength", options->strength, "at the curve: 0 nothing, 1 onto it; 1 by default")
      ->option_text("S");
}

void add_resample(CLI::App& group, Job& job) {
  CLI::App& command = *group.add_subcommand("resample", "spread particles evenly along the strands");
  const auto options = add_job(command, job, run_groom_resample);
  add_files(command, options->files);
  command.add_option("--particles", options->particles, "of every strand")->option_text("N");
  command.add_option("--step", options->step, "segments as near to it as divides a strand evenly")
      ->option_text("LENGTH");
}

void add_rest(CLI::App& group, Job& job) {
  CLI::App& command = *group.add_subcommand("rest", "write the strands of a cache at a frame as a groom");
  const auto options = add_job(command, job, run_groom_rest);
  command.add_option("CACHE", options->cache, "directory or file of a cache")->required();
  command.add_option("--frame", options->frame, "which")->required()->option_text("N");
  add_output(command, options->output);
}

}  // namespace

void add_groom(CLI::App& app, Job& job) {
  CLI::App& group = *app.add_subcommand("groom", "grow, convert and edit grooms");
  group.require_subcommand(1);
  add_grow(group, job);
  add_hair_mesh(group, job);
  add_convert(group, job);
  add_trim(group, job);
  add_lengthen(group, job);
  add_comb(group, job);
  add_resample(group, job);
  add_rest(group, job);
}

}  // namespace ringlet::app
