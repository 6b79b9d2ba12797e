// The contacts of hair against hair as the program calls them, whatever they were compiled for.
#pragma once
#include <cstddef>
#include <cstdint>

#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {

// What an application found.
struct HairContactFigures {
  std::int64_t pairs = 0;      // of segments that passes look at
  std::int64_t contacts = 0;   // those that touched or had crossed in the last pass, before it answered
  std::int64_t crossings = 0;  // those that are through one another, when last counted
  double depth = 0;            // largest overlap of the others [m]
};

// One application, over all that moved since the last.
template <class T>
struct HairContactStep {
  StrandBatches<T> batches;
  const std::int32_t* order;  // [strands] as batch * kLanes + lane, by their roots
  std::int32_t strands;
  StrandState<T> state;             // at the end; changed
  const T* start;                   // [rows][3] positions at the start, as `state` has them
  const double* start_root_points;  // [batches][3] [m]
  const double* root_points;        // [batches][3] at the end
  const T* radius;                  // [rows] of the hair at each particle [m]
  std::int32_t clamped;             // prescribed particles at each root
  T friction;                       // Coulomb mu [-]
  T step;                           // h of the substep that ends [s]
  T* touches;  // [rows][kTouchReals] that solids left in the one before, loads are added; null: none do
};

template <class T>
class HairContacts {
 public:
  virtual ~HairContacts();
  // Keeps what the last application left through one another, by how the strands now are: before they move.
  // Does nothing until the next application when called again.
  virtual void settle(const HairContactStep<T>& step) = 0;
  // Finds the pairs that passes look at.
  virtual HairContactFigures begin(const HairContactStep<T>& step) = 0;
  // One pass, over the state as it now is. Returns how many contacts it found.
  virtual std::int64_t pass(const HairContactStep<T>& step) = 0;
  // Sets the figures' crossings and depth, by the state as it now is and solids will leave it.
  virtual void count_crossings(const HairContactStep<T>& step, HairContactFigures& figures) = 0;
  // What `settle` kept, to go on from there another time: how many numbers, and the numbers. `keep` is for
  // after a `begin` with the same strands; false, and nothing kept, where these are no numbers of theirs.
  virtual std::int32_t kept() const = 0;
  virtual void copy_kept(std::uint64_t* to) const = 0;
  virtual bool keep(const std::uint64_t* kept, std::int32_t count) = 0;
  virtual std::size_t bytes() const = 0;
};

}  // namespace ringlet::kernels
