// A hair mesh as vertices, edges, sheets and prisms: a scalp of triangles and quads extruded through layers.
//
// Vertices are numbered column after column: column c is the scalp vertex c extruded, layer 0 its root, and
// vertex c * layers + l lies on layer l. A vertex's neighbours above and below are then its neighbours in
// memory, and those beside it are a few short runs, which is what the products with the matrix read.
//
// Plain code of the host, compiled for no instruction set: the solvers get views of what it makes.
#pragma once
#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace ringlet::kernels {

// A face of the scalp, counter-clockwise seen from outside; the fourth corner of a triangle is -1.
struct ScalpFace {
  std::array<std::int32_t, 4> corner;

  int corners() const { return corner[3] < 0 ? 3 : 4; }
};

// An edge of the scalp and the faces that it belongs to, the second -1 on the rim.
struct ScalpEdge {
  std::int32_t end[2];
  std::int32_t face[2];
};

// Two edges of the scalp that go on in one another through `centre`, as the threads of a cloth do.
struct ScalpPass {
  std::int32_t before, centre, after;
};

// A tetrahedron at a corner of a prism: that corner and the other ends of the prism's three edges there, so
// ordered that the signed volume of a prism that is not inverted is positive.
struct CornerTetrahedron {
  std::int32_t prism;
  std::int32_t vertex[4];
};

// A face of the outer surface, counter-clockwise seen from outside; the fourth vertex of a triangle is -1.
struct SurfaceFace {
  std::int32_t vertex[4];
};

struct HairMeshTopology {
  std::int32_t columns = 0;  // scalp vertices
  std::int32_t layers = 0;   // with the roots' layer, at least 2
  std::vector<ScalpFace> faces;
  std::vector<ScalpEdge> edges;  // of the scalp, each once, end[0] < end[1]

  std::int32_t vertices() const { return columns * layers; }
  std::int32_t vertex(std::int32_t column, std::int32_t layer) const { return column * layers + layer; }
  std::int32_t layer_of(std::int32_t vertex) const { return vertex % layers; }
  // Prism (face, l) lies between layers l and l + 1.
  std::int32_t prisms() const { return static_cast<std::int32_t>(faces.size()) * (layers - 1); }
  std::int32_t prism(std::int32_t face, std::int32_t layer) const { return face * (layers - 1) + layer; }

  // Every edge of the mesh once: the extrusion's, then the horizontal ones of every layer.
  std::vector<std::array<std::int32_t, 2>> mesh_edges() const {
    std::vector<std::array<std::int32_t, 2>> all;
    for (std::int32_t c = 0; c < columns; ++c)
      for (std::int32_t l = 0; l + 1 < layers; ++l) all.push_back({vertex(c, l), vertex(c, l + 1)});
    for (const ScalpEdge& edge : edges)
      for (std::int32_t l = 0; l < layers; ++l)
        all.push_back({vertex(edge.end[0], l), vertex(edge.end[1], l)});
    return all;
  }

  // 8 for each prism over a quad, 6 over a triangle; they overlap, and treat every corner alike (hair mesh
  // paper, Fig. 3).
  std::vector<CornerTetrahedron> corner_tetrahedra() const {
    std::vector<CornerTetrahedron> all;
    for (std::size_t f = 0; f < faces.size(); ++f) {
      const int corners = faces[f].corners();
      for (std::int32_t l = 0; l + 1 < layers; ++l)
        for (int k = 0; k < corners; ++k) {
          const std::int32_t here = faces[f].corner[k], next = faces[f].corner[(k + 1) % corners],
                             last = faces[f].corner[(k + corners - 1) % corners];
          const std::int32_t p = prism(static_cast<std::int32_t>(f), l);
          all.push_back({p, {vertex(here, l), vertex(next, l), vertex(last, l), vertex(here, l + 1)}});
          all.push_back(
              {p, {vertex(here, l + 1), vertex(last, l + 1), vertex(next, l + 1), vertex(here, l)}});
        }
    }
    return all;
  }

  // The boundary of the volume: the outermost layer, the roots' layer, and the ladders over the scalp's rim.
  std::vector<SurfaceFace> surface_faces() const {
    std::vector<SurfaceFace> all;
    for (const ScalpFace& face : faces) {
      SurfaceFace outer{{-1, -1, -1, -1}}, inner = outer;
      for (int k = 0; k < face.corners(); ++k) {
        outer.vertex[k] = vertex(face.corner[k], layers - 1);
        inner.vertex[k] = vertex(face.corner[face.corners() - 1 - k], 0);
      }
      all.push_back(outer), all.push_back(inner);
    }
    for (const ScalpEdge& edge : edges) {
      if (edge.face[1] >= 0) continue;
      const auto [a, b] = along_face(edge);
      for (std::int32_t l = 0; l + 1 < layers; ++l)
        all.push_back({{vertex(a, l), vertex(b, l), vertex(b, l + 1), vertex(a, l + 1)}});
    }
    return all;
  }

