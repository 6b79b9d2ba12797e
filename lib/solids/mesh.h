// Animated triangle meshes, read by assimp.
#pragma once
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/geometry.h"
#include "scene/scene_desc.h"

namespace ringlet::solids {

// A mesh with everything that moves it: node transforms, skins, node animation, morph targets, a numbered
// sequence of files, and the scene's own keys on top. Metres, scene axes.
class AnimatedMesh {
 public:
  // Throws Error{kInput}: unreadable file, no triangles, non-finite vertices, unknown clip (the known ones
  // are named), sequence with gaps or changing topology.
  AnimatedMesh(const scene::MeshDesc& desc, const scene::Units& scene_units, const scene::Frames& frames);
  ~AnimatedMesh();
  AnimatedMesh(AnimatedMesh&&) noexcept;

  std::size_t vertex_count() const;
  const std::vector<Triangle>& triangles() const;
  const std::vector<std::int32_t>& mesh_of_triangle() const;  // index into mesh_names
  const std::vector<std::string>& mesh_names() const;
  // No clip, no keys. Where a skin holds them: in its bind pose, which grooms are made on, whatever the
  // joints' nodes hold; else by the node transforms.
  const std::vector<Vec3>& rest_vertices() const;

  // Nothing moves; or every vertex moves by one rigid pose; or it deforms. Found by looking at the motion,
  // not guessed from the file's features (a skin whose joints move as one is rigid).
  enum class Motion { kStill, kRigid, kDeforming };
  Motion motion() const;

  // How long it moves by itself [s]: to the last key, the clip's end or the sequence's, whichever comes last.
  double duration() const;

  // Vertices at `time` [s] after frame `first`. Times before 0 are preroll: from the rest pose (at minus its
  // length) to the pose at 0. Deterministic; safe to call from several threads at once.
  void sample(double time, std::span<Vec3> out) const;

  // The pose that takes the rest vertices to those at `time` (motion() still or rigid only).
  Pose pose(double time) const;
  // The rigid pose that takes the rest vertices nearest to these, a sample of all: how a deforming mesh
  // travels and turns as a whole.
  Pose nearest_pose(std::span<const Vec3> vertices) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ringlet::solids
