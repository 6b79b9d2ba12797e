#include "study/penetration.h"

#include <tbb/parallel_for.h>

#include <algorithm>

namespace ringlet::study {

Penetration::Penetration(const scene::Scene& scene, const state::RunHeader& reference)
    : metres_per_unit_(reference.metres_per_unit), held_(scene.model.clamped_particles) {
  for (const scene::Solid& desc : scene.effects.solids) {
    const std::string name = desc.is_head ? "head" : desc.name;
    for (std::size_t k = 0; k < reference.surfaces.size(); ++k) {
      if (reference.surfaces[k].name != name) continue;
      Solid solid{k, desc.offset, name, {}, {}, nullptr};
      const std::vector<std::int32_t>& corners = reference.surfaces[k].triangles;
      for (std::size_t t = 0; t + 2 < corners.size(); t += 3)
        solid.triangles.push_back({corners[t], corners[t + 1], corners[t + 2]});
      solids_.push_back(std::move(solid));
      break;
    }
  }
}

void Penetration::pose(Solid& solid, const std::vector<float>& vertices) const {
  if (solid.distance && solid.vertices == vertices) return;
  std::vector<Vec3> points;
  for (std::size_t i = 0; i + 2 < vertices.size(); i += 3)
    points.emplace_back(metres_per_unit_ * Vec3(vertices[i], vertices[i + 1], vertices[i + 2]));
  solid.distance = std::make_unique<solids::MeshDistance>(solid.name, points, solid.triangles);
  solid.vertices = vertices;
}

void Penetration::add(const std::vector<std::vector<float>>& surfaces, const state::RunHeader& run,
                      const state::Frame& frame, SpreadOf& depths) {
  for (Solid& solid : solids_) pose(solid, surfaces[solid.surface]);
  std::vector<std::int64_t> particles;
  const auto strands = static_cast<std::int64_t>(run.offsets.size()) - 1;
  const std::int64_t every = stride(run.offsets.back());
  for (std::int64_t s = 0; s < strands; s += every) {
    const auto first = run.offsets[static_cast<std::size_t>(s)],
               end = run.offsets[static_cast<std::size_t>(s) + 1];
    for (std::int64_t i = first + held_; i < end; ++i) particles.push_back(i);
  }
  std::vector<double> depth(particles.size());
  tbb::parallel_for(std::size_t{0}, particles.size(), [&](std::size_t k) {
    const float* x = frame.position.data() + 3 * particles[k];
    const Vec3 point = run.metres_per_unit * Vec3(x[0], x[1], x[2]);
    for (const Solid& solid : solids_) depth[k] = std::max(depth[k], solid.offset - (*solid.distance)(point));
  });
  for (const double value : depth) depths.add(value / metres_per_unit_);
}

}  // namespace ringlet::study