  // Vertices on the outer surface that are not roots, ascending: those that collide.
  std::vector<std::int32_t> external_vertices() const {
    std::vector<char> external(static_cast<std::size_t>(vertices()), 0);
    for (const SurfaceFace& face : surface_faces())
      for (const std::int32_t v : face.vertex)
        if (v >= 0 && layer_of(v) > 0) external[static_cast<std::size_t>(v)] = 1;
    std::vector<std::int32_t> all;
    for (std::int32_t v = 0; v < vertices(); ++v)
      if (external[static_cast<std::size_t>(v)]) all.push_back(v);
    return all;
  }

 private:
  // The edge's ends in the order in which its first face passes them.
  std::pair<std::int32_t, std::int32_t> along_face(const ScalpEdge& edge) const {
    const ScalpFace& face = faces[static_cast<std::size_t>(edge.face[0])];
    for (int k = 0; k < face.corners(); ++k)
      if (face.corner[k] == edge.end[0] && face.corner[(k + 1) % face.corners()] == edge.end[1])
        return {edge.end[0], edge.end[1]};
    return {edge.end[1], edge.end[0]};
  }
};

// `faces` of a manifold scalp of `columns` vertices, all of them used, with edges of at most two faces.
inline HairMeshTopology make_hair_mesh_topology(std::vector<ScalpFace> faces, std::int32_t columns,
                                                std::int32_t layers) {
  HairMeshTopology mesh;
  mesh.columns = columns, mesh.layers = layers, mesh.faces = std::move(faces);
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> known;
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    const ScalpFace& face = mesh.faces[f];
    for (int k = 0; k < face.corners(); ++k) {
      const auto [a, b] = std::minmax(face.corner[k], face.corner[(k + 1) % face.corners()]);
      const auto [found, added] = known.try_emplace({a, b}, mesh.edges.size());
      if (added)
        mesh.edges.push_back({{a, b}, {static_cast<std::int32_t>(f), -1}});
      else
        mesh.edges[found->second].face[1] = static_cast<std::int32_t>(f);
    }
  }
  return mesh;
}

// The passes of the scalp: at each vertex, pairs of edges that share no face and turn least into one another,
// straightest first, each edge in one pair at most. `scalp` holds three coordinates a column.
inline std::vector<ScalpPass> scalp_passes(const HairMeshTopology& mesh, const std::vector<double>& scalp) {
  struct Candidate {
    double cosine;  // of the angle between the edges: -1 goes straight on
    std::size_t one, other;
  };
  const auto share_face = [](const ScalpEdge& a, const ScalpEdge& b) {
    for (const std::int32_t f : a.face)
      if (f >= 0 && (f == b.face[0] || f == b.face[1])) return true;
    return false;
  };
  const auto other_end = [&](std::size_t edge, std::int32_t centre) {
    const ScalpEdge& e = mesh.edges[edge];
    return e.end[0] == centre ? e.end[1] : e.end[0];
  };
  const auto along = [&](std::size_t edge, std::int32_t centre, double(&to)[3]) {
    double square = 0;
    for (int k = 0; k < 3; ++k) {
      to[k] = scalp[3 * other_end(edge, centre) + k] - scalp[3 * centre + k];
      square += to[k] * to[k];
    }
    return square;
  };
  std::vector<std::vector<std::size_t>> at(static_cast<std::size_t>(mesh.columns));
  for (std::size_t e = 0; e < mesh.edges.size(); ++e)
    for (const std::int32_t end : mesh.edges[e].end) at[static_cast<std::size_t>(end)].push_back(e);
  std::vector<ScalpPass> passes;
  for (std::int32_t c = 0; c < mesh.columns; ++c) {
    std::vector<Candidate> candidates;
    const std::vector<std::size_t>& edges = at[static_cast<std::size_t>(c)];
    for (std::size_t i = 0; i < edges.size(); ++i)
      for (std::size_t j = i + 1; j < edges.size(); ++j) {
        if (share_face(mesh.edges[edges[i]], mesh.edges[edges[j]])) continue;
        double a[3], b[3];
        const double squares = along(edges[i], c, a) * along(edges[j], c, b);
        const double product = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        if (product < 0) candidates.push_back({-product * product / squares, edges[i], edges[j]});
      }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.cosine < b.cosine; });
    std::vector<std::size_t> taken;
    const auto is_taken = [&](std::size_t e) { return std::count(taken.begin(), taken.end(), e) > 0; };
    for (const Candidate& candidate : candidates) {
      if (is_taken(candidate.one) || is_taken(candidate.other)) continue;
      taken.push_back(candidate.one), taken.push_back(candidate.other);
      passes.push_back({other_end(candidate.one, c), c, other_end(candidate.other, c)});
    }
  }
  return passes;
}

}  // namespace ringlet::kernels
