// The runs of a study: the scene with one setting after another changed, or every combination.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "scene/scene.h"
#include "study/axis.h"

namespace ringlet::study {

inline constexpr const char* kAsGiven = "as given";  // the label of the scene as given

// One run's settings.
struct Variant {
  scene::Scene scene;
  std::vector<std::string> overrides;  // all that make `scene` of its file
  std::vector<std::string> changes;    // those of them that the study made, `POINTER=JSON`
  Machine machine;
  std::vector<std::string> columns;  // [axes] the value of each
  std::vector<std::string> options;  // the changes as arguments of `ringlet run`, quoted for a shell
  std::vector<std::string>
      left_out;       // pointers that the run's model does not take, which is why it lacks them
  std::string label;  // for people: what is changed
  int axis = -1;      // the only one that differs from the scene as given; -1: none or several
  std::string key;    // the same for the same scene on the same settings of the machine
};

// The scene as given.
struct Base {
  std::filesystem::path file;
  std::vector<std::string> overrides;  // --set
  Machine machine;
};

// The runs, each once: the scene as given and each axis' values around it, or with `product` every
// combination of values. Where the model is varied, a run whose model does not take a part that the scene as
// given has, or that another axis gives it, is without that part; an axis within it has no value there.
// Every run's scene is loaded and so checked. Throws Error{kUsage, kInput}.
std::vector<Variant> make_variants(const Base& base, const std::vector<Axis>& axes, bool product);

// The most substeps of a frame that the scene's JSON asks for, which may leave the choice within limits.
int most_substeps(const scene::Scene& scene);

}  // namespace ringlet::study
