// The part of the head that hair grows on. Private to the room.
#pragma once
#include <vector>

#include "groom/groom.h"

namespace ringlet::groom {

// a . b and |a| with the order of the sums spelled out: growth must not depend on how Eigen vectorises.
double dot(const Vec3& a, const Vec3& b);
double length(const Vec3& a);

// Indices of the selected triangles, ascending; triangles without area are left out. Throws Error{kInput}
// where there are none, naming the meshes that exist; `where` of the error is relative to the growth's JSON
// block.
std::vector<std::int32_t> select_triangles(const Scalp& scalp, const scene::ScalpSelection& selection);

// Twice the area vector of a triangle.
Vec3 area_vector(const Scalp& scalp, const Triangle& triangle);

// Area-weighted unit normals of the vertices. Vertices at the same position share theirs: files split
// vertices at texture seams and between meshes, where the skin goes on all the same.
std::vector<Vec3> vertex_normals(const Scalp& scalp);

}  // namespace ringlet::groom
