#include "solids/bind_pose.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace ringlet::solids {
namespace {

// A bind pose so many times larger or smaller than the nodes at rest make it is in units that the file does
// not tell.
constexpr double kOutOfScale = 3;

std::vector<Affine> rest_globals(const Rig& rig) {
  std::vector<Affine> global;
  for (const Node& node : rig.nodes)
    global.push_back(node.parent < 0 ? node.rest : global[static_cast<std::size_t>(node.parent)] * node.rest);
  return global;
}

// Where the space that a joint's mesh is stored in lies in the bind pose: files keep it in the scene's own
// space (glTF's habit) or in that of the node that holds the mesh.
Affine placement(const Joint& joint, const std::vector<Affine>& global, bool by_node) {
  return by_node ? global[static_cast<std::size_t>(joint.mesh_node)] : Affine::Identity();
}

// Mean square distance of the skinned vertices from `posed` with their meshes placed so.
double distance(const Rig& rig, const std::vector<Vec3>& posed, const std::vector<Affine>& global,
                bool by_node) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t v = 0; v < rig.vertices.size(); ++v) {
    const auto first = static_cast<std::size_t>(rig.influence_begin[v]);
    const Joint& joint = rig.joints[static_cast<std::size_t>(rig.influence_joint[first])];
    if (!joint.skinned()) continue;
    sum += (placement(joint, global, by_node) * rig.vertices[v] - posed[v]).squaredNorm();
    ++count;
  }
  return sum / static_cast<double>(std::max<std::size_t>(count, 1));
}

NodePose taken_apart(const Affine& local) {
  NodePose pose;
  Mat3 rotate, scale;
  local.computeRotationScaling(&rotate, &scale);
  pose.translate = local.translation();
  pose.rotate = Quat(rotate);
  pose.scale = scale.diagonal();
  return pose;
}

double diagonal(const std::vector<Vec3>& vertices) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : vertices) box.extend(v);
  return box.diagonal().norm();
}

void set_start_poses(Rig& rig, const std::vector<Affine>& global, bool by_node) {
  std::vector<std::optional<Affine>> bound(rig.nodes.size());
  for (const Joint& joint : rig.joints) {
    auto& pose = bound[static_cast<std::size_t>(joint.node)];
    if (!joint.skinned() || pose || !(std::abs(joint.offset.linear().determinant()) > 0)) continue;
    pose = placement(joint, global, by_node) * joint.offset.inverse();
  }
  std::vector<Affine> start;
  for (std::size_t i = 0; i < rig.nodes.size(); ++i) {
    Node& node = rig.nodes[i];
    const Affine parent = node.parent < 0 ? Affine::Identity() : start[static_cast<std::size_t>(node.parent)];
    if (bound[i] && std::abs(parent.linear().determinant()) > 0) {
      node.start = parent.inverse() * *bound[i];
      node.start_pose = taken_apart(node.start);
    }
    start.push_back(parent * node.start);
  }
}

}  // namespace

double rest_in_bind_pose(Rig& rig) {
  if (std::none_of(rig.joints.begin(), rig.joints.end(), [](const Joint& j) { return j.skinned(); }))
    return 0;
  std::vector<Vec3> at_nodes(rig.vertices.size()), bound(rig.vertices.size());
  sample_rig(rig, {}, Affine::Identity(), at_nodes);

  const std::vector<Affine> global = rest_globals(rig);
  const double in_scene = distance(rig, at_nodes, global, false),
               in_node = distance(rig, at_nodes, global, true);
  const std::vector<Node> nodes = rig.nodes;
  set_start_poses(rig, global, in_node < in_scene);
  sample_rig(rig, {}, Affine::Identity(), bound);
  const double scale = diagonal(bound) / diagonal(at_nodes);
  if (!(scale <= kOutOfScale && scale >= 1 / kOutOfScale)) {
    rig.nodes = nodes;
    return 0;
  }
  double farthest = 0;
  for (std::size_t v = 0; v < bound.size(); ++v)
    farthest = std::max(farthest, (bound[v] - at_nodes[v]).norm());
  return farthest;
}

}  // namespace ringlet::solids
