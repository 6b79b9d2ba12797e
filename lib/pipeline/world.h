// Everything a scene names, read and made ready: head, solids, strands, root motion.
#pragma once
#include <deque>
#include <memory>
#include <vector>

#include "effects/solids/contact_stage.h"
#include "groom/groom.h"
#include "groom/hair_mesh_strands.h"
#include "groom/interpolation.h"
#include "pipeline/roots.h"
#include "scene/scene_desc.h"
#include "solids/mesh.h"
#include "solids/solid.h"

namespace ringlet::pipeline {

// Strands of all grooms, one groom after the other: their rest shapes, penetration resolved, and how they are
// held.
struct StrandSet {
  groom::Strands strands;
  std::vector<groom::RootSite> sites;  // [strands]; triangle -1 without a head
  std::vector<std::int32_t> groom_of_strand;
  std::unique_ptr<Roots> roots;
};

// All strands of a scene whose cache is to hold followers.
struct Interpolated {
  StrandSet all;
  groom::Interpolation interpolation;
};

// A groom's hair mesh, and the strands through it.
struct HairMeshGroom {
  groom::HairMesh mesh;
  groom::HairMeshStrands strands;
};

struct World {
  std::unique_ptr<solids::AnimatedMesh> head;     // null: none
  std::deque<solids::AnimatedMesh> solid_meshes;  // solids' own meshes and proxies
  std::vector<const solids::AnimatedMesh*>
      shown;  // head first, then the other solids, as the scene shows them
  std::vector<std::string> shown_names;
  std::vector<solids::Solid> solids;
  StrandSet simulated;               // guides alone, where a groom interpolates
  std::vector<std::int32_t> living;  // [strands] particles at the start; where grooming may lengthen a
                                     // strand, there is room for that at its tip
  std::vector<float> stiffness;      // [particles * kCouplings] where a groom scales it, else empty
  std::unique_ptr<Interpolated> interpolated;       // null where no groom does
  std::vector<HairMeshGroom> hair_meshes;           // of all grooms with the model hair_mesh, else empty
  const solids::AnimatedMesh* home_mesh = nullptr;  // what collides as the head
  effects::Skin skin;                               // what they grow on among the solids

  const groom::Interpolation& interpolation() const { return interpolated->interpolation; }
};

// Reads and builds all assets. Throws Error{kInput}.
World build_world(const scene::Scene& scene);

// The head as growth and attachment see it.
groom::Scalp scalp_of(const solids::AnimatedMesh& head);

// The run's first time: minus the preroll [s].
double first_time(const scene::Frames& frames);

// When substep `substep` of `substeps` on the way from `frame` to the next begins [s]. Quotients of integers:
// the same bits however a run got there.
double time_of(const scene::Frames& frames, int frame, int substep = 0, int substeps = 1);

// The simulated strands' mean length at rest [m].
double mean_length(const World& world);

}  // namespace ringlet::pipeline
