// A solid that hair collides with: its surface closed, its level sets built ahead of the stepping.
#pragma once
#include <memory>

#include "kernels/solid/solid_view.h"
#include "solids/mesh.h"

namespace ringlet::solids {

class Solid {
 public:
  // `mesh` is what collides (the proxy where the scene names one) and must outlive the solid. Boundary loops
  // are found and capped (logged). A still or rigid mesh is voxelised once; a deforming one per frame,
  // blended in time, the next frames' level sets built in a background thread. `first_time` is the run's
  // first time [s] (preroll is negative).
  Solid(const scene::Solid& desc, const AnimatedMesh& mesh, const scene::Frames& frames, double first_time,
        const std::filesystem::path& cache_directory);
  ~Solid();
  Solid(Solid&&) noexcept;

  const std::string& name() const;
  std::size_t bytes() const;  // of level sets and surfaces held now

  // The solid over the substep [time_before, time]; both lie in one frame interval. Valid until the next
  // call.
  const kernels::SolidView& at(double time_before, double time);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ringlet::solids
