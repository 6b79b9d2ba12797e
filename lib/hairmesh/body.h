// One groom's hair mesh under simulation (physics.md section 8; Wu and Yuksel 2016): the solver of
// kernels/hairmesh in the scene's terms.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/geometry.h"
#include "groom/hair_mesh.h"
#include "groom/strands.h"
#include "hairmesh/collider.h"
#include "kernels/launch/hair_mesh_solver.h"
#include "scene/scene_desc.h"
#include "state/frame.h"

namespace ringlet::hairmesh {

// The mesh's columns as strands, root first: what holds and poses strands holds and poses them.
groom::Strands columns_of(const groom::HairMesh& mesh);

// What a frame's solves and collisions took.
struct FrameFigures {
  double solves = 0, iterations = 0, residual = 0;  // residual: the largest, relative [-]
  double minimisations = 0, minimise_iterations = 0, minimise_residual = 0;
  double touched = 0, corrected = 0;  // most vertices in contact, moved out of solids
  double depth = 0;                   // deepest that one was [m]
};

// A vertex that left the limits or is no longer finite.
struct MeshDivergence {
  std::size_t column;
  int layer;
  std::string what;
};

// Points in and out are [layers][columns], as groom::HairMesh has them, in the world [m].
template <class T>
class Body {
 public:
  // `rest` passed groom::check. `roots`: the columns' poses at the run's first time.
  Body(const groom::HairMesh& rest, const scene::HairMeshModel& model, std::span<const Pose> roots,
       kernels::InstructionSet set);

  // Each column at rest in its root's frame, or collapsed onto its root; nothing moves.
  void start(std::span<const Pose> roots);

  // What holds vertices carries them as it will move in the substep that comes; the solids and ellipsoids as
  // `collide` will be told of them.
  void carry(std::span<const kernels::SolidView> solids,
             const std::vector<kernels::MeshEllipsoid<T>>& ellipsoids, double step);
  // One substep in four parts, each of which can be timed. `roots`: at its end; `air`: the air's velocity at
  // every vertex [m/s], empty where it is still.
  void assemble(double step, std::span<const Pose> roots, const Vec3& gravity, std::span<const Vec3> air);
  void solve(FrameFigures& figures);
  void collide(std::span<const kernels::SolidView> solids,
               const std::vector<kernels::MeshEllipsoid<T>>& ellipsoids, FrameFigures& figures);
  void minimise(FrameFigures& figures);

  std::optional<MeshDivergence> diverged(const scene::Limits& limits) const;
  // A contact that remembers what is not finite.
  std::optional<MeshDivergence> bad_contact() const;

  const std::vector<Vec3>& positions() const { return positions_; }
  const std::vector<Vec3>& velocities() const { return velocities_; }
  const Vec3& origin() const { return origin_; }  // that the solver's coordinates are against
  double volume() const { return solver_->volume(); }
  double rest_volume() const { return rest_volume_; }
  kernels::MeshEnergies energies() const { return solver_->energies(); }
  // Largest stretch of an edge of the extrusion against rest [-].
  double strain() const;
  double speed() const;  // largest [m/s]
  std::size_t bytes() const;
  // Of what `save` writes, with contacts of all vertices where `touches`.
  std::size_t checkpoint_bytes(bool touches) const;
  // Kernels of the solver that substeps called, so far.
  std::int64_t launches() const { return launches_; }

  // Into and out of a checkpoint, under names that end in `suffix`. Throws Error{kInput} for arrays of
  // another size.
  void save(state::Snapshot& snapshot, const std::string& suffix) const;
  void restore(const state::Snapshot& snapshot, const std::string& suffix);

 private:
  std::vector<kernels::MeshContact<T>> contacts() const;
  std::size_t solver_index(std::size_t column, int layer) const { return column * layers_ + layer; }
  void fetch();
  void hand_over();

  scene::HairMeshModel model_;
  std::size_t columns_;
  int layers_;
  std::vector<Vec3> rest_;  // [layers][columns]
  std::vector<Vec3> rest_roots_;
  Vec3 origin_;
  std::unique_ptr<kernels::HairMeshSolver<T>> solver_;
  double rest_volume_;
  double step_ = 0;
  std::int64_t launches_ = 0;
  std::vector<Vec3> positions_, velocities_;
  std::vector<T> solver_positions_, solver_velocities_, roots_, air_;
};

}  // namespace ringlet::hairmesh
