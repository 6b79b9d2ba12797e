#include "solids/weld.h"

#include <unordered_map>

namespace ringlet::solids {
namespace {

template <class T>
void append(std::string& key, const T& value) {
  key.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void append(std::string& key, const Vec3& value) {
  for (const double x : value) append(key, x + 0.0);  // -0 and 0 are one place
}

// Groups vertices by the bytes of their keys.
Weld group(const std::vector<std::string>& keys) {
  Weld weld;
  weld.label.reserve(keys.size());
  std::unordered_map<std::string_view, std::int32_t> labels;
  labels.reserve(keys.size());
  for (std::size_t v = 0; v < keys.size(); ++v) {
    const auto [found, is_new] = labels.try_emplace(keys[v], static_cast<std::int32_t>(labels.size()));
    if (is_new) weld.representative.push_back(static_cast<std::int32_t>(v));
    weld.label.push_back(found->second);
  }
  return weld;
}

}  // namespace

Weld find_weld(const Rig& rig) {
  std::vector<std::string> keys(rig.vertices.size());
  for (std::size_t v = 0; v < keys.size(); ++v) {
    append(keys[v], rig.vertices[v]);
    for (auto i = static_cast<std::size_t>(rig.influence_begin[v]);
         i < static_cast<std::size_t>(rig.influence_begin[v + 1]); ++i) {
      append(keys[v], rig.influence_joint[i]);
      append(keys[v], rig.influence_weight[i]);
    }
  }
  for (std::size_t t = 0; t < rig.targets.size(); ++t) {
    const MorphTarget& target = rig.targets[t];
    for (std::size_t i = 0; i < target.vertices.size(); ++i) {
      std::string& key = keys[static_cast<std::size_t>(target.vertices[i])];
      append(key, t);
      append(key, target.deltas[i]);
    }
  }
  return group(keys);
}

std::vector<std::int32_t> refine(Weld& weld, std::span<const Vec3> positions) {
  std::vector<std::string> keys(positions.size());
  for (std::size_t v = 0; v < keys.size(); ++v) {
    append(keys[v], weld.label[v]);
    append(keys[v], positions[v]);
  }
  Weld finer = group(keys);
  std::vector<std::int32_t> parents;
  parents.reserve(finer.representative.size());
  for (const std::int32_t v : finer.representative)
    parents.push_back(weld.label[static_cast<std::size_t>(v)]);
  weld = std::move(finer);
  return parents;
}

Rig apply(Rig rig, const Weld& weld) {
  const auto label = [&weld](std::int32_t v) { return weld.label[static_cast<std::size_t>(v)]; };
  std::vector<Vec3> vertices;
  std::vector<std::int32_t> begin{0}, joints;
  std::vector<double> weights;
  for (const std::int32_t v : weld.representative) {
    const auto from = static_cast<std::size_t>(v);
    vertices.push_back(rig.vertices[from]);
    for (auto i = static_cast<std::size_t>(rig.influence_begin[from]);
         i < static_cast<std::size_t>(rig.influence_begin[from + 1]); ++i) {
      joints.push_back(rig.influence_joint[i]);
      weights.push_back(rig.influence_weight[i]);
    }
    begin.push_back(static_cast<std::int32_t>(joints.size()));
  }
  for (MorphTarget& target : rig.targets) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < target.vertices.size(); ++i) {
      const std::int32_t welded = label(target.vertices[i]);
      if (weld.representative[static_cast<std::size_t>(welded)] != target.vertices[i]) continue;
      target.vertices[kept] = welded;
      target.deltas[kept++] = target.deltas[i];
    }
    target.vertices.resize(kept);
    target.deltas.resize(kept);
  }
  for (Triangle& triangle : rig.triangles)
    for (std::int32_t& v : triangle) v = label(v);
  rig.vertices = std::move(vertices);
  rig.influence_begin = std::move(begin);
  rig.influence_joint = std::move(joints);
  rig.influence_weight = std::move(weights);
  return rig;
}

}  // namespace ringlet::solids
