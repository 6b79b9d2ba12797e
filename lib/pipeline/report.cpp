#include "pipeline/report.h"

#include <algorithm>
#include <cmath>

namespace ringlet::pipeline {

effects::FrameReport empty_report(std::size_t strands) {
  effects::FrameReport report;
  report.strain.assign(strands, 0.0f);
  report.moved.assign(strands, 0);
  return report;
}

state::Figures figures_of(const effects::FrameReport& report, std::int64_t strand_steps,
                          const std::optional<scene::HairHair>& hair_hair) {
  double free_strain = 0;
  std::vector<float> moved;
  for (std::size_t s = 0; s < report.strain.size(); ++s) {
    if (report.moved[s])
      moved.push_back(report.strain[s]);
    else
      free_strain = std::max(free_strain, static_cast<double>(report.strain[s]));
  }
  std::sort(moved.begin(), moved.end());
  const auto quantile = [&](double q) {
    if (moved.empty()) return 0.0;
    return static_cast<double>(moved[static_cast<std::size_t>(std::ceil(q * (moved.size() - 1)))]);
  };
  state::Figures figures = {
      {"edge_strain_free", free_strain},
      {"edge_strain_moved", quantile(1.0)},
      {"edge_strain_moved_p999", quantile(0.999)},
      {"strands_moved", static_cast<double>(moved.size())},
      {"length_iterations_mean",
       strand_steps ? report.length_iterations / static_cast<double>(strand_steps) : 0.0},
      {"length_iterations_max", report.most_length_iterations},
      {"strand_steps_subdivided", report.subdivided},
      {"contact_rounds_max", report.contact_rounds},
      {"push_out_max", report.pushed},
      {"particles_swept", report.swept},
      {"speed_max", report.speed}};
  const auto add = [&](state::Figures more) { figures.insert(figures.end(), more.begin(), more.end()); };
  if (hair_hair && hair_hair->grid)
    add({{"grid_solves", report.grid_solves},
         {"grid_iterations", report.grid_iterations},
         {"grid_residual", report.grid_residual},
         {"grid_density", report.grid_density},
         {"grid_cells", report.grid_cells}});
  if (hair_hair && hair_hair->contacts)
    add({{"contact_pairs", report.contact_pairs},
         {"contacts", report.contacts},
         {"contact_depth", report.contact_depth},
         {"crossings", report.crossings}});
  return figures;
}

}  // namespace ringlet::pipeline
