// What a hair mesh is made of, as the solver reads it: plain elements, each with the places of its blocks in
// the matrix, and the parameters that they are made with.
//
// Every element has an energy (k/2) C^T C of conditions C that vanish at rest (Baraff and Witkin 1998). Each
// k is a modulus times the element's share of the volume at rest, and densities are per volume too: a mesh of
// twice the resolution is as stiff and as heavy.
#pragma once
#include <cstdint>

namespace ringlet::kernels {

struct HairMeshParameters {
  double density = 100;            // of hair and the air in it, at rest [kg/m^3]
  double total_mass = 0;           // [kg]; above 0 it replaces the density
  double stretch = 2e4;            // along the extrusion [Pa]
  double stretch_across = 300;     // of the extrusion's sheets across it [Pa]
  double shear = 500;              // of the sheets [Pa]
  double horizontal = 500;         // of horizontal edges, and of the diagonals of quads [Pa]
  double bend = 0.05;              // of columns [Pa m^2]
  double bend_across = 0.02;       // of the layers' surfaces [Pa m^2]
  double volume = 300;             // of the corner tetrahedra, relative to the rest volume [Pa]
  double damping = 0.005;          // of each condition's rate, relative to its stiffness [s]
  double drag = 0.5;               // of the air, per mass [1/s]
  bool held_roots = true;          // false: nothing holds the mesh
  double tolerance = 1e-4;         // relative residual of the solves
  std::int32_t iterations = 1000;  // at most, a solve
};

// What a solve took.
struct SolveFigures {
  std::int32_t iterations = 0;
  // Of r = S (b - A x), the root of r . D^-1 r over the same at the start, where x is as prescribed; D holds
  // the matrix' blocks in each column of the mesh. Where friction stops vertices the start stays the first.
  double residual = 0;
};

// C = |x1 - x0| / length - 1
template <class T>
struct MeshSpring {
  std::int32_t vertex[2];
  std::int32_t slot[3];  // of blocks (0, 0), (1, 1), (0, 1)
  T stiffness;           // [J]
  T inverse_length;      // [1/m]
  T direction[3];        // at rest, for a spring of no length
};

// A triangle of a sheet with its rest coordinates (u, v), u along the extrusion: with w_u = sum u_i x_i and
// w_v = sum v_i x_i, the derivatives of the position,
//   C = |w_v| - 1 and C = w_u . w_v.
// What Baraff and Witkin ask of w_u is one spring for each edge of the extrusion.
template <class T>
struct MeshSheet {
  std::int32_t vertex[3];
  std::int32_t slot[6];  // of blocks (0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)
  T u[3], v[3];          // [1/m], sums 0
  T across, shear;       // [J]
  T direction[3];        // w_v at rest, for a sheet of no width
};

// Slots of four vertices' blocks: (0, 0) to (3, 3), then (0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3).
inline constexpr int kMeshSlots = 10;

// Where the edge that goes on from a vertex lies, by the edge that led there and one beside it:
//   C = sum own_i x_i - turn (sum before_i x_i) x (sum beside_i x_i)
// With p, q the edges to the vertices before and after and t the one beside, C = q + a p - b t - turn p x t
// with a, b, turn such that C = 0 at rest, whatever the curl there; along a straight line C is the curvature.
// C turns with the mesh, is a polynomial, and so has no place where a collapsed or folded mesh makes it
// undefined, as the angle between two triangles has.
template <class T>
struct MeshBend {
  std::int32_t vertex[4];
  std::int32_t slot[kMeshSlots];
  T own[4], before[4], beside[4];  // [-], sums 0
  T turn;                          // [1/m]
  T stiffness;                     // [J/m^2]
};

// C = scale (x1 - x0) . (x2 - x0) x (x3 - x0) - rest: signed volume less its rest, over a corner's mean share
// of the prism
template <class T>
struct MeshVolume {
  std::int32_t vertex[4];
  std::int32_t slot[kMeshSlots];
  T scale;      // [1/m^3], negative where the vertices' order turns the tetrahedron over
  T rest;       // [-]
  T stiffness;  // [J]
};

template <class E>
struct MeshArray {
  const E* data;
  std::int32_t count;
};

// Blocks lie two by two, those of a pair's columns side by side: reals of both, where the second begins, and
// the distance of a block's columns, which are padded to four reals.
inline constexpr std::int32_t kPairReals = 24, kSecondBlock = 4, kBlockColumn = 8;
// Blocks of a row in its own column of the mesh: with itself, the vertex above and the one above that.
inline constexpr std::int32_t kOwnBlocks = 3;

// Between two columns of the mesh lie bands of blocks, one for each difference of layers: -1, 0, 1, or 0
// alone.
inline constexpr std::int32_t kSlopes = 3;

// Two columns of the mesh; the number of columns stands for none.
struct ColumnPair {
  std::int32_t column[2];
};

// Which blocks the matrix has: rows are vertices, held roots have none. Of the symmetric matrix the upper
// half is there. See BlockMatrix.
struct BlockPattern {
  std::int32_t columns, layers;
  std::int32_t first_layer;     // that is free: 1 where roots are held, else 0
  MeshArray<ColumnPair> pairs;  // of columns that are not coupled, in the order of sweeps
  const std::int32_t* first;    // [pairs][2], and the end: where in `other` those of a pair begin that have
                                // three bands with it, and those that have one
  const ColumnPair* other;      // later columns, one for each column of the pair
  const std::int32_t* first_band;  // [pairs + 1] of each pair's bands
  std::int32_t blocks;             // two by two; the last takes those of held roots, which nobody reads
};

// A place of the outer surface between vertices: the middle of an edge or a face.
template <class T>
struct MeshSample {
  std::int32_t vertex[4];  // that it is the mean of; -1: fewer
  T span;                  // from the first of them to the farthest, at rest [m]
};

// Everything that a solver copies when it is made. Vertices are numbered as by HairMeshTopology.
template <class T>
struct HairMeshView {
  std::int32_t columns, layers;
  const T* rest;                     // [vertices][3] [m]
  const T* mass;                     // [vertices] [kg]
  MeshArray<MeshSpring<T>> springs;  // the extrusion's, then horizontal ones
  std::int32_t extrusion_springs;
  MeshArray<MeshSheet<T>> sheets;
  MeshArray<MeshBend<T>> bends;
  MeshArray<MeshVolume<T>> volumes;
  BlockPattern pattern;
  const std::int32_t* degree;           // [columns] edges of the scalp at a column
  const std::int32_t* first_neighbour;  // [columns + 1]
  const std::int32_t* neighbour;        // later columns that these edges lead to
  MeshArray<std::int32_t> external;     // vertices that collide
  MeshArray<MeshSample<T>> samples;     // so do these
  MeshArray<std::int32_t> surface;      // outer faces, four vertices each, the last -1 for a triangle
  T damping, drag, tolerance;
  T reach;  // a vertex this near a surface that held it is still in contact with it [m]
  std::int32_t iterations;
  bool held_roots;
};

}  // namespace ringlet::kernels
