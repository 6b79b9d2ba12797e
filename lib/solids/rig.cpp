#include "solids/rig.h"

#include <algorithm>

namespace ringlet::solids {
namespace {

double between(double a, double b, double s) { return a + s * (b - a); }
Vec3 between(const Vec3& a, const Vec3& b, double s) { return a + s * (b - a); }
Quat between(const Quat& a, const Quat& b, double s) { return a.slerp(s, b); }

Affine compose(const NodePose& pose) {
  Affine result;
  result.linear() = pose.rotate.toRotationMatrix() * pose.scale.asDiagonal();
  result.translation() = pose.translate;
  return result;
}

Affine local_transform(const Rig& rig, const Node& node, RigTime time) {
  if (time.presence == 0) return node.start;
  NodePose pose = node.rest_pose;
  if (node.channel >= 0) {
    const Channel& channel = rig.channels[static_cast<std::size_t>(node.channel)];
    if (!channel.translate.empty()) pose.translate = channel.translate.at(time.clip_time);
    if (!channel.rotate.empty()) pose.rotate = channel.rotate.at(time.clip_time);
    if (!channel.scale.empty()) pose.scale = channel.scale.at(time.clip_time);
  } else if (time.presence == 1 || node.start.matrix() == node.rest.matrix()) {
    return node.rest;
  }
  if (time.presence < 1) {
    const NodePose& start = node.start_pose;
    pose = {between(start.translate, pose.translate, time.presence),
            between(start.rotate, pose.rotate, time.presence),
            between(start.scale, pose.scale, time.presence)};
  }
  return compose(pose);
}

// What each joint does to a vertex.
std::vector<Affine> joint_transforms(const Rig& rig, RigTime time, const Affine& placement) {
  std::vector<Affine> global(rig.nodes.size());
  for (std::size_t i = 0; i < rig.nodes.size(); ++i) {
    const Node& node = rig.nodes[i];
    const Affine& parent = node.parent < 0 ? placement : global[static_cast<std::size_t>(node.parent)];
    global[i] = parent * local_transform(rig, node, time);
  }
  std::vector<Affine> result(rig.joints.size());
  for (std::size_t i = 0; i < rig.joints.size(); ++i)
    result[i] = global[static_cast<std::size_t>(rig.joints[i].node)] * rig.joints[i].offset;
  return result;
}

void add_morphs(const Rig& rig, RigTime time, std::span<Vec3> out) {
  for (const MorphTarget& target : rig.targets) {
    double weight = target.rest_weight;
    if (!target.weight.empty() && time.presence > 0)
      weight = between(weight, target.weight.at(time.clip_time), time.presence);
    if (weight == 0) continue;
    for (std::size_t i = 0; i < target.vertices.size(); ++i)
      out[static_cast<std::size_t>(target.vertices[i])] += weight * target.deltas[i];
  }
}

}  // namespace

template <class T>
T Track<T>::at(double time) const {
  const auto after = std::upper_bound(times.begin(), times.end(), time) - times.begin();
  if (after == 0) return values.front();
  const std::size_t i = static_cast<std::size_t>(after);
  if (i == times.size()) return values.back();
  return between(values[i - 1], values[i], (time - times[i - 1]) / (times[i] - times[i - 1]));
}

std::vector<double> Rig::key_times() const {
  std::vector<double> times{clip_length};
  const auto add = [&times](const auto& track) {
    times.insert(times.end(), track.times.begin(), track.times.end());
  };
  for (const Channel& channel : channels) add(channel.translate), add(channel.rotate), add(channel.scale);
  for (const MorphTarget& target : targets) add(target.weight);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

void sample_rig(const Rig& rig, RigTime time, const Affine& placement, std::span<Vec3> out) {
  const std::vector<Affine> joints = joint_transforms(rig, time, placement);
  std::copy(rig.vertices.begin(), rig.vertices.end(), out.begin());
  add_morphs(rig, time, out);
  for (std::size_t v = 0; v < rig.vertices.size(); ++v) {
    const std::int32_t begin = rig.influence_begin[v], end = rig.influence_begin[v + 1];
    const auto joint = [&](std::int32_t i) -> const Affine& {
      return joints[static_cast<std::size_t>(rig.influence_joint[static_cast<std::size_t>(i)])];
    };
    if (end - begin == 1) {
      out[v] = joint(begin) * out[v];
      continue;
    }
    Affine::MatrixType blended = Affine::MatrixType::Zero();
    for (std::int32_t i = begin; i < end; ++i)
      blended += rig.influence_weight[static_cast<std::size_t>(i)] * joint(i).matrix();
    out[v] = blended.leftCols<3>() * out[v] + blended.col(3);
  }
}

}  // namespace ringlet::solids
