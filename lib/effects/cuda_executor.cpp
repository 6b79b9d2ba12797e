#include <fmt/format.h>

#include "core/error.h"
#include "effects/executor.h"
#include "effects/host_threads.h"
#include "kernels/launch/cuda_kernels.h"
#include "kernels/launch/hair_contacts.h"
#include "kernels/solid/response.h"

namespace ringlet::effects {
namespace {

using kernels::kLanes;

// What the device refuses leaves the library as an error of the device.
template <class Call>
auto on_device(Call&& call) {
  try {
    return call();
  } catch (const kernels::CudaError& error) {
    throw Error(ErrorKind::kDevice, "", error.what(), "--backend cpu does without the device");
  }
}

kernels::CudaDevice device_or_error() {
  std::string why_not;
  if (const auto device = kernels::find_cuda_device(&why_not)) return *device;
  throw Error(ErrorKind::kDevice, "--backend cuda", why_not, "use --backend cpu or auto");
}

// The grid that the device's strands have.
class DeviceGrid : public kernels::HairGrid<float> {
 public:
  explicit DeviceGrid(kernels::CudaStrands& strands) : strands_(strands) {}

  void at_rest(const kernels::GridStep<float>& step) override {
    on_device([&] { strands_.grid_at_rest(step); });
  }
  kernels::GridFigures run(const kernels::GridStep<float>& step) override {
    return on_device([&] { return strands_.grid_step(step); });
  }
  void shelter(const kernels::HairShelter<float>& shelter) override {
    on_device([&] { strands_.grid_shelter(shelter); });
  }
  std::size_t bytes() const override { return strands_.grid_bytes(); }

 private:
  kernels::CudaStrands& strands_;
};

// The strands live on the device; of each step only the figures come back.
class CudaExecutor : public Executor<float> {
 public:
  explicit CudaExecutor(const state::StrandModel<float>& model)
      : device_(device_or_error()),
        lanes_(static_cast<std::size_t>(model.layout.batches()) * kLanes),
        rows_(model.layout.rows() * kLanes),
        strands_(
            on_device([&] { return kernels::make_cuda_strands(model.view(), kernels::CudaTiming::kOff); })) {}

  std::string backend() const override { return "cuda"; }
  std::string instruction_set() const override {
    return fmt::format("sm_{}{}", device_.major, device_.minor);
  }

  void submit(const state::StrandState<float>& state) override {
    on_device([&] {
      strands_->upload_state({state.position, state.velocity, state.elongation, state.companion_position,
                              state.companion_velocity, state.shelter});
    });
  }
  void submit_roots(const state::StrandState<float>& state) override {
    on_device([&] { strands_->upload_roots(state.root_motion, state.root_points); });
  }
  void fetch(state::StrandState<float>& state) override {
    on_device([&] {
      strands_->download_state({state.position, state.velocity, state.elongation, state.companion_position,
                                state.companion_velocity, state.shelter});
    });
  }

  void strand_step(const kernels::StrandStep<float>& step) override {
    ++launches_;
    on_device([&] {
      strands_->strand_step(step);
      strands_->download_figures({step.figures, lanes_ * kernels::kFigures}, {});
    });
  }

  void contact_step(const kernels::ContactStep<float>& step, int frame) override {
    ++launches_;
    on_device([&] {
      if (!skin_known_) strands_->upload_skin({step.skin, lanes_});
      skin_known_ = true;
      strands_->upload_solids({step.solids, static_cast<std::size_t>(step.solid_count)}, frame);
      const std::span<float> touches(step.touches, step.touches ? rows_ * kernels::kTouchReals : 0);
      if (step.touches) strands_->upload_touches(touches);
      strands_->contact_step({step.step, step.clamped, step.rounds, step.length_iterations,
                              step.length_tolerance, step.strain_limit, step.speed_limit,
                              step.skipped_substeps, step.home});
      strands_->download_figures({}, {step.figures, lanes_ * kernels::kContactFigures}, {}, touches);
    });
  }

  void wind_step(const kernels::WindStep<float>& step) override {
    ++launches_;
    on_device([&] { strands_->wind_step(step); });
  }
  void shelter_step(const kernels::ShelterStep<float>& step) override {
    ++launches_;
    on_device([&] { strands_->shelter_step(step); });
  }
  void length_step(const kernels::LengthStep<float>& step) override {
    ++launches_;
    on_device([&] {
      strands_->length_step(step);
      strands_->download_figures({}, {}, {step.figures, lanes_ * kernels::kLengthFigures});
    });
  }
  std::unique_ptr<kernels::HairGrid<float>> make_hair_grid() override {
    return std::make_unique<DeviceGrid>(*strands_);
  }
  std::unique_ptr<kernels::HairContacts<float>> make_hair_contacts() override {
    return kernels::make_hair_contacts<float>(kernels::best_instruction_set(), host_threads());
  }

 private:
  kernels::CudaDevice device_;
  std::size_t lanes_, rows_;
  std::unique_ptr<kernels::CudaStrands> strands_;
  bool skin_known_ = false;  // what strands grow on is the same in every step of a run
};

}  // namespace

std::string cuda_device_name() { return device_or_error().name; }

std::unique_ptr<Executor<float>> make_cuda_executor(const state::StrandModel<float>& model) {
  return std::make_unique<CudaExecutor>(model);
}

}  // namespace ringlet::effects
