// What a hair mesh must be for a simulation to use it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/error.h"
#include "groom/hair_mesh.h"

namespace ringlet::groom {

namespace {

constexpr std::size_t kMostProblems = 8;          // told in full; of the others the number
constexpr std::size_t kMostVertices = 1'500'000;  // so many blocks can be numbered
constexpr double kFlat = 1e-12;                   // relative to the size of what should have an extent

class Checker {
 public:
  Checker(const HairMesh& mesh, const std::string& where) : mesh_(mesh), where_(where) {}

  void run() {
    check_arrays();
    stop_if_any();  // what follows relies on the indices
    check_edges();
    check_fans();
    check_finite();
    stop_if_any();  // what follows relies on the numbers
    check_faces();
    check_heights();
    check_prisms();
    stop_if_any();
  }

 private:
  void add(std::string what, std::string hint) {
    ++found_;
    if (problems_.size() < kMostProblems) problems_.push_back({where_, std::move(what), std::move(hint)});
  }

  void stop_if_any() {
    if (found_ == 0) return;
    if (found_ > problems_.size())
      problems_.push_back({where_, fmt::format("and {} more problems", found_ - problems_.size()), ""});
    throw Error(ErrorKind::kInput, std::move(problems_));
  }

  // "face 12 (group fringe)".
  std::string name_of(std::size_t face) const {
    if (mesh_.groups.empty()) return fmt::format("face {}", face);
    return fmt::format("face {} (group {})", face, mesh_.group_names[mesh_.groups[face]]);
  }

  const Vec3& at(int layer, std::int32_t vertex) const {
    return mesh_.positions[static_cast<std::size_t>(layer) * mesh_.vertices() + vertex];
  }

  void check_arrays() {
    if (mesh_.layers < 2)
      add(fmt::format("has {} layer{}, expected 2 or more", mesh_.layers, mesh_.layers == 1 ? "" : "s"),
          "layer 0 is the scalp's");
    if (mesh_.positions.size() > kMostVertices)
      add(fmt::format("has {} vertices, expected {} or fewer", mesh_.positions.size(), kMostVertices),
          "a hair mesh is coarse, its strands are not");
    if (mesh_.faces.empty()) add("the scalp has no faces", "give triangles or quads");
    if (mesh_.layers > 0 && mesh_.positions.size() % mesh_.layers != 0)
      add(fmt::format("{} positions are not so many on each of {} layers", mesh_.positions.size(),
                      mesh_.layers),
          "");
    if (!mesh_.groups.empty() && mesh_.groups.size() != mesh_.faces.size())
      add(fmt::format("{} faces have a group, expected all {} or none", mesh_.groups.size(),
                      mesh_.faces.size()),
          "");
    for (const std::int32_t group : mesh_.groups)
      if (group < 0 || static_cast<std::size_t>(group) >= mesh_.group_names.size())
        add(fmt::format("group {} has no name, {} are named", group, mesh_.group_names.size()), "");
    if (found_ == 0) check_indices();
  }

  void check_indices() {
    const auto count = static_cast<std::int64_t>(mesh_.vertices());
    std::vector<unsigned char> used(mesh_.vertices(), 0);
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      const auto corners = std::span(mesh_.faces[f]).first(HairMesh::corners(mesh_.faces[f]));
      for (const std::int32_t vertex : corners) {
        if (vertex < 0 || vertex >= count)
          add(fmt::format("{}: vertex {} does not exist, each layer has {}", name_of(f), vertex, count),
              "vertices are numbered from 0");
        else
          used[vertex] = 1;
      }
      if (std::set(corners.begin(), corners.end()).size() < corners.size())
        add(fmt::format("{}: has a vertex twice ({})", name_of(f), fmt::join(corners, ", ")),
            "a face has three or four different vertices");
    }
    for (std::size_t v = 0; v < used.size(); ++v)
      if (!used[v]) add(fmt::format("vertex {} is of no face", v), "remove it from every layer");
  }

  void check_edges() {
    std::map<std::array<std::int32_t, 2>, std::vector<std::size_t>> of_edge;  // faces along it, by direction
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      const int n = HairMesh::corners(mesh_.faces[f]);
      for (int c = 0; c < n; ++c) of_edge[{mesh_.faces[f][c], mesh_.faces[f][(c + 1) % n]}].push_back(f);
    }
    for (const auto& [edge, along] : of_edge) {
      const auto [a, b] = edge;
      const auto opposite = of_edge.find({b, a});
      std::vector<std::size_t> all = along;
      if (opposite != of_edge.end()) {
        if (b < a) continue;  // told from the other end
        all.insert(all.end(), opposite->second.begin(), opposite->second.end());
      }
      std::sort(all.begin(), all.end());
      std::vector<std::string> names;
      for (const std::size_t f : all) names.push_back(name_of(f));
      if (all.size() > 2)
        add(fmt::format("the scalp is no manifold: the edge of vertices {} and {} is of {} faces: {}", a, b,
                        all.size(), fmt::join(names, ", ")),
            "an edge is of one face or of two");
      else if (along.size() == 2)
        add(fmt::format("{} and {} both go from vertex {} to {}: one of them looks inward", names[0],
                        names[1], a, b),
            "turn one of them round");
    }
  }

