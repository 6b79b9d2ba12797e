#include "plan.h"

#include <fmt/format.h>

#include <iterator>
#include <nlohmann/json.hpp>
#include <string>

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

// With three digits, in the largest unit that leaves a whole part.
std::string size(std::size_t bytes) {
  double value = static_cast<double>(bytes);
  const char* const units[] = {"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (; value >= 999.5 && unit + 1 < std::size(units); ++unit) value *= 1e-3;
  return fmt::format("{:.3g} {}", value, units[unit]);
}

void print_table(const scene::Scene& scene, const pipeline::Plan& plan) {
  fmt::print("scene {}: {} strands, {} particles, {} frames of {} substeps\n", scene.name, plan.strands,
             plan.particles, plan.frames, range(plan.least_substeps, plan.substeps));
  fmt::print("  {:<13} {:>10} {:>16}  {}\n", "stage", "memory", "launches", "what");
  for (const pipeline::PlannedStage& stage : plan.stages) {
    if (stage.runs)
      fmt::print("  {:<13} {:>10} {:>16}  {}\n", stage.name, size(stage.bytes),
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
