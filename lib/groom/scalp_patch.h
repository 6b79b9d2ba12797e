// The polygon patch on a head's scalp that a hair mesh is extruded from.
#pragma once
#include <optional>
#include <vector>

#include "groom/groom.h"
#include "groom/hair_mesh.h"

namespace ringlet::groom {

// Where the patch lies: on triangles of the head, within an angle about a direction from a centre. What is
// left out follows from the triangles.
struct ScalpRegion {
  scene::ScalpSelection selection;  // of the head's triangles; nothing set: all of them
  std::optional<Vec3> centre;       // [m] inside the head; else that of the sphere nearest to the triangles
  std::optional<Vec3> pole;     // the patch's middle seen from the centre; else the triangles' mean direction
  std::optional<double> angle;  // [rad] from the pole to the rim; else as far as the triangles go
  std::optional<Vec3> forward;  // where the face looks; else z where y is up, and what that is in other axes
};

struct ScalpPatch {
  std::vector<HairMesh::Face> faces;  // triangles about the pole, else quads and some triangles
  std::vector<Vec3> points;           // [m] on the head
  Vec3 centre = Vec3::Zero();         // [m]
  Mat3 axes = Mat3::Identity();       // columns: to the left of one who looks forward, up, forward
  Vec3 radii = Vec3::Ones();   // [m] along the axes: of the ellipsoid about the centre nearest to the points
  Vec3 front = Vec3::UnitZ();  // unit; from the centre towards the middle of the patch's front rim
  double radius() const { return radii.mean(); }
};

// Lays rings of vertices about the pole, so many in all: rings are as far apart as vertices on them, and rays
// from the centre carry them out to the head's outermost surface. Throws Error{kInput} where the region
// selects no triangles, its triangles do not lie about the centre, or so many vertices (7 to 100000) do not
// fit.
ScalpPatch lay_scalp_patch(const ScalpRegion& region, int vertices, const Scalp& scalp, scene::Axis up);

}  // namespace ringlet::groom
