// Where every strand's root frame is at any time.
#pragma once
#include <span>
#include <vector>

#include "groom/groom.h"
#include "scene/scene_desc.h"
#include "solids/mesh.h"

namespace ringlet::pipeline {

// The root frames of all grooms of a scene, strand after strand. A pure function of time: a resumed run meets
// the very same poses.
class Roots {
 public:
  // `head` may be null and must outlive this; `time` in the calls below is in seconds after frame `first`.
  Roots(const solids::AnimatedMesh* head, const scene::Frames& frames);

  // Strands held by the head, or by `animation` about the scene's origin. `rest` are their root points at
  // rest.
  void add_attached(groom::Attachment attachment, std::vector<Vec3> rest);
  void add_fixed(const scene::Animation& animation, std::vector<Vec3> rest);

  std::size_t strands() const { return strands_; }
  Vec3 centre() const;  // mean of the rest roots [m]
  bool still() const;   // nothing moves: every pose is the rest pose
  void pose(double time, std::span<Pose> out) const;

 private:
  struct Group {
    std::optional<groom::Attachment> attachment;
    scene::Animation animation;
    std::vector<Vec3> rest;
  };
  void pose_group(const Group& group, double time, std::span<const Vec3> head_vertices,
                  std::span<Pose> out) const;

  const solids::AnimatedMesh* head_;
  scene::Frames frames_;
  std::vector<Group> groups_;
  std::size_t strands_ = 0;
};

}  // namespace ringlet::pipeline
