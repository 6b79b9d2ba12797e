// Strands in memory, and everything a strand step is told. Plain pointers, SI units, all stiffness per unit
// mass.
//
// Strands are sorted by particle count and packed kLanes to a batch. A per-particle array holds, for each row
// (batch.row + particle), its components one after the other, each kLanes wide: unit stride for a lane pack
// on the CPU, coalesced for a thread per strand on the GPU. A strand shorter than its batch ends in inert
// particles: no spring reaches them, they rest at zero.
//
// Positions are relative to the strand's root point (its first particle) at the same time, so that precision
// is that of the strand's own length wherever in the world it is.
#pragma once
#include <cstdint>

namespace ringlet::kernels {

inline constexpr int kLanes = 16;

enum Coupling { kEdge, kBend, kTwist, kIntegrity, kAngular, kCouplings };

// Constant over a frame. Grooming edits count, rest, rest_length, preload and per_length between frames.
template <class T>
struct StrandBatches {
  std::int32_t batches;
  const std::int32_t* row;  // [batches + 1] first row of each batch
  const T* count;           // [batches][kLanes] particles of each strand; 0 for a lane without a strand
  const T* rest;            // [rows][3] rest shape relative to its root, in the rest pose's axes [m]
  const T* rest_length;     // [rows][3] rest distance to the next, second next and third next particle [m]
  const T*
      stiffness;     // [rows][kCouplings] [1/s^2], or null where StrandParameters::stiffness holds everywhere
  const T* preload;  // [batches][3] -g in the strand's root frame at the first frame, or when grooming last
                     // made its present shape the rest shape [m/s^2]; 0: no preload
  const T* rest_companion;  // [rows][3] mass-spring: rest place of the companion of the segment that begins
                            // there, as `rest` [m]; null for AMS
  const T* per_length;  // [batches] 1 / L, L the strand's rest length, 0 for one without [1/m]; or null where
                        // nothing asks
};

template <class T>
struct StrandState {
  T* position;                      // [rows][3] relative to the root point [m]
  T* velocity;                      // [rows][3] in the world [m/s]
  T* companion_position = nullptr;  // [rows][3] mass-spring: as the two above; else null
  T* companion_velocity = nullptr;
};

// Motion of the root frames over one substep, [batches][kRootValues]: rotation at its start (9, row-major;
// from the rest pose's axes to the world's), the rotation's change (9), the root point's displacement (3)
// [m].
inline constexpr int kRootValues = 21;

template <class T>
struct StrandParameters {
  T step;                   // h [s]
  T gravity[3];             // [m/s^2]
  T stiffness[kCouplings];  // [1/s^2]
  T drag;                   // G / m [1/s]
  T damping;                // material damping beta [s]
  T geometric_stiffness;    // 1 on, 0 off
  bool consistent_angular;  // angular tangent kappa l_i / |x_i - x_{i-1}| D, otherwise the papers' kappa D
  bool exact_integrity;     // integrity tangent kappa I, otherwise the papers' kappa D
  std::int32_t clamped;  // prescribed particles at the root: 1 hinged, 2 tangent clamped (0 free, in tests)
  std::int32_t length_iterations;  // Newton iterations of the length projection; 0: none
  T length_tolerance;              // largest edge strain it leaves [-]
  bool lengths_in_step;            // corrected in the metric of the step first; otherwise by masses alone
  std::int32_t skipped_substeps;   // since lengths were last projected: their displacement took all of these
  T strain_limit;                  // beyond either limit the strand counts as diverged
  T speed_limit;                   // [m/s]
};

// Non-Hookean integrity (physics.md section 3): the tension over the elongation e, in units of kappa_I L.
// Hooke's line t = e up to the transition, cubic pieces in e - start after it, nothing from the break on.
inline constexpr int kMostCurvePieces = 16;

template <class T>
struct TensionCurve {
  std::int32_t pieces;
  T transition, breaking;
  T start[kMostCurvePieces];
  T coefficient[kMostCurvePieces][4];  // of the powers 0 to 3
};

template <class T>
struct Elongation {
  T* memory;  // [rows] elongation that the tension is taken at; null: integrity is Hookean
  TensionCurve<T> curve;
  bool permanent;  // memory is the largest elongation so far, not the present one
};

// The air that drags on the segments. Coefficients are over the hair's linear density.
template <class T>
struct Air {
  const T* velocity;  // [rows][3] at the segment that begins there, in the world [m/s]; null: no drag
  T normal[2];        // across the segment: linear [1/s] and quadratic [1/m] coefficient
  T tangential[2];    // along it
};

// Written for each strand and substep, [batches][kFigures].
enum StrandFigure { kStrain, kIterations, kSubdivisions, kSpeed, kDiverged, kFigures };

template <class T>
struct StrandStep {
  StrandBatches<T> batches;
  StrandState<T> state;
  const T* roots;  // [batches][kRootValues]
  StrandParameters<T> parameters;
  T* figures;  // [batches][kFigures]: largest edge strain left [-], Newton iterations, substeps taken,
               // largest speed [m/s], 1 where diverged or not finite
  Elongation<T> elongation{};
  Air<T> air{};
};

}  // namespace ringlet::kernels
