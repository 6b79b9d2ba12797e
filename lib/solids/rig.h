// An animated mesh flattened for sampling: what is left of a file once assimp has read it.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/geometry.h"

namespace ringlet::solids {

using Affine = Eigen::Transform<double, 3, Eigen::AffineCompact>;

// Values at times [s], rising; held outside, straight lines (quaternions: slerp) between.
template <class T>
struct Track {
  std::vector<double> times;
  std::vector<T> values;

  bool empty() const { return times.empty(); }
  T at(double time) const;
};

// A node's local transform, x = rotate * (scale . local) + translate.
struct NodePose {
  Vec3 translate = Vec3::Zero();
  Quat rotate = Quat::Identity();
  Vec3 scale = Vec3::Ones();
};

struct Channel {
  Track<Vec3> translate;
  Track<Quat> rotate;
  Track<Vec3> scale;
};

struct Node {
  int parent;           // -1 at the root
  int channel;          // -1: the clip leaves it as the file has it
  Affine rest;          // local, as the file has it
  NodePose rest_pose;   // the same, taken apart
  Affine start;         // local, in the rig's rest pose: a skin's bind pose, else `rest`
  NodePose start_pose;  // the same, taken apart
};

// Vertices follow node.global * offset.
struct Joint {
  int node;
  Affine offset;
  int mesh_node;  // that holds the skinned mesh; -1: no joint of a skin but the mesh's own node

  bool skinned() const { return mesh_node >= 0; }
};

// Moves `vertices` by weight * delta before they are skinned.
struct MorphTarget {
  double rest_weight;
  Track<double> weight;
  std::vector<std::int32_t> vertices;
  std::vector<Vec3> deltas;
};

// How far an animation has got. `clip_time` [s] is already wrapped or held; `presence` goes from 0 (rest
// pose) to 1.
struct RigTime {
  double clip_time = 0;
  double presence = 0;
};

struct Rig {
  std::vector<Node> nodes;  // parents before children
  std::vector<Channel> channels;
  std::vector<Joint> joints;
  std::vector<MorphTarget> targets;
  double clip_length = 0;  // [s]
  bool has_clip = false;

  std::vector<Vec3> vertices;                 // before morphing and skinning, file units
  std::vector<std::int32_t> influence_begin;  // [vertices + 1] into the two below
  std::vector<std::int32_t> influence_joint;
  std::vector<double> influence_weight;  // sums to 1 for each vertex

  std::vector<Triangle> triangles;  // in the file's order
  std::vector<std::int32_t> mesh_of_triangle;
  std::vector<std::string> mesh_names;

  std::vector<double> key_times() const;  // of everything in the clip [s], rising
};

// The rig's vertices at a time, then moved by `placement` (units, axes and the scene's keys).
void sample_rig(const Rig& rig, RigTime time, const Affine& placement, std::span<Vec3> out);

}  // namespace ringlet::solids
