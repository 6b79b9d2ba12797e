// Strands through the layers of a hair mesh (Wu and Yuksel 2016, section 4; Yuksel et al. 2009).
//
// A root lies at (u, v) of a scalp face: x(u, v) is linear in a triangle and bilinear in a quad. The same
// weights on each layer give the control points P_k(u, v) of a strand, and a curve C(u, v, t) = sum_k h_k(t)
// P_k(u, v) runs through them: cubic Hermite segments whose slope at a layer is that of the parabola through
// it and its two neighbours (a Catmull-Rom spline of uneven knots; at the ends the parabola of the last
// three). It is C1, it interpolates, it has the control points of four layers at most, so that hair bends
// where the mesh does, and it is linear in the vertices, as a B-spline that interpolates would be only by way
// of a system over all layers. Knots are centripetal (square roots of the layers' mean distances at rest),
// which keeps short and long layers side by side from making loops (Yuksel, Schaefer, Keyser 2011). Points
// are even in the mean length along the rest curves.
//
// Curl and noise are offsets o of the rest shape. Each is stored as xi = F0^-1 o, with F = [C_u, C_v, C_t]
// the gradient of the curves at its point, and given back as F xi: offsets go with the mesh's deformation, do
// not swim along it, need no frame that could flip, and stay finite where the mesh is collapsed. They fade
// where the columns of F0 are nearly in a plane, which small deformations would magnify. A strand is
// therefore a linear function of the vertices: place() of velocities gives the points' velocities, and a
// rigid motion of the vertices moves strands rigidly.
#pragma once
#include <span>
#include <vector>

#include "groom/hair_mesh.h"
#include "groom/strands.h"

namespace ringlet::groom {

struct HairMeshStrandsDesc {
  int strands = 0;     // so many over the whole scalp; 0: by `density`
  double density = 0;  // [1/m^2] of the scalp
  int points = 16;     // of each strand, root included; 2 or more
  std::int64_t seed = 0;
  double width = 7e-5;     // [m] diameter
  double curl_radius = 0;  // [m] of a helix about the curve at the tip; grows evenly from 0 at the root
  double curl_turns = 0;   // of it from root to tip
  double noise = 0;        // [m] root mean square offset at the tip; grows evenly from 0 at the root
  double noise_waves = 3;  // of its longest wave from root to tip; three octaves
};

class HairMeshStrands {
 public:
  // The rest mesh passed check(). Roots lie at random, uniform by area, one in each of as many equal parts of
  // the summed area: neighbours in number are neighbours on the scalp. The same on every machine for the same
  // seed. Throws Error{kInput} at `where` for numbers out of their range, a density that gives no strand
  // among them.
  HairMeshStrands(const HairMesh& rest, const HairMeshStrandsDesc& desc, const std::string& where);

  std::size_t size() const { return sites_.size(); }
  int points() const { return points_; }

  // The rest shape; one group for each of the mesh's, or "hair_mesh". Without root triangles.
  Strands strands() const;

  // The strands for the vertices as they are now, [layers][vertices of a layer]. `points` [size() *
  // points()], strand after strand, root first. Safe from several threads; uses several itself.
  void place(std::span<const Vec3> vertices, std::span<Vec3> points) const;

  std::size_t bytes() const;

 private:
  // Where a strand stands: four vertices of the layer and their weights, and those of the derivatives by u
  // and v. A triangle's fourth vertex is its third with weight 0.
  struct Site {
    std::array<std::int32_t, 4> vertex;
    std::array<double, 4> weight, by_u, by_v;
    std::int32_t face;
  };
  // A point's place between two layers: the first of the four layers it hangs on (or fewer), their weights,
  // and those of the derivative by t.
  struct Knot {
    int first_layer;
    std::array<double, 4> weight, by_t;
  };
  using Coefficients = Eigen::Vector3f;  // xi
  struct Layers {                        // of one strand: control points and their derivatives
    std::vector<Vec3> point, by_u, by_v;
  };

  static Site site_in(const HairMesh& rest, std::int32_t face, double u, double v);
  static Knot knot_at(std::span<const double> layer_knots, double t);
  void choose_sites(const HairMesh& rest, const HairMeshStrandsDesc& desc, const std::string& where);
  void choose_knots(std::span<const double> layer_knots);
  void add_offsets(const HairMeshStrandsDesc& desc);
  void gather(const Site& site, std::span<const Vec3> vertices, Layers& out, bool gradients) const;
  Vec3 mix(const Knot& knot, const std::array<double, 4>& weight, const std::vector<Vec3>& of_layers) const;
  Mat3 gradient_at(const Knot& knot, const Layers& layers) const;  // F
  void place_strand(std::size_t strand, std::span<const Vec3> vertices, Layers& layers,
                    std::span<Vec3> points) const;

  int layers_, points_;
  std::size_t vertices_;  // of a layer
  double width_;
  std::vector<Site> sites_;
  std::vector<Knot> knots_;            // [points]
  std::vector<Coefficients> offsets_;  // [strands][points]; empty: neither curl nor noise
  std::vector<Vec3> rest_;             // vertices
  std::vector<std::int32_t> groups_;   // [strands]
  std::vector<std::string> group_names_;
};

// The hair mesh that a scene's groom names, and its strands. Throw Error{kInput}.
HairMesh read_scene_hair_mesh(const scene::Groom& desc, const scene::Units& scene_units);
HairMeshStrands scene_strands(const scene::Groom& desc, const HairMesh& mesh);

}  // namespace ringlet::groom
