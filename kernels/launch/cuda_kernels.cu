// The kernels on a CUDA device: one thread a strand, the same source as the CPU's with R = float.
#include "kernels/launch/cuda_kernels.h"

#include "kernels/backend/parallel_for.h"
#include "kernels/launch/cuda_grid.h"
#include "kernels/launch/cuda_solids.h"
#include "kernels/launch/cuda_threads.h"

namespace ringlet::kernels {
namespace {

constexpr int kDevice = 0;       // the first of CUDA_VISIBLE_DEVICES
constexpr int kLowestMajor = 8;  // compute capability 8.0 (kernels/CMakeLists.txt)

CudaDevice describe_device() {
  int driver = 0, devices = 0;
  check_cuda(cudaDriverGetVersion(&driver), "asking for the driver");
  if (driver == 0) throw CudaError("CUDA: no NVIDIA driver here");
  check_cuda(cudaGetDeviceCount(&devices), "looking for a device");
  if (devices == 0) throw CudaError("CUDA: no device");
  cudaDeviceProp properties;
  check_cuda(cudaGetDeviceProperties(&properties, kDevice), "asking about the device");
  if (properties.major < kLowestMajor) {
    throw CudaError("CUDA: " + std::string(properties.name) + " has compute capability " +
                    std::to_string(properties.major) + "." + std::to_string(properties.minor) +
                    ", 8.0 is the lowest that serves");
  }
  CudaDevice device{properties.name, properties.major, properties.minor, 0, 0};
  check_cuda(cudaSetDevice(kDevice), "taking the device");
  check_cuda(cudaMemGetInfo(&device.free_memory, &device.memory), "asking about memory");
  return device;
}

template <class T>
std::span<const T> array(const T* data, std::int64_t size) {
  return {data, static_cast<std::size_t>(size)};
}

class Strands final : public CudaStrands {
 public:
  Strands(const StrandBatches<float>& model, CudaTiming timing) : stream_(timing), batches_(model.batches) {
    const std::int64_t rows = model.row[batches_], lanes = std::int64_t{batches_} * kLanes;
    row_.upload(array(model.row, batches_ + 1), stream_.get());
    count_.upload(array(model.count, lanes), stream_.get());
    rest_.upload(array(model.rest, rows * 3 * kLanes), stream_.get());
    rest_length_.upload(array(model.rest_length, rows * 3 * kLanes), stream_.get());
    if (model.stiffness) stiffness_.upload(array(model.stiffness, rows * kCouplings * kLanes), stream_.get());
    preload_.upload(array(model.preload, lanes * 3), stream_.get());
    const std::vector<std::int32_t> begin = scratch_particles(model.row, batches_);
    scratch_begin_.upload(begin, stream_.get());
    scratch_reals_ = scratch_reals_of(model);
    scratch_.resize(std::size_t(begin.back()) * scratch_reals_ * kWarp);
    skin_.upload(std::vector<std::int32_t>(lanes, kNoSkin), stream_.get());
    if (model.rest_companion)
      rest_companion_.upload(array(model.rest_companion, rows * 3 * kLanes), stream_.get());
    if (model.per_length) per_length_.upload(array(model.per_length, lanes), stream_.get());
    rows_ = rows;
    position_.resize(rows * 3 * kLanes), velocity_.resize(rows * 3 * kLanes);
    root_motion_.resize(lanes * kRootValues), root_points_.resize(lanes * 3);
    strand_figures_.resize(lanes * kFigures), contact_figures_.resize(lanes * kContactFigures);
    clear(position_), clear(velocity_), clear(root_motion_), clear(root_points_);
    clear(strand_figures_), clear(contact_figures_);
    stream_.synchronize();
  }

  void upload_state(const StateArrays<const float>& host) override {
    elongation_.resize(host.elongation.size());
    companion_position_.resize(host.companion_position.size());
    companion_velocity_.resize(host.companion_velocity.size());
    send("position", host.position, position_), send("velocity", host.velocity, velocity_);
    send("elongation", host.elongation, elongation_);
    send("companions", host.companion_position, companion_position_);
    send("companions", host.companion_velocity, companion_velocity_);
    shelter_.resize(host.shelter.size());
    send("shelter", host.shelter, shelter_);
  }
  void download_state(const StateArrays<float>& host) override {
    fetch("position", position_, host.position), fetch("velocity", velocity_, host.velocity);
    fetch("elongation", elongation_, host.elongation);
    fetch("companions", companion_position_, host.companion_position);
    fetch("companions", companion_velocity_, host.companion_velocity);
    fetch("shelter", shelter_, host.shelter);
    stream_.synchronize();
  }
  void upload_roots(std::span<const float> motion, std::span<const double> points) override {
    send("root motion", motion, root_motion_), send("root points", points, root_points_);
  }
  void upload_skin(std::span<const std::int32_t> skin) override { send("skin", skin, skin_); }
  void upload_solids(std::span<const SolidView> solids, std::int64_t interval) override {
    solids_.upload(solids, interval, stream_.get());
  }

