// ringlet groom grow|hair-mesh|convert|trim|lengthen|comb|resample|rest
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "groom/extrude_hair_mesh.h"

namespace ringlet::app {

struct GroomGrowOptions {
  std::string scene;                   // whose head and `grow` blocks are used
  std::vector<std::string> overrides;  // --set
  std::optional<std::string> groom;    // by name; empty: the first that grows
  std::filesystem::path output;        // .h5
};

// A groom read, and what is written in its place. Lengths and places of the other options are in its unit and
// axes.
struct GroomFileOptions {
  std::filesystem::path input, output;
  std::optional<std::filesystem::path> skin;  // .tfxskin
  std::string unit = "m";                     // a name, or metres in one unit
  std::optional<std::string> up;              // empty: what the file declares, or else y
};

struct GroomTrimOptions {  // one of the shapes is given
  GroomFileOptions files;
  std::vector<double> plane, box, sphere;  // point and normal; two corners; centre and radius
  std::optional<std::filesystem::path> mesh;
  std::optional<std::string> mesh_unit;  // empty: the groom's, where the mesh's file declares none
  std::optional<double> length;
  bool keep_inside = false;
};

struct GroomLengthenOptions {  // one of by, to and factor is given
  GroomFileOptions files;
  std::optional<double> by, to, factor;
  bool scale = false;
};

struct GroomCombOptions {  // one of curve and curve_file is given
  GroomFileOptions files;
  std::vector<double> curve;
  std::optional<std::filesystem::path> curve_file;  // a groom
  std::size_t curve_strand = 0;                     // of it
  double radius = 0, strength = 1;
};

struct GroomResampleOptions {  // one of particles and step is given
  GroomFileOptions files;
  std::optional<int> particles;
  std::optional<double> step;
};

// Lengths and places are in the unit and axes given. What is left out is the style's where there is one.
struct GroomHairMeshOptions {
  std::filesystem::path head, output;  // .json or .obj
  std::optional<std::string> unit;  // empty: what the head's file declares, and metres for lengths given here
  std::string up = "y";
  std::optional<groom::HairStyle> style;
  groom::HairResolution resolution = groom::HairResolution::kLow;
  std::optional<std::string> mesh;                 // of the head's meshes, that is the scalp
  std::vector<double> box, centre, pole, forward;  // empty: not given
  std::optional<double> angle;                     // [degrees] from the pole to the rim
  std::optional<int> vertices, layers;             // of one layer; layers
  std::optional<double> length, lift, level, curl_radius, curl_turns, gravity, comb;
};

struct GroomRestOptions {
  std::filesystem::path cache, output;
  int frame = 0;
};

// Writes a hair mesh and says what it holds. Returns 0. Throws Error; then nothing is written.
int run_groom_hair_mesh(const GroomHairMeshOptions& options);

// Each writes a Ringlet groom (.h5) and says what it holds. Returns 0. Throws Error; then nothing is written.
int run_groom_grow(const GroomGrowOptions& options);
int run_groom_convert(const GroomFileOptions& options);
int run_groom_trim(const GroomTrimOptions& options);
int run_groom_lengthen(const GroomLengthenOptions& options);
int run_groom_comb(const GroomCombOptions& options);
int run_groom_resample(const GroomResampleOptions& options);
int run_groom_rest(const GroomRestOptions& options);

}  // namespace ringlet::app
