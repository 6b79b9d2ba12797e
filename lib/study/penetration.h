// How deep hair lies in what it collides with.
#pragma once
#include <memory>
#include <optional>
#include <vector>

#include "scene/scene_desc.h"
#include "solids/mesh_distance.h"
#include "state/frame.h"
#include "study/errors.h"

namespace ringlet::study {

// Depths are measured against the solids' meshes as the cache shows them at the frame, pushed out by the
// solid's offset: the level sets that a run collides with have no say. Of large grooms strands are sampled.
class Penetration {
 public:
  // `scene` and `reference` are those of the run whose frames hold the surfaces.
  Penetration(const scene::Scene& scene, const state::RunHeader& reference);

  bool measures() const { return !solids_.empty(); }

  // Every n-th strand of a run of so many particles is looked at, so that about kParticles are.
  static constexpr std::int64_t kParticles = 50000;
  static std::int64_t stride(std::int64_t particles) {
    return std::max<std::int64_t>(1, particles / kParticles);
  }

  // Adds the depths of a run's particles [scene units], 0 outside, but for those that the head holds.
  // `surfaces` are of the reference's frame of the same number.
  void add(const std::vector<std::vector<float>>& surfaces, const state::RunHeader& run,
           const state::Frame& frame, SpreadOf& depths);

 private:
  struct Solid {
    std::size_t surface;  // index into the frame's
    double offset;        // [m]
    std::string name;
    std::vector<Triangle> triangles;
    std::vector<float> vertices;  // that `distance` is of
    std::unique_ptr<solids::MeshDistance> distance;
  };
  void pose(Solid& solid, const std::vector<float>& vertices) const;

  std::vector<Solid> solids_;
  double metres_per_unit_;
  int held_;
};

}  // namespace ringlet::study
