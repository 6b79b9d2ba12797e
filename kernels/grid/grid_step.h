// What the hair's grid is told, what it tells, and its memory as the kernels see it.
//
// Hair is a fluid of the lattice's cells in axes that move with the head (AMS paper 3.2; McAdams et al. 2009;
// physics.md section 5). Lengths in those axes are in cells. Segments are sampled along their length, at
// least once a cell. A sample carries hair length, by which density counts, and a share of the masses of its
// two particles, by which momentum counts: particles have unit mass, and the samples' shares of one add up to
// it.
//
//   density   lambda = sum of w(x) l        [cell edges of hair in a cell]: lambda strands cross it
//   target    lambda_t = sum of w l lambda_0 / lambda, lambda_0 the greatest density that the sample had
//             about it at rest, wherever the lattice lay, and no less than kLeastStrands: hair at rest is
//             nowhere over its target, however it is carried through the grid, and cells with hardly a
//             strand are no continuum
//   velocity  on the cells' faces, u_f = sum of w m u / m_f, relative to the moving axes
//
// with w the trilinear weights of a staggered lattice. A node holds the values of one cell and of the faces
// below it on each axis.
#pragma once
#include "kernels/grid/lattice.h"
#include "kernels/solid/solid_view.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {

inline constexpr double kLeastStrands = 4;  // in a cell
// A cell is fluid where its density is above this share of its target; elsewhere is air, of no pressure.
inline constexpr double kFluidShare = 0.4;
// A face weighs at least this share of the face across the cell: pressure must not act on nothing.
inline constexpr double kLeastFaceShare = 0.02;
// Density is corrected by moving hair apart where it is above its target by this share; the correction of one
// step is at most this divergence.
inline constexpr double kOverDense = 0.01, kMostCorrection = 0.5;

// The grid's axes: world x = rotation g cell + origin for a place g [cells].
struct GridAxes {
  double rotation[9], origin[3];  // row-major, [m]
  // Velocity of what moves with the axes: slope (x - origin) + velocity [1/s], [m/s].
  double slope[9], velocity[3];
  double cell;  // edge of a cell [m]
};

template <class T>
struct GridStep {
  StrandBatches<T> batches;
  StrandState<T> state;
  const double* root_points;  // [batches][3] [m]
  GridAxes axes;
  double interval;  // between runs of the grid [s]
  double substep;   // that the solids move over [s]
  T pic;            // share of PIC in what strands are given back
  double residual;  // relative, of the pressure
  std::int32_t most_iterations;
  std::int32_t passes;   // over positions, until none is too dense
  std::int32_t clamped;  // prescribed particles at each root
  const SolidView* solids;
  std::int32_t solid_count;
  std::int32_t frame;  // stepped to: a deforming solid's level sets are the same throughout it
};

// The wind that gets through the hair (hair_shelter.h).
template <class T>
struct HairShelter {
  double wind[3];   // its direction in the world, of any length [m/s]
  double strength;  // [-]
  double radius;    // mean of the hair's [m]
  T* share;         // [rows] out: of the wind, at the segment that begins there
};

struct GridFigures {
  double iterations = 0;  // of conjugate gradients
  double residual = 0;    // relative, largest of the solves
  double solves = 0;
  double density = 0;  // largest over its target, before this step's correction
  double cells = 0;    // fluid
  bool moved = false;  // positions were corrected
};

inline namespace RINGLET_ISA {

// Values of a node: density and its target, then mass and velocity of each axis's face. First they are sums,
// of density, density times target, mass and momentum; last, for the way back, the changes of velocity and
// place.
inline constexpr int kNodeValues = 8;
inline constexpr int kDensity = 0, kTarget = 1, kFaceMass = 2;  // + 2 axis; the velocity follows

// Sums on nodes are of integers, so that no order of strands shows in them.
template <class T>
struct FixedPoint;
template <>
struct FixedPoint<float> {
  using Integer = std::int32_t;
  static constexpr double kRange = 2147483648.0;
};
template <>
struct FixedPoint<double> {
  using Integer = std::int64_t;
  static constexpr double kRange = 4503599627370496.0;  // what a double holds of integers
};
template <class T>
using Fixed = typename FixedPoint<T>::Integer;

// A segment's way through one tile.
struct Piece {
  std::int32_t segment, number;  // its first particle; of the piece, in the order of segments
  std::int32_t first, end;       // samples
  std::int32_t samples;          // of the whole segment
  std::int32_t rest;             // its first sample among all
  std::int32_t ends;             // kFirstOfStrand of its first particle, kLastOfStrand of its second
  std::uint32_t reached;  // which of the tiles about the tile its samples lie nearest to, a bit for each
};

// Of a strand's particles in the grid's axes, from their origin: the lowest and highest coordinates [cells],
// and the largest component of their velocities [m/s].
template <class T>
struct StrandReach {
  T low[3], high[3], speed;
};

inline constexpr unsigned char kFirstOfStrand = 1, kLastOfStrand = 2;

// The grid's memory. Particles are numbered strand after strand, in the batches' order.
template <class T>
struct GridData {
  GridStep<T> step;
  // Strands
  std::int32_t lanes;                  // batches * kLanes
  const std::int32_t* first_particle;  // [lanes + 1]
  std::int32_t particles;
  const unsigned char* ends;         // [particles] kFirstOfStrand, kLastOfStrand
  const std::int32_t* first_sample;  // [particles + 1] of the segment that begins there
  T* rest_density;                   // [samples] lambda_0
  T* particle;  // [particles][8] place [cells], then velocity relative to the axes [m/s] in 3, 5 and 7
  StrandReach<T>* reach;  // [lanes]
  // Pieces, in the order of segments, and by tile
  const std::int32_t* first_piece;  // [particles + 1]
  Piece* piece;                     // [pieces]
  std::int32_t pieces;
  std::uint64_t* piece_key;  // [pieces] its tile's; sorted once there are tiles
  Piece* tile_pieces;        // [pieces] sorted by tile: what is read one after the other lies so
  std::uint32_t* piece_of;   // [pieces] sorted by tile
  bool moved;                // positions are corrected: pieces give them back too
  T* given_back;             // [pieces][moved ? 2 : 1][8] what pieces give back (given_back_by)
  // Tiles, sorted by key
  std::int32_t low[3];     // tile coordinates of key 0
  std::int32_t extent[3];  // tiles along each axis
  std::int32_t tiles;
  const std::uint64_t* tile_key;      // [tiles]
  std::int32_t* near;                 // [tiles][kAround] tiles about it, x fastest, -1: none
  std::int32_t occupied;              // tiles with pieces
  const std::int32_t* occupied_tile;  // [occupied] which of the tiles
  const std::int32_t* tile_piece;     // [occupied + 1] first of its pieces
  std::uint64_t* rows;                // [occupied] of the halo along x that samples reach, a bit for each
  T* node;                            // [tiles][kTileCells][kNodeValues]; the sums first, as Fixed<T>
  T* lightness;                       // [tiles][kTileCells][3] 1 / mass of the faces, 0: none to move
  alignas(64) T scale[kNodeValues];   // of the sums
  // Walls
  std::int32_t* wall;  // [tiles][kTileParts] where a part's walls are, -1: no solid near
  T* opening;          // [walls][kPartCells][6] open share of each face, velocity of the solid there
  // Fluid cells, sorted by key
  std::uint64_t* fluid;      // [tiles] a bit for each fluid cell
  std::int32_t* first_cell;  // [tiles + 1]
  std::int32_t cells;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
