// Scenes for the tests of the scene room: a folder with the files they name, and loading from JSON values.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/error.h"
#include "scene/scene.h"

namespace ringlet::scene {

using Json = nlohmann::json;

class SceneTest : public testing::Test {
 protected:
  SceneTest() {
    std::filesystem::create_directories(folder_ / "sequence");
    for (const char* name : {"head.obj", "head", "proxy.obj", "sphere.obj", "a.hair", "b.hair", "c.tfx",
                             "c.tfxskin", "sequence/face.0001.obj"})
      std::ofstream(folder_ / name) << "present";
  }
  ~SceneTest() override { std::filesystem::remove_all(folder_); }

  Scene load_text(const std::string& text, const std::vector<std::string>& overrides = {}) const {
    std::ofstream(file_) << text;
    return load(file_, {overrides});
  }
  Scene load_json(const Json& json, const std::vector<std::string>& overrides = {}) const {
    return load_text(json.dump(), overrides);
  }

  // The lines of the error, the scene's file called `scene` and its folder `DIR`; "no error" where it loads.
  std::string error_of_text(const std::string& text, const std::vector<std::string>& overrides = {},
                            ErrorKind kind = ErrorKind::kInput) const {
    try {
      load_text(text, overrides);
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind);
      std::string lines = error.what();
      for (std::size_t at; (at = lines.find(file_.string())) != lines.npos;)
        lines.replace(at, file_.string().size(), "scene");
      for (std::size_t at; (at = lines.find(folder_.string())) != lines.npos;)
        lines.replace(at, folder_.string().size(), "DIR");
      return lines;
    }
    return "no error";
  }
  std::string error_of(const Json& json, const std::vector<std::string>& overrides = {}) const {
    return error_of_text(json.dump(), overrides);
  }

  // The least a scene needs.
  static Json minimal() {
    return Json::parse(
        R"({"name": "tiny", "frames": {"last": 2}, "groom": {"file": "a.hair", "attach": "fixed"}})");
  }

