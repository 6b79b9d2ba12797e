#include "solids/import.h"

#include <assimp/commonMetaData.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <map>
#include <set>
#include <tuple>

#include "core/error.h"
#include "core/log.h"

namespace ringlet::solids {
namespace {

Vec3 convert(const aiVector3D& v) { return {v.x, v.y, v.z}; }

Quat convert(const aiQuaternion& q) {
  const Quat result(q.w, q.x, q.y, q.z);
  return result.norm() > 0 ? result.normalized() : Quat::Identity();
}

Affine convert(const aiMatrix4x4& m) {
  Affine result;
  result.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4;
  return result;
}

bool is_finite(double x) { return std::isfinite(x); }
bool is_finite(const Vec3& v) { return v.allFinite(); }
bool is_finite(const Quat& q) { return q.coeffs().allFinite(); }

// What assimp calls the file's format, e.g. "glTF2 Importer".
std::string source_format(const aiScene& scene) {
  aiString format;
  if (scene.mMetaData != nullptr) scene.mMetaData->Get(AI_METADATA_SOURCE_FORMAT, format);
  return format.C_Str();
}

bool is_collada(const aiScene& scene) { return source_format(scene).find("Collada") != std::string::npos; }
bool is_fbx(const aiScene& scene) { return source_format(scene).find("FBX") != std::string::npos; }
bool is_gltf(const aiScene& scene) { return source_format(scene).find("glTF") != std::string::npos; }

// Builds a rig out of an assimp scene, which need not outlive it.
class RigBuilder {
 public:
  RigBuilder(const aiScene& scene, std::string file) : scene_(scene), file_(std::move(file)) {}

  Rig build(const std::optional<std::string>& clip) {
    if (clip) animation_ = &find_clip(*clip);
    add_node(*scene_.mRootNode, -1);
    if (animation_ != nullptr) add_clip();
    for (std::size_t i = 0; i < node_sources_.size(); ++i) add_meshes(*node_sources_[i], static_cast<int>(i));
    if (rig_.triangles.empty())
      fail("the mesh has no triangles", "a surface is needed, not points or curves");
    rig_.influence_begin.push_back(static_cast<std::int32_t>(rig_.influence_joint.size()));
    return std::move(rig_);
  }

 private:
  [[noreturn]] void fail(const std::string& what, const std::string& hint = {}) const {
    throw Error(ErrorKind::kInput, file_, what, hint);
  }

  const aiAnimation& find_clip(const std::string& name) const {
    std::string known;
    for (unsigned i = 0; i < scene_.mNumAnimations; ++i) {
      const aiAnimation& animation = *scene_.mAnimations[i];
      if (name.empty() || name == animation.mName.C_Str()) return animation;
      known += (known.empty() ? "" : ", ") + fmt::format("\"{}\"", animation.mName.C_Str());
    }
    if (known.empty()) fail("the file has no clips", "leave `clip` out, or move the mesh by `keys`");
    fail(fmt::format("no clip \"{}\"", name), "the file's clips: " + known);
  }

  void add_node(const aiNode& source, int parent) {
    const int index = static_cast<int>(rig_.nodes.size());
    aiVector3D scale, translate;
    aiQuaternion rotate;
    source.mTransformation.Decompose(scale, rotate, translate);
    const Affine rest = convert(source.mTransformation);
    const NodePose pose{convert(translate), convert(rotate), convert(scale)};
    rig_.nodes.push_back({parent, -1, rest, pose, rest, pose});
    node_sources_.push_back(&source);
    if (!node_by_name_.try_emplace(source.mName.C_Str(), index).second)
      ambiguous_names_.insert(source.mName.C_Str());
    for (unsigned i = 0; i < source.mNumChildren; ++i) add_node(*source.mChildren[i], index);
  }

  // assimp ties joints and clips to nodes by name only; -1 where there is no such node.
  int find_node(const std::string& name) const {
    if (ambiguous_names_.contains(name))
      log_warning(fmt::format("{}: several nodes are named \"{}\"; the first one is taken", file_, name));
    const auto found = node_by_name_.find(name);
    return found == node_by_name_.end() ? -1 : found->second;
  }

