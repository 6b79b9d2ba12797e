// Where the kernels run: on the CPU's threads, or on a CUDA device.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "kernels/solid/solid_view.h"
#include "state/strand_model.h"

namespace ringlet::kernels {
template <class T>
struct ContactStep;
template <class T>
struct WindStep;
template <class T>
struct ShelterStep;
template <class T>
struct LengthStep;
template <class T>
class HairGrid;
template <class T>
class HairContacts;
}  // namespace ringlet::kernels

namespace ringlet::effects {

// Runs kernels over all batches. The state of the model that it was made for lives with the executor while it
// steps: `fetch` brings it back to the host, `submit` takes the host's (on the CPU they are the same and
// neither costs anything); where the roots go is told by `submit_roots`, which holds until the next. The
// pointers in a step are the host's. Throws Error{kDevice}.
template <class T>
class Executor {
 public:
  virtual ~Executor() = default;
  virtual std::string backend() const = 0;          // cpu, cuda
  virtual std::string instruction_set() const = 0;  // avx512, avx2, generic, sm_90, ...
  virtual void submit(const state::StrandState<T>& state) = 0;
  virtual void submit_roots(const state::StrandState<T>& state) = 0;
  virtual void fetch(state::StrandState<T>& state) = 0;
  virtual void strand_step(const kernels::StrandStep<T>& step) = 0;
  // `frame`: the number of the frame stepped to. A deforming solid's level sets are the same throughout it.
  virtual void contact_step(const kernels::ContactStep<T>& step, int frame) = 0;
  virtual void wind_step(const kernels::WindStep<T>& step) = 0;
  virtual void shelter_step(const kernels::ShelterStep<T>& step) = 0;
  virtual void length_step(const kernels::LengthStep<T>& step) = 0;
  // The grid of hair against hair, on the strands where they are. To be used only while the executor lives.
  virtual std::unique_ptr<kernels::HairGrid<T>> make_hair_grid() = 0;
  // The contacts of hair against hair, on the host's copy of the strands: `fetch` before, `submit` after.
  virtual std::unique_ptr<kernels::HairContacts<T>> make_hair_contacts() = 0;

  std::int64_t launches() const { return launches_; }  // of the steps above, so far

 protected:
  std::int64_t launches_ = 0;
};

// `instruction_set`: avx512, avx2 or generic; empty: the widest this processor has. Throws Error{kUsage} for
// one it has not.
template <class T>
std::unique_ptr<Executor<T>> make_cpu_executor(const state::StrandModel<T>& model,
                                               const std::string& instruction_set);

// On the first CUDA device. Throws Error{kDevice} where there is none, or the program was built without CUDA.
std::unique_ptr<Executor<float>> make_cuda_executor(const state::StrandModel<float>& model);

// The device that `make_cuda_executor` would take. Throws Error{kDevice}, saying why, where there is none.
std::string cuda_device_name();

}  // namespace ringlet::effects