  // Round a vertex its faces form one fan: each is joined to the others by edges at the vertex.
  void check_fans() {
    std::vector<std::vector<std::size_t>> of_vertex(mesh_.vertices());
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f)
      for (int c = 0; c < HairMesh::corners(mesh_.faces[f]); ++c) of_vertex[mesh_.faces[f][c]].push_back(f);
    for (std::size_t v = 0; v < of_vertex.size(); ++v) {
      const std::size_t apart = first_apart(static_cast<std::int32_t>(v), of_vertex[v]);
      if (apart < of_vertex[v].size())
        add(fmt::format("the scalp is no manifold: {} and {} meet in vertex {} and in no edge there",
                        name_of(of_vertex[v].front()), name_of(of_vertex[v][apart]), v),
            "give each side a vertex of its own");
    }
  }

  // The neighbours of a vertex in one of its faces.
  std::array<std::int32_t, 2> neighbours(std::int32_t vertex, std::size_t face) const {
    const HairMesh::Face& f = mesh_.faces[face];
    const int n = HairMesh::corners(f);
    const auto c = static_cast<int>(std::find(f.begin(), f.begin() + n, vertex) - f.begin());
    return {f[(c + 1) % n], f[(c + n - 1) % n]};
  }

  // Which of a vertex's faces is the first that edges at the vertex do not join to the first of all.
  std::size_t first_apart(std::int32_t vertex, const std::vector<std::size_t>& faces) const {
    std::vector<unsigned char> joined(faces.size(), 0);
    std::set<std::int32_t> reached;
    joined[0] = 1;
    for (const std::int32_t n : neighbours(vertex, faces[0])) reached.insert(n);
    for (bool grew = true; grew;) {
      grew = false;
      for (std::size_t i = 1; i < faces.size(); ++i) {
        const auto [next, before] = neighbours(vertex, faces[i]);
        if (joined[i] || !(reached.contains(next) || reached.contains(before))) continue;
        reached.insert({next, before});
        joined[i] = 1;
        grew = true;
      }
    }
    return std::find(joined.begin(), joined.end(), 0) - joined.begin();
  }

  void check_finite() {
    for (int layer = 0; layer < mesh_.layers; ++layer) {
      for (std::size_t v = 0; v < mesh_.vertices(); ++v) {
        const Vec3& point = at(layer, static_cast<std::int32_t>(v));
        if (!point.allFinite())
          add(fmt::format("layer {}, vertex {}: found {} {} {}, expected finite numbers", layer, v, point.x(),
                          point.y(), point.z()),
              "");
      }
    }
  }

  void check_faces() {
    for (int layer = 0; layer < mesh_.layers; ++layer) {
      for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
        const HairMesh::Face& face = mesh_.faces[f];
        const int n = HairMesh::corners(face);
        Vec3 area = Vec3::Zero();
        double longest = 0;
        for (int c = 0; c < n; ++c) {
          const Vec3 a = at(layer, face[c]) - at(layer, face[0]),
                     b = at(layer, face[(c + 1) % n]) - at(layer, face[0]);
          area += a.cross(b);
          longest = std::max(longest, (b - a).squaredNorm());
        }
        if (!(area.norm() > kFlat * longest))
          add(fmt::format("{}, layer {}: has no area", name_of(f), layer),
              "its vertices lie on a line or in a point");
      }
    }
  }

  void check_heights() {
    Eigen::AlignedBox3d box;
    for (const Vec3& point : mesh_.positions) box.extend(point);
    least_height_ = kFlat * box.diagonal().norm();
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      for (int layer = 1; layer < mesh_.layers; ++layer) {
        const std::int32_t vertex = flat_vertex(f, layer);
        if (vertex >= 0)
          add(fmt::format(
                  "{}, layer {}: vertex {} lies on the one of layer {}, so the layer has no height there",
                  name_of(f), layer, vertex, layer - 1),
              "layers must be apart");
      }
    }
  }

  // A vertex of the face on a layer that lies on the one below; -1: none.
  std::int32_t flat_vertex(std::size_t face, int layer) const {
    for (int c = 0; c < HairMesh::corners(mesh_.faces[face]); ++c) {
      const std::int32_t vertex = mesh_.faces[face][c];
      if (!((at(layer, vertex) - at(layer - 1, vertex)).norm() > least_height_)) return vertex;
    }
    return -1;
  }

  void check_prisms() {
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f)
      for (int layer = 0; layer + 1 < mesh_.layers; ++layer)
        if (flat_vertex(f, layer + 1) < 0) check_prism(f, layer);
  }

  void check_prism(std::size_t face, int layer) {
    const int n = HairMesh::corners(mesh_.faces[face]);
    int wrong = 0, worst_corner = 0;
    bool worst_top = false;
    double worst = 0;
    for (int corner = 0; corner < n; ++corner) {
      for (const bool top : {false, true}) {
        const double value = corner_determinant(mesh_, face, layer, corner, top);
        if (value > 0) continue;
        if (++wrong == 1 || value < worst) worst = value, worst_corner = corner, worst_top = top;
      }
    }
    if (wrong == 0) return;
    add(fmt::format(
            "{}, layers {} to {}: the prism is inverted at rest: {} of its {} corner tetrahedra are flat or "
            "inverted, the worst at vertex {} of layer {} with a volume of {:.3g} m^3",
            name_of(face), layer, layer + 1, wrong, 2 * n, mesh_.faces[face][worst_corner],
            layer + (worst_top ? 1 : 0), worst / 6),
        "move its vertices apart, or turn the face round");
  }

  const HairMesh& mesh_;
  const std::string& where_;
  std::vector<Problem> problems_;
  std::size_t found_ = 0;
  double least_height_ = 0;  // [m] below it two layers are one
};

}  // namespace

void check(const HairMesh& mesh, const std::string& where) { Checker(mesh, where).run(); }

}  // namespace ringlet::groom
