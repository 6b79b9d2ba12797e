#include "pipeline/roots.h"

#include <algorithm>

#include "solids/keyframes.h"

namespace ringlet::pipeline {

using Motion = solids::AnimatedMesh::Motion;

Roots::Roots(const solids::AnimatedMesh* head, const scene::Frames& frames) : head_(head), frames_(frames) {}

void Roots::add_attached(groom::Attachment attachment, std::vector<Vec3> rest) {
  strands_ += rest.size();
  groups_.push_back({std::move(attachment), {}, std::move(rest)});
}

void Roots::add_fixed(const scene::Animation& animation, std::vector<Vec3> rest) {
  strands_ += rest.size();
  groups_.push_back({std::nullopt, animation, std::move(rest)});
}

Vec3 Roots::centre() const {
  Vec3 sum = Vec3::Zero();
  for (const Group& group : groups_)
    for (const Vec3& root : group.rest) sum += root;
  return sum / static_cast<double>(std::max<std::size_t>(strands_, 1));
}

bool Roots::still() const {
  for (const Group& group : groups_) {
    if (group.attachment ? head_->motion() != Motion::kStill : group.animation.keyed()) return false;
  }
  return true;
}

namespace {

void move_rigidly(const Pose& whole, std::span<const Vec3> rest, std::span<Pose> out) {
  for (std::size_t s = 0; s < rest.size(); ++s)
    out[s] = {whole.rotation, whole.rotation * rest[s] + whole.position};
}

Pose keyed_pose(const scene::Animation& animation, const scene::Frames& frames, double time) {
  solids::Similarity now = solids::sample_animation(animation, frames, std::max(time, 0.0));
  if (time < 0) {  // preroll: from the rest pose to the first one
    const double preroll = frames.preroll / frames.fps;
    now = solids::interpolate(solids::Similarity{}, now, solids::ease(1.0 + time / preroll));
  }
  return {now.rotate.toRotationMatrix(), now.translate};
}

}  // namespace

void Roots::pose_group(const Group& group, double time, std::span<const Vec3> head_vertices,
                       std::span<Pose> out) const {
  if (!group.attachment) {
    move_rigidly(group.animation.keyed() ? keyed_pose(group.animation, frames_, time) : Pose{}, group.rest,
                 out);
  } else if (head_->motion() == Motion::kDeforming) {
    group.attachment->pose(head_vertices, out);
  } else {
    move_rigidly(head_->motion() == Motion::kRigid ? head_->pose(time) : Pose{}, group.rest, out);
  }
}

void Roots::pose(double time, std::span<Pose> out) const {
  std::vector<Vec3> head_vertices;
  if (head_ && head_->motion() == Motion::kDeforming) {
    head_vertices.resize(head_->vertex_count());
    head_->sample(time, head_vertices);
  }
  std::size_t first = 0;
  for (const Group& group : groups_) {
    pose_group(group, time, head_vertices, out.subspan(first, group.rest.size()));
    first += group.rest.size();
  }
}

}  // namespace ringlet::pipeline
