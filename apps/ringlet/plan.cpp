#include "plan.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "scene/scene.h"

namespace ringlet::app {
namespace {

void print_json(const scene::Scene& scene, const pipeline::Plan& plan) {
  nlohmann::ordered_json out = {{"scene", scene.name},
                                {"strands", plan.strands},
                                {"particles", plan.particles},
                                {"substeps", plan.substeps},
                                {"least_substeps", plan.least_substeps},
                                {"frames", plan.frames},
                                {"stages", nlohmann::json::array()},
                                {"absent", nlohmann::json::array()}};
  for (const pipeline::PlannedStage& stage : plan.stages) {
    if (stage.runs)
      out["stages"].push_back({{"name", stage.name},
                               {"bytes", stage.bytes},
                               {"launches", stage.launches.most},
                               {"least_launches", stage.launches.least}});
    else
      out["absent"].push_back(stage.name);
  }
  fmt::print("{}\n", out.dump(2));
}

// A number, or from the least to the most.
template <class N>
std::string range(N least, N most) {
  return least == most ? fmt::format("{}", most) : fmt::format("{} to {}", least, most);
}

void print_table(const scene::Scene& scene, const pipeline::Plan& plan) {
  fmt::print("scene {}: {} strands, {} particles, {} frames of {} substeps\n", scene.name, plan.strands,
             plan.particles, plan.frames, range(plan.least_substeps, plan.substeps));
  fmt::print("  {:<13} {:>10} {:>16}  {}\n", "stage", "MB", "launches", "what");
  for (const pipeline::PlannedStage& stage : plan.stages) {
    if (stage.runs)
      fmt::print("  {:<13} {:>10.1f} {:>16}  {}\n", stage.name, 1e-6 * static_cast<double>(stage.bytes),
                 range(stage.launches.least, stage.launches.most), stage.what);
    else
      fmt::print("  {:<13} {:>10} {:>16}  {}\n", stage.name, "-", "-", "not in this scene");
  }
}

}  // namespace

int run_plan(const PlanOptions& options) {
  const scene::Scene scene = scene::load(options.scene.file, {options.scene.overrides});
  const auto simulation = pipeline::Simulation::create(scene, options.scene.options);
  if (options.json)
    print_json(scene, simulation->plan());
  else
    print_table(scene, simulation->plan());
  return 0;
}

}  // namespace ringlet::app