  // ---- The clip ---------------------------------------------------------------------------------

  double seconds(double ticks) const {
    return ticks / (animation_->mTicksPerSecond > 0 ? animation_->mTicksPerSecond : kDefaultTicksPerSecond);
  }

  template <class T>
  void add_key(Track<T>& track, double ticks, const T& value) const {
    const double time = seconds(ticks);
    if (!std::isfinite(time) || !is_finite(value)) fail("the clip has a key that is not finite");
    if (!track.times.empty() && time <= track.times.back()) {
      if (time < track.times.back()) fail("the clip's keys are not in order of time");
      track.values.back() = value;  // two keys at one time: the later one counts
      return;
    }
    track.times.push_back(time);
    track.values.push_back(value);
  }

  template <class T, class Key>
  Track<T> track(const Key* keys, unsigned count) const {
    Track<T> result;
    for (unsigned i = 0; i < count; ++i) add_key(result, keys[i].mTime, convert(keys[i].mValue));
    return result;
  }

  void add_clip() {
    rig_.has_clip = true;
    rig_.clip_length = std::max(0.0, seconds(animation_->mDuration));
    for (unsigned i = 0; i < animation_->mNumChannels; ++i) {
      const aiNodeAnim& source = *animation_->mChannels[i];
      const int node = find_node(source.mNodeName.C_Str());
      if (node < 0) continue;  // moves a camera, a light or something else that is no part of the surface
      rig_.nodes[static_cast<std::size_t>(node)].channel = static_cast<int>(rig_.channels.size());
      rig_.channels.push_back({track<Vec3>(source.mPositionKeys, source.mNumPositionKeys),
                               track<Quat>(source.mRotationKeys, source.mNumRotationKeys),
                               track<Vec3>(source.mScalingKeys, source.mNumScalingKeys)});
      const Channel& channel = rig_.channels.back();
      extend_clip(channel.translate), extend_clip(channel.rotate), extend_clip(channel.scale);
    }
  }

  template <class T>
  void extend_clip(const Track<T>& track) {
    if (!track.empty()) rig_.clip_length = std::max(rig_.clip_length, track.times.back());
  }

  // The weight of one morph target; glTF names its channels by the node, others by the mesh, FBX with
  // `*NUMBER` after.
  Track<double> weight_track(const aiNode& node, const aiMesh& mesh, unsigned target) const {
    Track<double> result;
    if (animation_ == nullptr) return result;
    for (unsigned c = 0; c < animation_->mNumMorphMeshChannels; ++c) {
      const aiMeshMorphAnim& channel = *animation_->mMorphMeshChannels[c];
      const std::string name = channel.mName.C_Str(), stem = name.substr(0, name.rfind('*'));
      const auto matches = [&](const aiString& s) { return name == s.C_Str() || stem == s.C_Str(); };
      if (!result.empty() || !(matches(node.mName) || matches(mesh.mName))) continue;
      for (unsigned k = 0; k < channel.mNumKeys; ++k) {
        const aiMeshMorphKey& key = channel.mKeys[k];
        for (unsigned i = 0; i < key.mNumValuesAndWeights; ++i)
          if (key.mValues[i] == target) add_key(result, key.mTime, key.mWeights[i]);
      }
    }
    return result;
  }

  // ---- Surfaces ---------------------------------------------------------------------------------

  void add_meshes(const aiNode& node, int node_index) {
    std::map<unsigned, std::size_t> targets;  // of this node, shared by its meshes
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *scene_.mMeshes[node.mMeshes[i]];
      if (!mesh.HasPositions() || !mesh.HasFaces()) continue;
      const auto first = static_cast<std::int32_t>(rig_.vertices.size());
      add_triangles(mesh, node, first);
      add_vertices(mesh);
      add_influences(mesh, node_index);
      for (unsigned t = 0; t < mesh.mNumAnimMeshes; ++t) {
        const auto [found, is_new] = targets.try_emplace(t, rig_.targets.size());
        if (is_new) {
          rig_.targets.push_back({mesh.mAnimMeshes[t]->mWeight, weight_track(node, mesh, t), {}, {}});
          extend_clip(rig_.targets.back().weight);
        }
        add_deltas(mesh, *mesh.mAnimMeshes[t], first, rig_.targets[found->second]);
      }
    }
  }

