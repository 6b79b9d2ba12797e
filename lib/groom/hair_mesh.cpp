#include "groom/hair_mesh.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/log.h"

namespace ringlet::groom {

namespace {

const Vec3& at(const HairMesh& mesh, int layer, std::int32_t vertex) {
  return mesh.positions[static_cast<std::size_t>(layer) * mesh.vertices() + static_cast<std::size_t>(vertex)];
}

double determinant(const Vec3& a, const Vec3& b, const Vec3& c) { return a.dot(b.cross(c)); }

// Six times the volume between the origin and the surface through the corners. The bilinear surface through
// four points halves the space between its two triangulations, so that it encloses their mean.
double six_volumes_below(const Vec3& a, const Vec3& b, const Vec3& c) { return determinant(a, b, c); }
double six_volumes_below(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const double along_ac = determinant(a, b, c) + determinant(a, c, d),
               along_bd = determinant(a, b, d) + determinant(b, c, d);
  return (along_ac + along_bd) / 2;
}

bool indices_exist(const HairMesh& mesh) {
  const auto count = static_cast<std::int64_t>(mesh.vertices());
  return std::all_of(mesh.faces.begin(), mesh.faces.end(), [&](const HairMesh::Face& face) {
    return std::all_of(face.begin(), face.begin() + HairMesh::corners(face),
                       [&](std::int32_t vertex) { return vertex >= 0 && vertex < count; });
  });
}

}  // namespace

double corner_determinant(const HairMesh& mesh, std::size_t face, int lower_layer, int corner, bool top) {
  const HairMesh::Face& f = mesh.faces[face];
  const int n = HairMesh::corners(f), layer = lower_layer + (top ? 1 : 0);
  const std::int32_t here = f[corner], next = f[(corner + 1) % n], before = f[(corner + n - 1) % n];
  const Vec3& origin = at(mesh, layer, here);
  const Vec3 rise = at(mesh, lower_layer + 1, here) - at(mesh, lower_layer, here);
  return determinant(at(mesh, layer, next) - origin, at(mesh, layer, before) - origin, rise);
}

double prism_volume(const HairMesh& mesh, std::size_t face, int lower_layer) {
  const HairMesh::Face& f = mesh.faces[face];
  const int n = HairMesh::corners(f);
  const Vec3& origin = at(mesh, lower_layer, f[0]);  // near by, for the digits
  std::array<Vec3, 4> low, high;
  for (int c = 0; c < n; ++c) {
    low[c] = at(mesh, lower_layer, f[c]) - origin;
    high[c] = at(mesh, lower_layer + 1, f[c]) - origin;
  }
  double six = n == 3
                   ? six_volumes_below(high[0], high[1], high[2]) - six_volumes_below(low[0], low[1], low[2])
                   : six_volumes_below(high[0], high[1], high[2], high[3]) -
                         six_volumes_below(low[0], low[1], low[2], low[3]);
  for (int c = 0; c < n; ++c) six += six_volumes_below(low[c], low[(c + 1) % n], high[(c + 1) % n], high[c]);
  return six / 6;
}

double volume(const HairMesh& mesh) {
  double sum = 0;
  for (int layer = 0; layer + 1 < mesh.layers; ++layer)
    for (std::size_t face = 0; face < mesh.faces.size(); ++face) sum += prism_volume(mesh, face, layer);
  return sum;
}

// The area element of a bilinear surface is the length of a vector that is linear in both parameters: three
// Gauss points each way see its bend, and are exact where the quad is flat.
double scalp_area(const HairMesh& mesh, std::size_t face) {
  const HairMesh::Face& f = mesh.faces[face];
  const Vec3 &a = at(mesh, 0, f[0]), &b = at(mesh, 0, f[1]), &c = at(mesh, 0, f[2]);
  if (HairMesh::corners(f) == 3) return (b - a).cross(c - a).norm() / 2;
  const Vec3& d = at(mesh, 0, f[3]);
  static constexpr std::array<std::array<double, 2>, 3> kGauss = {
      {{0.5 - 0.3872983346207417, 5.0 / 18}, {0.5, 8.0 / 18}, {0.5 + 0.3872983346207417, 5.0 / 18}}};
  double area = 0;
  for (const auto& [u, weight_u] : kGauss) {
    for (const auto& [v, weight_v] : kGauss) {
      const Vec3 along_u = (1 - v) * (b - a) + v * (c - d), along_v = (1 - u) * (d - a) + u * (c - b);
      area += weight_u * weight_v * along_u.cross(along_v).norm();
    }
  }
  return area;
}

bool orient_outward(HairMesh& mesh, const std::string& where) {
  if (!indices_exist(mesh)) return false;  // check() tells
  bool any = false;
  for (int layer = 0; layer + 1 < mesh.layers; ++layer) {
    for (std::size_t face = 0; face < mesh.faces.size(); ++face) {
      for (int corner = 0; corner < HairMesh::corners(mesh.faces[face]); ++corner) {
        for (const bool top : {false, true}) {
          if (!(corner_determinant(mesh, face, layer, corner, top) < 0)) return false;
          any = true;
        }
      }
    }
  }
  if (!any) return false;
  for (HairMesh::Face& face : mesh.faces)
    std::reverse(face.begin() + 1, face.begin() + HairMesh::corners(face));
  log_info(fmt::format("{}: all {} faces looked inward and were turned round", where, mesh.faces.size()));
  return true;
}

}  // namespace ringlet::groom
