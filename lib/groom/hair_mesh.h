// Hair meshes (Yuksel et al. 2009; Wu and Yuksel 2016, section 3): a polygon mesh on the scalp extruded
// through layers. Over each face stands a bundle, a column of prisms with one prism between any two layers;
// strands are made through the layers (hair_mesh_strands.h).
#pragma once
#include <array>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "core/geometry.h"
#include "scene/scene_desc.h"

namespace ringlet::groom {

struct HairMesh {
  // Vertices of a scalp face, counter-clockwise seen from outside; a triangle ends in -1.
  using Face = std::array<std::int32_t, 4>;

  std::vector<Face> faces;
  int layers = 0;                        // the scalp's included
  std::vector<Vec3> positions;           // [layers][vertices()] [m], scene axes; layer 0 lies on the scalp
  std::vector<std::int32_t> groups;      // [faces] index into group_names; empty: no groups
  std::vector<std::string> group_names;  // unique

  // Of one layer.
  std::size_t vertices() const {
    return layers > 0 ? positions.size() / static_cast<std::size_t>(layers) : 0;
  }
  std::size_t prisms() const { return layers > 0 ? faces.size() * static_cast<std::size_t>(layers - 1) : 0; }
  std::span<const Vec3> layer(int k) const {
    return std::span(positions).subspan(k * vertices(), vertices());
  }

  static int corners(const Face& face) { return face[3] < 0 ? 3 : 4; }
};

// Six times the signed volume [m^3] of the corner tetrahedron at a corner of a prism: of the three edges that
// meet there (Wu and Yuksel 2016, Figure 3c). `top`: at the upper layer's corner. Positive where the prism
// is not inverted there.
double corner_determinant(const HairMesh& mesh, std::size_t face, int lower_layer, int corner, bool top);

// Signed volume [m^3] between two layers over one face; a side or quad that is not flat is the bilinear
// surface through its four corners.
double prism_volume(const HairMesh& mesh, std::size_t face, int lower_layer);
double volume(const HairMesh& mesh);

// Area [m^2] of a face of the scalp, of the bilinear surface where it is a quad.
double scalp_area(const HairMesh& mesh, std::size_t face);

// Turns all faces round where every corner tetrahedron is inverted: such a mesh is whole but for its faces'
// direction. The log says so under `where`. Returns whether it did.
bool orient_outward(HairMesh& mesh, const std::string& where);

// Throws Error{kInput} that names face, vertex and layer of what a simulation cannot use; several problems at
// once. Refused are: fewer than 2 layers, arrays that contradict each other, a vertex index that is out of
// range or given twice in a face, a vertex of no face; a scalp that is no manifold (an edge of more than two
// faces or that two faces go along in the same direction, a vertex whose faces meet in nothing else); numbers
// that are not finite; a face without area; a vertex on top of the one below; a prism of which a corner
// tetrahedron is flat or inverted. Messages begin with `where`.
void check(const HairMesh& mesh, const std::string& where);

// ---- Files (schemas/hair_mesh.md) -------------------------------------------------------------------------

// Whether the file is a hair mesh: JSON that says so, or an OBJ of several objects that reads as one and
// passes check(). False for a file that cannot be read.
bool is_hair_mesh(const std::filesystem::path& file);

// Reads a hair mesh in JSON or as layered OBJ, by its content, turns its faces outward and checks it. Lengths
// become metres and axes the scene's: `units` goes before what the file declares, that before the scene's.
// Throws Error{kInput} with line or JSON pointer, or with what check() finds.
HairMesh read_hair_mesh(const std::filesystem::path& file, const scene::UnitsOverride& units,
                        const scene::Units& scene_units);

// What such a file says of its unit and up axis; OBJ says nothing. Throws as read_hair_mesh does.
scene::UnitsOverride declared_hair_mesh_units(const std::filesystem::path& file);

// Writes all digits: what is read back in the same units is the same, bit for bit. Lengths are metres, axes
// those of the mesh. Throws Error{kIo}; then no file of this name is left half written.
void write_hair_mesh_json(const std::filesystem::path& file, const HairMesh& mesh, scene::Axis up);
void write_hair_mesh_obj(const std::filesystem::path& file, const HairMesh& mesh);

}  // namespace ringlet::groom
