// A groom: strands as polylines, root first.
#pragma once
#include <string>
#include <vector>

#include "core/geometry.h"

namespace ringlet::groom {

// Where a root sits on the head: a triangle and barycentric coordinates in it. Triangle -1: nowhere.
struct RootSite {
  std::int32_t triangle = -1;
  Vec3 barycentric = Vec3::Zero();
};

struct Strands {
  std::vector<std::int64_t> offsets = {0};  // [strands + 1] first particle of each strand; file order
  std::vector<Vec3> points;                 // [particles] rest shape [m], scene axes
  std::vector<float> widths;                // [particles] diameter [m]; empty: unknown
  std::vector<RootSite> roots;              // [strands] as stored in the file; empty: none stored
  std::vector<std::int32_t> groups;         // [strands] index into group_names
  std::vector<std::string> group_names;

  std::size_t size() const { return offsets.size() - 1; }
  std::int64_t particles() const { return offsets.back(); }
  int count(std::size_t strand) const { return static_cast<int>(offsets[strand + 1] - offsets[strand]); }
};

}  // namespace ringlet::groom
