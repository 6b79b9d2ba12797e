// Everything a scene names, read and made ready: head, solids, strands, root motion.
#pragma once
#include <deque>
#include <memory>
#include <vector>

#include "effects/solids/contact_stage.h"
#include "groom/groom.h"
#include "pipeline/roots.h"
#include "scene/scene_desc.h"
#include "solids/mesh.h"
#include "solids/solid.h"

namespace ringlet::pipeline {

struct World {
  std::unique_ptr<solids::AnimatedMesh> head;     // null: none
  std::deque<solids::AnimatedMesh> solid_meshes;  // solids' own meshes and proxies
  std::vector<const solids::AnimatedMesh*>
      shown;  // head first, then the other solids, as the scene shows them
  std::vector<std::string> shown_names;
  std::vector<solids::Solid> solids;
  groom::Strands strands;              // all grooms, one after the other; rest shape, penetration resolved
  std::vector<groom::RootSite> sites;  // [strands]; triangle -1 without a head
  std::vector<std::int32_t> groom_of_strand;
  std::vector<float> stiffness;  // [particles * kCouplings] where a groom scales it, else empty
  std::unique_ptr<Roots> roots;
  const solids::AnimatedMesh* home_mesh = nullptr;  // what collides as the head
  effects::Skin skin;                               // what they grow on among the solids
};

// Reads and builds all assets. Throws Error{kInput}.
World build_world(const scene::Scene& scene);

// The run's first time: minus the preroll [s].
double first_time(const scene::Frames& frames);

}  // namespace ringlet::pipeline
