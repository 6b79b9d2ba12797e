// Makes the elements of a hair mesh from its topology, its rest positions and its parameters.
//
// Plain code of the host, compiled for no instruction set; rest quantities are computed in double.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <iterator>
#include <utility>
#include <vector>

#include "kernels/hairmesh/hair_mesh_elements.h"
#include "kernels/hairmesh/hair_mesh_pattern.h"
#include "kernels/hairmesh/hair_mesh_topology.h"

namespace ringlet::kernels {

using RestPoint = std::array<double, 3>;

inline RestPoint operator-(const RestPoint& a, const RestPoint& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline double dot(const RestPoint& a, const RestPoint& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline RestPoint cross(const RestPoint& a, const RestPoint& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// Owns what a HairMeshView points to. The mesh has to be sound: no edge of length 0, no sheet of area 0, no
// prism of a volume that is not positive (the groom's reader refuses such meshes by name).
template <class T>
class HairMeshModel {
 public:
  // `rest`: [vertices][3] [m]
  HairMeshModel(const HairMeshTopology& mesh, const std::vector<double>& rest,
                const HairMeshParameters& parameters)
      : mesh_(mesh),
        rest_(rest),
        parameters_(parameters),
        passes_(passes()),
        pattern_(column_order(), mesh.columns, mesh.layers, parameters.held_roots) {
    tetrahedra_ = mesh_.corner_tetrahedra();
    measure_prisms();
    add_masses();
    add_extrusion_springs_and_sheets();
    add_horizontal_springs();
    add_bends();
    add_volumes();
    place_blocks();
    join_neighbours();
    external_ = mesh_.external_vertices();
    add_samples();
    for (const SurfaceFace& face : mesh_.surface_faces())
      surface_.insert(surface_.end(), std::begin(face.vertex), std::end(face.vertex));
    for (const double x : rest_) rounded_rest_.push_back(static_cast<T>(x));
  }

  HairMeshView<T> view() const {
    return {mesh_.columns,
            mesh_.layers,
            rounded_rest_.data(),
            mass_.data(),
            array(springs_),
            extrusion_springs_,
            array(sheets_),
            array(bends_),
            array(volumes_),
            pattern_.pattern(),
            degree_.data(),
            first_neighbour_.data(),
            neighbour_.data(),
            array(external_),
            array(samples_),
            {surface_.data(), static_cast<std::int32_t>(surface_.size() / 4)},
            static_cast<T>(parameters_.damping),
            static_cast<T>(parameters_.drag),
            static_cast<T>(parameters_.tolerance),
            static_cast<T>(0.02 * mean_length_),
            parameters_.iterations,
            parameters_.held_roots};
  }

 private:
  // Columns of a face are coupled, and those two apart along a pass.
  ColumnOrder column_order() const {
    std::vector<std::vector<std::int32_t>> beside(index(mesh_.columns));
    const auto couple = [&](std::int32_t a, std::int32_t b) {
      beside[index(a)].push_back(b), beside[index(b)].push_back(a);
    };
    for (const ScalpFace& face : mesh_.faces)
      for (int i = 0; i < face.corners(); ++i)
        for (int j = 0; j < i; ++j) couple(face.corner[index(i)], face.corner[index(j)]);
    for (const ScalpPass& pass : passes_) couple(pass.before, pass.after);
    for (std::vector<std::int32_t>& others : beside) {
      std::sort(others.begin(), others.end());
      others.erase(std::unique(others.begin(), others.end()), others.end());
    }
    return ColumnOrder(beside);
  }
  std::vector<ScalpPass> passes() const {
    std::vector<double> scalp;
    for (std::int32_t c = 0; c < mesh_.columns; ++c)
      for (const double x : at(mesh_.vertex(c, 0))) scalp.push_back(x);
    return scalp_passes(mesh_, scalp);
  }

  template <class E>
  static MeshArray<E> array(const std::vector<E>& values) {
    return {values.data(), static_cast<std::int32_t>(values.size())};
  }
  static std::size_t index(std::int32_t i) { return static_cast<std::size_t>(i); }
  RestPoint at(std::int32_t v) const {
    return {rest_[index(3 * v)], rest_[index(3 * v + 1)], rest_[index(3 * v + 2)]};
  }
  // Elements between roots alone have nothing to move.
  bool moves(std::initializer_list<std::int32_t> vertices) const {
    return !parameters_.held_roots ||
           std::any_of(vertices.begin(), vertices.end(), [&](auto v) { return mesh_.layer_of(v) > 0; });
  }
  double signed_volume(const std::int32_t (&v)[4]) const {
    return dot(at(v[1]) - at(v[0]), cross(at(v[2]) - at(v[0]), at(v[3]) - at(v[0]))) / 6;
  }

  // A triangular prism's corners hold a third of it each, a quad's a sixth: exactly for parallelepipeds, and
  // so near for others that shares of the mass and stiffness may be made of it.
  void measure_prisms() {
    prism_volume_.assign(index(mesh_.prisms()), 0);
    for (const CornerTetrahedron& t : tetrahedra_)
      prism_volume_[index(t.prism)] += signed_volume(t.vertex) * (corners_of(t.prism) == 3 ? 0.5 : 0.75);
  }
  int corners_of(std::int32_t prism) const {
    return mesh_.faces[index(prism / (mesh_.layers - 1))].corners();
  }

  void add_masses() {
    std::vector<double> volume(index(mesh_.vertices()), 0);
    double total = 0;
    for (const CornerTetrahedron& t : tetrahedra_) {
      const double share = prism_volume_[index(t.prism)] / (2 * corners_of(t.prism));
      volume[index(t.vertex[0])] += share, total += share;
    }
    const double density = parameters_.total_mass > 0 ? parameters_.total_mass / total : parameters_.density;
    for (const double v : volume) mass_.push_back(static_cast<T>(density * v));
    vertex_volume_ = std::move(volume);
  }

  // The share of the prisms beside it that a quad of the ladder over `edge` stands for.
  double quad_share(const ScalpEdge& edge, std::int32_t layer) const {
    double share = 0;
    for (const std::int32_t f : edge.face)
      if (f >= 0) share += prism_volume_[index(mesh_.prism(f, layer))] / mesh_.faces[index(f)].corners();
    return share;
  }

  void add_spring(std::int32_t a, std::int32_t b, double stiffness) {
    if (!moves({a, b}) || !(stiffness > 0)) return;
    const RestPoint edge = at(b) - at(a);
    const double length = std::sqrt(dot(edge, edge));
    MeshSpring<T> spring{{a, b}, {}, static_cast<T>(stiffness), static_cast<T>(1 / length), {}};
    for (int k = 0; k < 3; ++k) spring.direction[k] = static_cast<T>(edge[index(k)] / length);
    if (pattern_.is_before(b, a)) {
      std::swap(spring.vertex[0], spring.vertex[1]);
      for (T& d : spring.direction) d = -d;
    }
    springs_.push_back(spring);
  }

  // Two triangles for each quad of a ladder, one at the foot of its first column and one at the top of its
  // second: each column's edge is the u axis of one of them.
  void add_extrusion_springs_and_sheets() {
    std::vector<double> share(index(mesh_.vertices()), 0);  // of the edge up from a vertex
    for (const ScalpEdge& edge : mesh_.edges)
      for (std::int32_t l = 0; l + 1 < mesh_.layers; ++l) {
        const double half = quad_share(edge, l) / 2;
        const auto [a, b] = std::pair(edge.end[0], edge.end[1]);
        share[index(mesh_.vertex(a, l))] += half, share[index(mesh_.vertex(b, l))] += half;
        add_sheet(mesh_.vertex(a, l), mesh_.vertex(a, l + 1), mesh_.vertex(b, l), half);
        add_sheet(mesh_.vertex(b, l + 1), mesh_.vertex(b, l), mesh_.vertex(a, l + 1), half);
      }
    for (std::int32_t c = 0; c < mesh_.columns; ++c)
      for (std::int32_t l = 0; l + 1 < mesh_.layers; ++l) {
        const RestPoint up = at(mesh_.vertex(c, l + 1)) - at(mesh_.vertex(c, l));
        mean_length_ += std::sqrt(dot(up, up)) / (mesh_.columns * (mesh_.layers - 1));
        add_spring(mesh_.vertex(c, l), mesh_.vertex(c, l + 1),
                   parameters_.stretch * share[index(mesh_.vertex(c, l))]);
      }
    extrusion_springs_ = static_cast<std::int32_t>(springs_.size());
  }

  // u from `corner` to `along`; v square to it, towards `across`.
  void add_sheet(std::int32_t corner, std::int32_t along, std::int32_t across, double share) {
    if (!(parameters_.stretch_across + parameters_.shear > 0)) return;
    const RestPoint up = at(along) - at(corner), side = at(across) - at(corner);
    const double du = std::sqrt(dot(up, up)), lean = dot(up, side) / du;
    const double dv = std::sqrt(dot(side, side) - lean * lean);
    MeshSheet<T> sheet{};
    std::array<std::int32_t, 3> vertices{corner, along, across}, order{0, 1, 2};
    std::sort(order.begin(), order.end(),
              [&](int i, int j) { return pattern_.is_before(vertices[index(i)], vertices[index(j)]); });
    const double u[] = {-1 / du, 1 / du, 0};
    const double v[] = {(lean / du - 1) / dv, -lean / (du * dv), 1 / dv};
    for (int i = 0; i < 3; ++i) {
      sheet.vertex[i] = vertices[index(order[index(i)])];
      sheet.u[i] = static_cast<T>(u[order[index(i)]]), sheet.v[i] = static_cast<T>(v[order[index(i)]]);
    }
    sheet.across = static_cast<T>(parameters_.stretch_across * share);
    sheet.shear = static_cast<T>(parameters_.shear * share);
    for (std::size_t k = 0; k < 3; ++k)
      sheet.direction[k] = static_cast<T>((side[k] - lean / du * up[k]) / dv);
    sheets_.push_back(sheet);
  }

  void add_horizontal_springs() {
    for (const ScalpEdge& edge : mesh_.edges)
      for (std::int32_t l = 0; l < mesh_.layers; ++l) {
        double share = 0;
        for (const std::int32_t f : edge.face)
          if (f >= 0) share += beside_layer(f, l) / (2 * mesh_.faces[index(f)].corners());
        add_spring(mesh_.vertex(edge.end[0], l), mesh_.vertex(edge.end[1], l),
                   parameters_.horizontal * share);
      }
    for (std::size_t f = 0; f < mesh_.faces.size(); ++f) {
      if (mesh_.faces[f].corners() != 4) continue;
      const auto& corner = mesh_.faces[f].corner;
      for (std::int32_t l = 0; l < mesh_.layers; ++l)
        for (const std::size_t k : {0, 1})
          add_spring(mesh_.vertex(corner[k], l), mesh_.vertex(corner[k + 2], l),
                     parameters_.horizontal * beside_layer(static_cast<std::int32_t>(f), l) / 4);
    }
  }
  // Volume of the prisms of a face under and over a layer.
  double beside_layer(std::int32_t face, std::int32_t layer) const {
    return (layer > 0 ? prism_volume_[index(mesh_.prism(face, layer - 1))] : 0) +
           (layer + 1 < mesh_.layers ? prism_volume_[index(mesh_.prism(face, layer))] : 0);
  }

  // Columns bend against the edges of each ladder that they are part of; layers along their passes, against
  // the extrusion's edge there.
  void add_bends() {
    if (parameters_.bend > 0)
      for (const ScalpEdge& edge : mesh_.edges)
        for (std::int32_t l = 1; l + 1 < mesh_.layers; ++l) {
          const double share = (quad_share(edge, l - 1) + quad_share(edge, l)) / 4;
          for (int k = 0; k < 2; ++k) {
            const std::int32_t here = edge.end[k], beside = edge.end[1 - k];
            add_bend(mesh_.vertex(here, l - 1), mesh_.vertex(here, l), mesh_.vertex(here, l + 1),
                     mesh_.vertex(beside, l), parameters_.bend * share);
          }
        }
    if (!(parameters_.bend_across > 0)) return;
    for (const ScalpPass& pass : passes_)
      for (std::int32_t l = parameters_.held_roots ? 1 : 0; l < mesh_.layers; ++l) {
        const std::int32_t centre = mesh_.vertex(pass.centre, l);
        add_bend(mesh_.vertex(pass.before, l), centre, mesh_.vertex(pass.after, l),
                 l > 0 ? centre - 1 : centre + 1,
                 parameters_.bend_across * vertex_volume_[index(centre)] / 2);
      }
  }

  void add_bend(std::int32_t before, std::int32_t centre, std::int32_t after, std::int32_t beside,
                double stiffness) {
    const RestPoint p = at(before) - at(centre), q = at(after) - at(centre), t = at(beside) - at(centre);
    const RestPoint n = cross(p, t);
    const double pp = dot(p, p), pt = dot(p, t), tt = dot(t, t), square = dot(n, n);
    if (!(square > 1e-6 * pp * tt)) return;  // the edge beside tells no direction across
    const double turn = dot(q, n) / square;
    const double a = -(dot(q, p) * tt - dot(q, t) * pt) / square,
                 b = (dot(q, t) * pp - dot(q, p) * pt) / square;
    const std::int32_t vertices[] = {before, centre, after, beside};
    const double own[] = {a, b - a - 1, 1, -b}, first[] = {1, -1, 0, 0}, second[] = {0, -1, 0, 1};
    std::array<int, 4> order{0, 1, 2, 3};
    std::sort(order.begin(), order.end(),
              [&](int i, int j) { return pattern_.is_before(vertices[i], vertices[j]); });
    MeshBend<T> bend{};
    for (int i = 0; i < 4; ++i) {
      const int from = order[index(i)];
      bend.vertex[i] = vertices[from];
      bend.own[i] = static_cast<T>(own[from]);
      bend.before[i] = static_cast<T>(first[from]), bend.beside[i] = static_cast<T>(second[from]);
    }
    bend.turn = static_cast<T>(turn);
    // C is the angle times |q|; over their mean length it is the curvature, of edges however unlike. As the
    // frame of p and t degenerates, its coefficients grow as the sine of their angle falls; an edge under a
    // quarter of the other tells as little of a direction.
    const double qq = dot(q, q), mean = (std::sqrt(pp) + std::sqrt(qq)) / 2, sine2 = square / (pp * tt),
                 unlike = std::min(1.0, 16 * std::min(pp, qq) / std::max(pp, qq));
    bend.stiffness = static_cast<T>(unlike * sine2 * stiffness / (qq * mean * mean));
    bends_.push_back(bend);
  }

  void add_volumes() {
    if (!(parameters_.volume > 0)) return;
    for (const CornerTetrahedron& t : tetrahedra_) {
      const int corners = corners_of(t.prism);
      const double prism = prism_volume_[index(t.prism)], mean = prism / (corners == 3 ? 3 : 6);
      MeshVolume<T> volume{};
      std::copy(std::begin(t.vertex), std::end(t.vertex), volume.vertex);
      int swaps = 0;  // sorted by insertion, to know whether that turns it over
      for (int i = 1; i < 4; ++i)
        for (int j = i; j > 0 && pattern_.is_before(volume.vertex[j], volume.vertex[j - 1]); --j, ++swaps)
          std::swap(volume.vertex[j], volume.vertex[j - 1]);
      volume.scale = static_cast<T>((swaps % 2 == 0 ? 1 : -1) / (6 * mean));
      volume.rest = static_cast<T>(signed_volume(t.vertex) / mean);
      volume.stiffness = static_cast<T>(parameters_.volume * prism / (2 * corners));
      volumes_.push_back(volume);
    }
  }

  // Of outer faces and their edges, where no root is part of them: those lie on the scalp.
  void add_samples() {
    std::vector<std::pair<std::int32_t, std::int32_t>> edges;
    for (const SurfaceFace& face : mesh_.surface_faces()) {
      const int corners = face.vertex[3] < 0 ? 3 : 4;
      bool rooted = false;
      for (int k = 0; k < corners; ++k) {
        const auto [a, b] = std::minmax(face.vertex[k], face.vertex[(k + 1) % corners]);
        if (mesh_.layer_of(a) > 0 && mesh_.layer_of(b) > 0) edges.emplace_back(a, b);
        rooted = rooted || mesh_.layer_of(face.vertex[k]) == 0;
      }
      if (!rooted) add_sample({face.vertex[0], face.vertex[1], face.vertex[2], face.vertex[3]});
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (const auto& [a, b] : edges) add_sample({a, b, -1, -1});
  }
  void add_sample(const std::array<std::int32_t, 4>& vertices) {
    MeshSample<T> sample{};
    double longest = 0;
    std::copy(vertices.begin(), vertices.end(), sample.vertex);
    for (const std::int32_t v : vertices)
      if (v >= 0) {
        const RestPoint across = at(v) - at(vertices[0]);
        longest = std::max(longest, std::sqrt(dot(across, across)));
      }
    sample.span = static_cast<T>(longest);
    samples_.push_back(sample);
  }

  template <class E>
  void couple(const std::vector<E>& elements) {
    for (const E& element : elements) pattern_.couple(element.vertex);
  }
  template <class E>
  void place(std::vector<E>& elements) {
    constexpr int kVertices = sizeof(E::vertex) / sizeof(std::int32_t);
    for (E& element : elements) {
      std::int32_t* slot = element.slot;
      for (int i = 0; i < kVertices; ++i) *slot++ = pattern_.slot(element.vertex[i], element.vertex[i]);
      for (int i = 0; i < kVertices; ++i)
        for (int j = i + 1; j < kVertices; ++j) *slot++ = pattern_.slot(element.vertex[i], element.vertex[j]);
    }
  }
  void place_blocks() {
    couple(springs_), couple(sheets_), couple(bends_), couple(volumes_);
    pattern_.finish();
    place(springs_), place(sheets_), place(bends_), place(volumes_);
  }

  void join_neighbours() {
    std::vector<std::vector<std::int32_t>> later(index(mesh_.columns));
    degree_.assign(index(mesh_.columns), 0);
    for (const ScalpEdge& edge : mesh_.edges) {
      const bool turned = pattern_.order().is_before(edge.end[1], edge.end[0]);
      later[index(edge.end[turned])].push_back(edge.end[!turned]);
      for (const std::int32_t end : edge.end) ++degree_[index(end)];
    }
    first_neighbour_.assign(1, 0);
    for (std::vector<std::int32_t>& row : later) {
      std::sort(row.begin(), row.end());
      neighbour_.insert(neighbour_.end(), row.begin(), row.end());
      first_neighbour_.push_back(static_cast<std::int32_t>(neighbour_.size()));
    }
  }

  const HairMeshTopology mesh_;
  const std::vector<double> rest_;
  const HairMeshParameters parameters_;
  const std::vector<ScalpPass> passes_;
  std::vector<CornerTetrahedron> tetrahedra_;
  double mean_length_ = 0;                            // of the extrusion's edges [m]
  std::vector<double> prism_volume_, vertex_volume_;  // [m^3]
  std::vector<T> mass_, rounded_rest_;
  std::vector<MeshSpring<T>> springs_;
  std::int32_t extrusion_springs_ = 0;
  std::vector<MeshSheet<T>> sheets_;
  std::vector<MeshBend<T>> bends_;
  std::vector<MeshVolume<T>> volumes_;
  std::vector<MeshSample<T>> samples_;
  PatternBuilder pattern_;
  std::vector<std::int32_t> degree_, first_neighbour_, neighbour_, external_, surface_;
};

}  // namespace ringlet::kernels
