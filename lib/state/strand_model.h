// The strands of a run, in the solver's precision T: what they are made of (Model), which only grooming
// edits, between frames, and what the solver moves (State).
#pragma once
#include <tbb/cache_aligned_allocator.h>

#include <optional>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "state/strand_layout.h"

namespace ringlet::state {

template <class T>
using AlignedVector = std::vector<T, tbb::cache_aligned_allocator<T>>;

// What a model is made of, strand after strand in file order.
struct StrandInput {
  std::vector<std::int32_t> counts;  // [strands] particles there is room for
  std::vector<std::int32_t>
      living;                    // [strands] particles there are, at least 1; empty: as many as there is room
  std::vector<Vec3> rest;        // [particles] rest shape, world axes at rest [m]
  std::vector<float> stiffness;  // [particles * kCouplings] [1/s^2], empty: uniform
  std::vector<Mat3> first_rotation;  // [strands] root rotation at the first frame; for the preload
  std::optional<Vec3> preload;       // gravity to preload against [m/s^2]; empty: no preload
  std::vector<float> radius;         // [particles] of the hair [m]; empty: nothing asks
  bool companions = false;           // the mass-spring model's
  bool elongation = false;           // the strands' lengths are asked for (kernels::Elongation)
};

template <class T>
struct StrandModel {
  StrandLayout layout;
  AlignedVector<T> count, rest, rest_length, stiffness, preload;
  AlignedVector<T> rest_companion, per_length;  // [rows][3], [batches]; or empty
  // [rows] of the hair at each particle [m], or empty. By particle, as the cache's widths and `stiffness`:
  // where grooming cuts and lengthens, hair that grows again is as thick there as it was.
  AlignedVector<T> radius;

  explicit StrandModel(const StrandInput& input);
  kernels::StrandBatches<T> view() const;
  std::size_t bytes() const;

  // A strand's particles; what it has room for beyond them is inert.
  int living(std::size_t strand) const { return static_cast<int>(count[layout.at_strand(strand, 1, 0)]); }
  // A strand's rest shape, relative to its root in the rest pose's axes [m].
  std::vector<Vec3> shape(std::size_t strand) const;
  // Gives a strand this rest shape, relative to its root in the rest pose's axes [m].
  void set_shape(std::size_t strand, std::span<const Vec3> shape);
  void set_preload(std::size_t strand, const Vec3& gravity, const Mat3& rotation);
};

template <class T>
struct StrandState {
  AlignedVector<T> position, velocity;  // [rows][3]
  AlignedVector<T> root_motion;         // [batches][kRootValues]
  AlignedVector<double> root_points;    // [batches][3] at the substep's end [m]
  // Empty, unless an effect that has them is there; it makes them.
  AlignedVector<T> elongation;  // [rows] kernels::Elongation::memory
  AlignedVector<T> air;         // [rows][3] kernels::Air::velocity [m/s]
  AlignedVector<T> shelter;  // [rows] share of the wind that hair before it lets through to the segment that
                             // begins there, when last looked at; 1 before that
  AlignedVector<T> companion_position, companion_velocity;  // [rows][3] kernels::StrandState
  AlignedVector<T> touches;  // [rows][kTouchReals] where solids pressed last (kernels/solid/touch.h); empty
                             // where nothing asks
  Vec3 wind = Vec3::Zero();  // the mean wind now [m/s]; zero without such an effect

  explicit StrandState(const StrandModel<T>& model);
  kernels::StrandState<T> view();
  std::size_t bytes() const;
};

// Writes the motion of one strand's root frame over a substep.
template <class T>
void set_root_motion(StrandState<T>& state, const StrandLayout& layout, std::size_t strand,
                     const Pose& before, const Pose& after);

// The companions of a strand's segments at rest (kernels/strand/mass_spring_step.h), relative to its root:
// half a segment's length off its middle, a quarter of a turn about the hair from segment to segment. [m]
std::vector<Vec3> rest_companions(std::span<const Vec3> rest);

// The rest shape carried to these root poses, at rest: positions relative to the root, no velocity.
template <class T>
void pose_at_rest(StrandState<T>& state, const StrandModel<T>& model, std::span<const Pose> roots);

}  // namespace ringlet::state