  void add_triangles(const aiMesh& mesh, const aiNode& node, std::int32_t first) {
    const std::string name = mesh.mName.length > 0 ? mesh.mName.C_Str() : node.mName.C_Str();
    const auto known = std::find(rig_.mesh_names.begin(), rig_.mesh_names.end(), name);
    const auto name_index = static_cast<std::int32_t>(known - rig_.mesh_names.begin());
    if (known == rig_.mesh_names.end()) rig_.mesh_names.push_back(name);
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines; polygons have been split
      Triangle triangle;
      for (std::size_t c = 0; c < 3; ++c) {
        if (face.mIndices[c] >= mesh.mNumVertices)
          fail(fmt::format("mesh \"{}\": triangle {} names vertex {} of {}", name, f, face.mIndices[c],
                           mesh.mNumVertices));
        triangle[c] = first + static_cast<std::int32_t>(face.mIndices[c]);
      }
      rig_.triangles.push_back(triangle);
      rig_.mesh_of_triangle.push_back(name_index);
    }
  }

  void add_vertices(const aiMesh& mesh) {
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      rig_.vertices.push_back(convert(mesh.mVertices[v]));
      if (!is_finite(rig_.vertices.back()))
        fail(fmt::format("mesh \"{}\": vertex {} is not finite", mesh.mName.C_Str(), v));
    }
  }

  std::int32_t joint(int node, const Affine& offset, int mesh_node) {
    std::array<double, 12> coefficients;
    std::copy_n(offset.data(), coefficients.size(), coefficients.begin());
    const auto [found, is_new] = joint_index_.try_emplace({node, mesh_node, coefficients},
                                                          static_cast<std::int32_t>(rig_.joints.size()));
    if (is_new) rig_.joints.push_back({node, offset, mesh_node});
    return found->second;
  }

  // A skinned vertex follows its joints; any other the node that holds the mesh.
  void add_influences(const aiMesh& mesh, int node_index) {
    std::vector<std::vector<std::pair<std::int32_t, double>>> influences(mesh.mNumVertices);
    for (unsigned b = 0; b < mesh.mNumBones; ++b) {
      const aiBone& bone = *mesh.mBones[b];
      int node = -1;
      for (unsigned i = 0; i < bone.mNumWeights; ++i) {
        const aiVertexWeight& weight = bone.mWeights[i];
        if (!(weight.mWeight > 0) || weight.mVertexId >= mesh.mNumVertices) continue;
        if (node < 0) node = find_node(bone.mName.C_Str());
        if (node < 0)
          fail(fmt::format("mesh \"{}\": its joint \"{}\" is no node of the file", mesh.mName.C_Str(),
                           bone.mName.C_Str()),
               "give every joint a name of its own");
        influences[weight.mVertexId].emplace_back(joint(node, convert(bone.mOffsetMatrix), node_index),
                                                  weight.mWeight);
      }
    }
    for (auto& vertex : influences) {
      if (vertex.empty()) vertex.emplace_back(joint(node_index, Affine::Identity(), -1), 1.0);
      std::sort(vertex.begin(), vertex.end());
      double sum = 0;
      for (const auto& [index, weight] : vertex) sum += weight;
      if (!std::isfinite(sum))
        fail(fmt::format("mesh \"{}\": a skin weight is not finite", mesh.mName.C_Str()));
      rig_.influence_begin.push_back(static_cast<std::int32_t>(rig_.influence_joint.size()));
      for (const auto& [index, weight] : vertex) {
        rig_.influence_joint.push_back(index);
        rig_.influence_weight.push_back(weight / sum);
      }
    }
  }

  // assimp's morph targets are whole meshes, except that COLLADA's RELATIVE ones hold displacements.
  void add_deltas(const aiMesh& mesh, const aiAnimMesh& shape, std::int32_t first, MorphTarget& target) {
    if (!shape.HasPositions()) return;
    const bool relative = mesh.mMethod == aiMorphingMethod_MORPH_RELATIVE && is_collada(scene_);
    for (unsigned v = 0; v < std::min(shape.mNumVertices, mesh.mNumVertices); ++v) {
      const Vec3 delta = convert(shape.mVertices[v]) - (relative ? Vec3::Zero() : convert(mesh.mVertices[v]));
      if (!is_finite(delta))
        fail(fmt::format("mesh \"{}\": morph target \"{}\" is not finite at vertex {}", mesh.mName.C_Str(),
                         shape.mName.C_Str(), v));
      if (delta.isZero(0)) continue;
      target.vertices.push_back(first + static_cast<std::int32_t>(v));
      target.deltas.push_back(delta);
    }
  }

  static constexpr double kDefaultTicksPerSecond = 25;  // assimp's meaning of 0

  const aiScene& scene_;
  const std::string file_;
  const aiAnimation* animation_ = nullptr;
  Rig rig_;
  std::vector<const aiNode*> node_sources_;
  std::map<std::string, int> node_by_name_;
  std::set<std::string> ambiguous_names_;
  std::map<std::tuple<int, int, std::array<double, 12>>, std::int32_t> joint_index_;
};