  // Every key that only the model hair_mesh has.
  static Json full_hair_mesh() {
    return Json::parse(R"({
      "name": "full_hair_mesh",
      "frames": {"last": 9},
      "units": {"length": "cm"},
      "head": {"mesh": "head.obj"},
      "groom": {"name": "long", "hair_mesh": {"file": "a.hair", "strands": 0, "density": 5e4, "particles": 9, "seed": 3,
                "curl_radius": 0.5, "curl_turns": 3, "noise": 0.25, "noise_waves": 2}, "width": 0.01},
      "model": {
        "type": "hair_mesh", "substeps": {"tolerance": 1e-3, "min": 2, "max": 8},
        "hair_mesh": {"density": 90, "stretch": 1e4, "stretch_across": 200, "shear": 300, "horizontal": 400, "bend": 0.1,
          "bend_across": 0.2, "volume": 500, "damping": 0.01, "drag": 0.75, "residual": 1e-5, "max_iterations": 50,
          "deformation_minimisation": false, "start": "collapsed",
          "ellipsoids": [{"centre": [1, 2, 3], "radii": [4, 5, 6], "rotate": [0, 0, 0, 2], "follow": "motion", "friction": 0.5}]}
      }
    })");
  }

  // A valid scene that uses every key of the schema.
  static Json full() {
    return Json::parse(R"({
      "$schema": "scene.schema.json",
      "name": "full",
      "frames": {"first": 1, "last": 96, "fps": 24, "preroll": 8},
      "units": {"length": "cm", "up": "z"},
      "motion": {"keys": [{"frame": 1, "translate": [1, 0, 0], "rotate": [0, 0, 0, 1]},
                          {"frame": 5, "translate": [2, 0, 0], "rotate": [0, 2, 0, 0]}],
                 "interpolation": "linear", "speed": 3},
      "head": {
        "mesh": "head.obj",
        "units": {"length": "in", "up": "y"},
        "animation": {
          "clip": "nod", "loop": true, "interpolation": "linear",
          "keys": [{"frame": 1, "translate": [1, 2, 3], "rotate": [0, 0, 0, 2], "scale": 2},
                   {"frame": 2.5, "translate": [1, 2, 4], "rotate": [1, 0, 0, 0], "scale": 1}]
        }
      },
      "groom": [
        {"file": ["a.hair", "b.hair"], "attach": "nearest", "attach_distance": 3, "penetration": "keep",
         "units": {"length": 0.5, "up": "x"}, "width": 0.01,
         "stiffness": [{"group": "a", "coupling": "edge", "curve": [[0, 1], [0.5, 0.25]]}],
         "interpolate": {"group": "b", "neighbours": 2}, "particles": 20},
        {"name": "skin", "file": "c.tfx", "skin": "c.tfxskin", "attach": "fixed",
         "animation": {"interpolation": "smooth",
                       "keys": [{"frame": 1, "translate": [10, 0, 0], "rotate": [0, 0, 0, 1], "scale": 1}]},
         "interpolate": {"strands": [0, 2]}},
        {"grow": {
          "scalp": {"mesh": "scalp", "box": [[0, 1, 2], [3, 4, 5]], "direction": [0, 0, 2], "max_angle_degrees": 60},
          "strands_per_triangle": 3, "strands": 0, "seed": 7, "particles": 12, "step": 0.5, "length_variation": 0.25,
          "direction_noise": 0.5, "gravity_influence": 0.03, "max_deviation": 0.3, "helix_radius": 5,
          "helix_frequency": 2, "helix_impact": 0.02, "width": 0.02},
         "root_offset": "snap", "interpolate": {"count": 10}},
        {"name": "cut", "file": "b.hair", "attach": "fixed"}
      ],
      "model": {
        "type": "ams", "scheme": "projected",
        "stiffness": {"edge": 1e5, "bend": 1e4, "twist": 1e3, "integrity": 10, "angular": 20},
        "particle_mass": 2, "substeps": 4, "drag": 0.5, "clamped_particles": 2, "preload": false,
        "geometric_stiffness": false, "material_damping": 0.01, "angular_tangent": "paper",
        "integrity_tangent": "paper"
      },
      "effects": {
        "gravity": [0, 0, -9.81],
        "inextensible": {"tolerance": 1e-3, "max_iterations": 5, "metric": "mass", "per": "frame"},
        "non_hookean": {"memory": "reversible", "curve": [[0.25, 0.25], [0.5, 0.375]]},
        "wind": {
          "velocity": [1, 0, 0],
          "keys": [{"frame": 1, "velocity": [1, 2, 3]}, {"frame": 9, "velocity": [0, 0, 0]}],
          "gusts": {"strength": 0.25, "period": 3, "seed": 5},
          "turbulence": {"strength": 0.5, "scale": 20, "octaves": 2, "seed": 6},
          "normal_drag": {"linear": 1e-4, "quadratic": 2e-5}, "tangential_drag": {"linear": 3e-4, "quadratic": 4e-5},
          "linear_density": 1e-5, "shelter": {"strength": 0.5, "wake": 30}
        },
        "hair_hair": {
          "grid": {"resolution": 64, "pic": 0.1, "residual": 1e-3, "max_iterations": 50, "passes": 3, "cadence": "substep",
                   "shelter": {"strength": 0.5}},
          "contacts": {"friction": 0.2, "passes": 2, "cadence": "substep", "radius": 0.05}
        },
        "grooming": [
          {"frame": 9, "groom": "cut", "trim": {"plane": {"point": [1, 2, 3], "normal": [0, 0, 2]}}},
          {"frame": 9, "groom": "cut", "trim": {"box": [[0, 1, 2], [3, 4, 5]], "keep": "inside"}},
          {"frame": 9, "groom": "cut", "trim": {"sphere": {"centre": [1, 2, 3], "radius": 4}}},
          {"frame": 8, "groom": "cut", "trim": {"mesh": "sphere.obj", "units": {"length": "ft", "up": "y"}}},
          {"frame": 96, "groom": "cut", "trim": {"length": 5}},
          {"frame": 10, "groom": "cut", "lengthen": {"by": 5}},
          {"frame": 11, "groom": "cut", "lengthen": {"to": 50}},
          {"frame": 12, "groom": "cut", "lengthen": {"factor": 1.5, "mode": "scale"}},
          {"frame": 13, "groom": "cut", "comb": {"curve": [[0, 0, 0], [1, 2, 3]], "radius": 2, "strength": 0.5}},
          {"frame": 14, "groom": "cut", "rest": {}}
        ],
        "solids": [
          {"source": "head", "proxy": "proxy.obj", "friction": 0.3, "offset": 0.1, "voxel": 0.2, "resolution": 64,
           "half_width": 4, "level_set_cache": "levels"},
          {"source": "sphere.obj", "name": "ball", "units": {"length": "ft", "up": "z"},
           "animation": {"clip": "", "loop": false, "interpolation": "smooth", "keys": []}}
        ],
        "collision": {"iterations": 6}
      },
      "limits": {"edge_strain": 5, "speed": 500},
      "cache": {"fields": ["position", "velocity"], "strands": "both", "compression": "quantised", "error": 0.001}
    })");
  }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("ringlet_scene_" + std::to_string(getpid()));
  const std::filesystem::path file_ = folder_ / "scene.json";
};

}  // namespace ringlet::scene
