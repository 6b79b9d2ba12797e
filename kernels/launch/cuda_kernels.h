// The kernels on a CUDA device, as the program calls them: plain C++, whether or not nvcc was there to build
// them.
#pragma once
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "kernels/grid/hair_grid.h"
#include "kernels/solid/solid_view.h"
#include "kernels/strand/length_step.h"
#include "kernels/strand/strand_batch.h"
#include "kernels/wind/shelter.h"
#include "kernels/wind/wind_step.h"

namespace ringlet::kernels {

// What the CUDA runtime refused, and during what.
class CudaError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Whether this program holds the CUDA kernels at all.
bool cuda_compiled();

struct CudaDevice {
  std::string name;
  int major, minor;         // compute capability
  std::size_t memory;       // [bytes]
  std::size_t free_memory;  // [bytes] at the time of asking
};

// The device that the kernels would run on: the first that the driver shows (CUDA_VISIBLE_DEVICES chooses).
// Empty where there is none that serves; `why_not`, where given, then says why.
std::optional<CudaDevice> find_cuda_device(std::string* why_not = nullptr);

enum class CudaTiming { kOff, kOn };

// Time spent in the launches of one name, measured on the device.
struct CudaLaunches {
  std::string name;
  std::int64_t count;
  double seconds;
};

struct ContactParameters {
  float step;  // h [s]
  std::int32_t clamped;
  std::int32_t rounds;              // cap on the alternation of length and contact projections
  std::int32_t length_iterations;   // 0: lengths are not projected
  float length_tolerance;           // largest edge strain left [-]
  float strain_limit, speed_limit;  // [-], [m/s]; see ContactStep
  std::int32_t skipped_substeps;
  std::int32_t home;  // see ContactStep
};

// The host's arrays of a state (StrandState). One that the run does without is empty; which ones are there
// never changes.
template <class T>
struct StateArrays {
  std::span<T> position, velocity;
  std::span<T> elongation = {};                                   // [rows] Elongation::memory
  std::span<T> companion_position = {}, companion_velocity = {};  // [rows][3] as StrandState
  std::span<T> shelter = {};                                      // [rows] as WindStep
};

// The strands of a run on the device. Arrays are laid out as on the host (StrandBatches, StrandState,
// ContactStep), and every upload is done with the host's memory when it returns. Steps are queued on one
// stream and run on their own; downloads wait for what was queued before. Any call may throw CudaError, also
// for a step queued earlier. For use by one thread at a time.
class CudaStrands {
 public:
  virtual ~CudaStrands() = default;

  virtual void upload_state(const StateArrays<const float>& state) = 0;
  virtual void download_state(const StateArrays<float>& state) = 0;

  // The root frames' motion over the next substep, [batches][kRootValues], and the root points at its end in
  // the world [batches][3] [m], which only contact_step reads.
  virtual void upload_roots(std::span<const float> motion, std::span<const double> points) = 0;
  // The steps' pointers are the host's: each stands for the device's own array, null for none.
  virtual void strand_step(const StrandStep<float>& step) = 0;
  // Where the air is and how much of it reaches each segment, for the strand steps from here on. The map's
  // pointers are read.
  virtual void wind_step(const WindStep<float>& step) = 0;
  virtual void shelter_step(const ShelterStep<float>& step) = 0;

  // [batches] what each strand grows on, as ContactStep::skin. Until called, none grows on anything.
  virtual void upload_skin(std::span<const std::int32_t> skin) = 0;
  // The solids over the next substep; pointers are the host's. Level sets and surfaces stay on the device:
  // those of a deforming solid are copied again when `interval`, the number of the frame interval that the
  // substep lies in, is another than last time, its vertices every time; those of a rigid one only when its
  // pointers change.
  virtual void upload_solids(std::span<const SolidView> solids, std::int64_t interval) = 0;
  virtual void contact_step(const ContactParameters& parameters) = 0;
  // ContactStep::touches, for the next step: from the first call on it tells them.
  virtual void upload_touches(std::span<const float> touches) = 0;

  virtual void length_step(const LengthStep<float>& step) = 0;  // pointers as strand_step's

  // The grid of hair against hair, as HairGrid's calls: pointers as strand_step's, solids as upload_solids
  // takes them. What gets through of the wind goes to the state's shelter.
  virtual void grid_at_rest(const GridStep<float>& step) = 0;
  virtual GridFigures grid_step(const GridStep<float>& step) = 0;
  virtual void grid_shelter(const HairShelter<float>& shelter) = 0;
  virtual std::size_t grid_bytes() const = 0;  // of what `bytes` counts

  // Of the last step of each kind: [batches][kFigures], [batches][kContactFigures],
  // [batches][kLengthFigures], and ContactStep::touches; an empty span is left out.
  virtual void download_figures(std::span<float> strands, std::span<float> contacts,
                                std::span<float> lengths = {}, std::span<float> touches = {}) = 0;

  virtual void synchronize() = 0;
  virtual std::vector<CudaLaunches> launches() = 0;  // so far, in order of first use; empty without timing
  virtual std::size_t bytes() const = 0;             // device memory held
};

// `model` is the host's and is copied. Throws CudaError where no device serves or its memory does not
// suffice.
std::unique_ptr<CudaStrands> make_cuda_strands(const StrandBatches<float>& model, CudaTiming timing);

}  // namespace ringlet::kernels