// ---- Units --------------------------------------------------------------------------------------

// assimp turns COLLADA files into metres, y up, by the root's transform: read the declaration back from
// there.
DeclaredUnits from_root_transform(const aiMatrix4x4& m) {
  const Affine root = convert(m);
  DeclaredUnits declared;
  declared.metres_per_unit = std::cbrt(std::abs(root.linear().determinant()));
  Eigen::Index up;
  root.linear().row(1).cwiseAbs().maxCoeff(&up);
  declared.up = static_cast<scene::Axis>(up);
  return declared;
}

DeclaredUnits from_fbx_settings(const aiScene& scene) {
  DeclaredUnits declared;
  if (scene.mMetaData == nullptr) return declared;
  double centimetres = 0;
  float single = 0;
  if (!scene.mMetaData->Get("UnitScaleFactor", centimetres) &&
      scene.mMetaData->Get("UnitScaleFactor", single))
    centimetres = single;
  if (centimetres > 0) declared.metres_per_unit = 0.01 * centimetres;
  std::int32_t up = -1;
  if (scene.mMetaData->Get("UpAxis", up) && up >= 0 && up <= 2) declared.up = static_cast<scene::Axis>(up);
  return declared;
}

// What the file declares. Takes assimp's own conversion, where there is one, out of the root's transform.
DeclaredUnits take_declared_units(aiScene& scene) {
  if (is_gltf(scene)) return {1.0, scene::Axis::kY};  // by specification
  if (!is_collada(scene) && !is_fbx(scene)) return {};
  aiMatrix4x4& root = scene.mRootNode->mTransformation;
  const DeclaredUnits declared = is_collada(scene) ? from_root_transform(root) : from_fbx_settings(scene);
  root = aiMatrix4x4();
  return declared;
}

// Reads the file; assimp's complaints and its running out of memory become errors.
void read(Assimp::Importer& importer, const std::filesystem::path& file) {
  std::string complaint;
  try {
    importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
    if (importer.ReadFile(file.string(), aiProcess_Triangulate) == nullptr)
      complaint = importer.GetErrorString();
  } catch (const std::exception& error) {
    complaint = error.what();
  }
  if (complaint.empty() && importer.GetScene()->mRootNode == nullptr) complaint = "it has no nodes";
  if (!complaint.empty()) throw Error(ErrorKind::kInput, file.string(), "cannot read the mesh: " + complaint);
}

}  // namespace

ImportedMesh import_mesh(const std::filesystem::path& file, const std::optional<std::string>& clip) {
  std::error_code unknown;
  if (!std::filesystem::is_regular_file(file, unknown))
    throw Error(ErrorKind::kInput, file.string(),
                std::filesystem::exists(file, unknown) ? "is not a regular file" : "no such file");
  Assimp::Importer importer;
  read(importer, file);
  const std::unique_ptr<aiScene> scene(importer.GetOrphanedScene());
  ImportedMesh result;
  result.declared = take_declared_units(*scene);
  result.rig = RigBuilder(*scene, file.string()).build(clip);
  return result;
}

}  // namespace ringlet::solids
