// Reference distance from points to a triangle soup, double precision, independent of the level sets it
// checks.
//
// The closest point is exact: an axis-aligned box tree only skips triangles that are farther than the best
// found. The sign is the generalised winding number's (Jacobson et al. 2013), which open meshes have too: the
// tree sums far triangles as dipoles (Barill et al. 2018), and every triangle is summed where that leaves a
// doubt.
#pragma once
#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <vector>

namespace ringlet::oracle {

class MeshDistance {
 public:
  using Vec3 = Eigen::Vector3d;
  using Triangle = std::array<std::int32_t, 3>;

  struct Closest {
    double distance;  // [m] not negative
    Vec3 point;       // on the mesh
    int triangle;
  };

  // Triangles wind the same way round, either way; degenerate ones are allowed. Throws std::invalid_argument
  // without a triangle or for an index outside the vertices.
  MeshDistance(std::vector<Vec3> vertices, std::vector<Triangle> triangles);

  Closest closest(const Vec3& point) const;

  // How often the mesh winds round the point: 1 inside a closed outward mesh, 0 outside, between them near a
  // hole.
  double winding_number(const Vec3& point) const;        // within 0.05
  double exact_winding_number(const Vec3& point) const;  // every triangle's solid angle

  bool inside(const Vec3& point) const;             // |winding number| > 1/2
  double signed_distance(const Vec3& point) const;  // [m] negative inside

 private:
  // A leaf holds order_[first, first + count); an inner node (count 0) has its children at `first` and `first
  // + 1`.
  struct Node {
    Vec3 lower, upper;
    Vec3 centre;       // area-weighted centroid
    Vec3 area_vector;  // sum of the triangles' area vectors [m^2]
    double radius;     // [m] of the ball round the centre that holds the node's triangles
    int first, count;
  };

  Vec3 corner(int triangle, int k) const { return vertices_[triangles_[triangle][k]]; }
  double solid_angle(int triangle, const Vec3& point) const;
  void build(int node, int begin, int end);
  void summarise(Node& node, int begin, int end) const;

  std::vector<Vec3> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<int> order_;  // triangle numbers, leaf by leaf
  std::vector<Node> nodes_;
};

}  // namespace ringlet::oracle
