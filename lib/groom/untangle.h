// Moves the vertices of a hair mesh a little so that no prism is inverted. Private to the room.
#pragma once
#include <functional>

#include "groom/hair_mesh.h"

namespace ringlet::groom {

// Layer 0 stays. A corner tetrahedron counts by its shape, the determinant over the product of its edges'
// lengths at the start, those along a layer not under a quarter of what they are on the scalp: hair that
// flows together is kept apart. One vertex after the other goes where the squares of what the shapes about it
// lack of `least` sum to least: a determinant is linear in each of its vertices, so that this is a damped 3
// by 3 system. Through the first part of each round displacements are smoothed over the mesh in between, so
// that they spread instead of denting it. Ends where all shapes reach half of `least`, or after `rounds`;
// check() tells whether it did. `keep_clear` moves a place out of what vertices must not enter.
void untangle(HairMesh& mesh, double least, int rounds, const std::function<void(Vec3&)>& keep_clear);

}  // namespace ringlet::groom