  void strand_step(const StrandStep<float>& host) override {
    StrandStep<float> step = host;
    step.batches = batches(), step.state = state(), step.roots = root_motion_.data();
    step.figures = strand_figures_.data();
    if (host.elongation.memory) step.elongation.memory = elongation_.data();
    if (host.air.velocity) step.air.velocity = air_.data();
    with_strand_model(step, [&](auto strands) {
      stream_.parallel_for("strand step", threads(), StrandStepThread<decltype(strands)>{step, scratch()});
    });
  }
  void wind_step(const WindStep<float>& host) override {
    if (air_.size() == 0) air_.resize(rows_ * 3 * kLanes), clear(air_);
    WindStep<float> step = host;
    step.batches = batches(), step.position = position_.data(), step.root_points = root_points_.data();
    if (host.exposure) step.exposure = exposure_.data();
    if (host.shelter) step.shelter = shelter_.data();
    step.air = air_.data();
    stream_.parallel_for("wind step", threads(), WindStepThread{step});
  }
  void shelter_step(const ShelterStep<float>& host) override {
    if (exposure_.size() == 0) exposure_.resize(rows_ * kLanes), clear(exposure_);
    const std::int64_t cells = std::int64_t{host.map.columns} * host.map.rows;
    front_.upload(array(host.map.front, cells), stream_.get());
    rear_.upload(array(host.map.rear, cells), stream_.get());
    ShelterStep<float> step = host;
    step.batches = batches(), step.position = position_.data(), step.root_points = root_points_.data();
    step.map.front = front_.data(), step.map.rear = rear_.data();
    step.exposure = exposure_.data();
    stream_.parallel_for("shelter step", threads(), ShelterStepThread{step});
  }
  void contact_step(const ContactParameters& p) override {
    const ContactStep<float> step{batches(),
                                  state(),
                                  root_points_.data(),
                                  skin_.data(),
                                  solids_.views(),
                                  solids_.count(),
                                  p.home,
                                  p.step,
                                  p.clamped,
                                  p.rounds,
                                  p.length_iterations,
                                  p.length_tolerance,
                                  contact_figures_.data(),
                                  p.strain_limit,
                                  p.speed_limit,
                                  p.skipped_substeps,
                                  touches_.size() > 0 ? touches_.data() : nullptr};
    stream_.parallel_for("contact step", threads(), ContactStepThread{step, scratch()});
  }

  void upload_touches(std::span<const float> touches) override {
    touches_.resize(touches.size());
    send("touches", touches, touches_);
  }

  void length_step(const LengthStep<float>& host) override {
    if (length_figures_.size() == 0) length_figures_.resize(std::size_t(threads()) * kLengthFigures);
    LengthStep<float> step = host;
    step.batches = batches(), step.state = state(), step.figures = length_figures_.data();
    stream_.parallel_for("length step", threads(), LengthStepThread{step, scratch()});
  }

  void grid_at_rest(const GridStep<float>& host) override { grid().at_rest(on_device(host)); }
  GridFigures grid_step(const GridStep<float>& host) override {
    upload_solids({host.solids, std::size_t(host.solid_count)}, host.frame);
    return grid().run(on_device(host));
  }
  void grid_shelter(const HairShelter<float>& host) override {
    HairShelter<float> shelter = host;
    shelter.share = shelter_.data();
    grid().shelter(shelter);
  }
  std::size_t grid_bytes() const override { return grid_ ? grid_->bytes() : 0; }

  void download_figures(std::span<float> strands, std::span<float> contacts, std::span<float> lengths,
                        std::span<float> touches) override {
    if (!strands.empty()) fetch("strand figures", strand_figures_, strands);
    if (!contacts.empty()) fetch("contact figures", contact_figures_, contacts);
    if (!lengths.empty()) fetch("length figures", length_figures_, lengths);
    if (!touches.empty()) fetch("touches", touches_, touches);
    stream_.synchronize();
  }
  void synchronize() override { stream_.synchronize(); }
  std::vector<CudaLaunches> launches() override { return stream_.launches(); }
  std::size_t bytes() const override {
    return row_.bytes() + count_.bytes() + rest_.bytes() + rest_length_.bytes() + stiffness_.bytes() +
           preload_.bytes() + per_length_.bytes() + rest_companion_.bytes() + companion_position_.bytes() +
           companion_velocity_.bytes() + elongation_.bytes() + air_.bytes() + exposure_.bytes() +
           shelter_.bytes() + front_.bytes() + rear_.bytes() + position_.bytes() + velocity_.bytes() +
           root_motion_.bytes() + root_points_.bytes() + skin_.bytes() + strand_figures_.bytes() +
           contact_figures_.bytes() + length_figures_.bytes() + touches_.bytes() + scratch_begin_.bytes() +
           scratch_.bytes() + solids_.bytes() + grid_bytes();
  }

 private:
  int threads() const { return batches_ * kLanes; }
  StrandBatches<float> batches() const {
    return {
        batches_,          row_.data(),     count_.data(),          rest_.data(),      rest_length_.data(),
        stiffness_.data(), preload_.data(), rest_companion_.data(), per_length_.data()};
  }
  StrandState<float> state() const {
    return {position_.data(), velocity_.data(), companion_position_.data(), companion_velocity_.data()};
  }
  HairGrid<float>& grid() {
    if (!grid_) grid_ = make_cuda_grid(stream_);
    return *grid_;
  }
  GridStep<float> on_device(GridStep<float> step) const {
    step.batches = batches(), step.state = state(), step.root_points = root_points_.data();
    step.solids = solids_.views(), step.solid_count = solids_.count();
    return step;
  }
  WarpScratch scratch() const { return {scratch_begin_.data(), scratch_.data(), scratch_reals_}; }

  template <class T>
  void clear(DeviceBuffer<T>& buffer) {
    check_cuda(cudaMemsetAsync(buffer.data(), 0, buffer.size() * sizeof(T), stream_.get()), "clearing");
  }
  static void check_size(const char* what, std::size_t given, std::size_t expected) {
    if (given == expected) return;
    throw CudaError("CUDA: " + std::string(what) + ": " + std::to_string(given) + " values, expected " +
                    std::to_string(expected));
  }
  template <class T>
  void send(const char* what, std::span<const T> host, DeviceBuffer<T>& device) {
    check_size(what, host.size(), device.size());
    device.upload(host, stream_.get());
  }
  template <class T>
  void fetch(const char* what, const DeviceBuffer<T>& device, std::span<T> host) {
    check_size(what, host.size(), device.size());
    device.download(host, stream_.get());
  }

  CudaStream stream_;
  std::int32_t batches_;
  DeviceBuffer<std::int32_t> row_;
  std::int64_t rows_ = 0;
  int scratch_reals_ = 0;
  DeviceBuffer<float> count_, rest_, rest_length_, stiffness_, preload_, rest_companion_, per_length_;
  DeviceBuffer<float> position_, velocity_, companion_position_, companion_velocity_, elongation_,
      root_motion_;
  DeviceBuffer<float> air_, exposure_, shelter_, front_, rear_;
  DeviceBuffer<std::int32_t> skin_;
  DeviceBuffer<double> root_points_;
  DeviceBuffer<float> strand_figures_, contact_figures_, length_figures_, touches_;
  DeviceBuffer<std::int32_t> scratch_begin_;
  DeviceBuffer<float> scratch_;
  CudaSolids solids_;
  std::unique_ptr<HairGrid<float>> grid_;  // on the stream, which outlives it
};

}  // namespace

bool cuda_compiled() { return true; }

std::optional<CudaDevice> find_cuda_device(std::string* why_not) {
  try {
    return describe_device();
  } catch (const CudaError& error) {
    if (why_not) *why_not = error.what();
    return std::nullopt;
  }
}

std::unique_ptr<CudaStrands> make_cuda_strands(const StrandBatches<float>& model, CudaTiming timing) {
  describe_device();
  return std::make_unique<Strands>(model, timing);
}

}  // namespace ringlet::kernels
