// A CUDA stream and the one way to launch on it: a function object called once for each thread, under a name.
#pragma once
#include <algorithm>
#include <deque>

#include "kernels/backend/device_buffer.h"

namespace ringlet::kernels {

// Blocks of one warp: with about 250 registers a thread, a multiprocessor holds fewer warps than blocks, so
// larger blocks would gain nothing and would spread a small groom over fewer multiprocessors. Asking for one
// block at least lets the compiler use all 255 registers.
inline constexpr int kStrandBlock = 32;
// For what needs few registers and no neighbours.
inline constexpr int kLightBlock = 128;

template <int kBlock, class Function>
__global__ void __launch_bounds__(kBlock, 1)
    call_threads(const __grid_constant__ Function function, int threads) {
  const int thread = static_cast<int>(blockIdx.x) * kBlock + static_cast<int>(threadIdx.x);
  if (thread < threads) function(thread);
}

class CudaStream {
 public:
  explicit CudaStream(CudaTiming timing) : timing_(timing) {
    check_cuda(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "creating a stream");
  }
  ~CudaStream() {
    cudaStreamSynchronize(stream_);
    for (const Event& event : events_) cudaEventDestroy(event.start), cudaEventDestroy(event.stop);
    cudaStreamDestroy(stream_);
  }
  CudaStream(const CudaStream&) = delete;
  CudaStream& operator=(const CudaStream&) = delete;

  cudaStream_t get() const { return stream_; }

  // Calls function(thread) on the device for each thread in [0, threads).
  template <int kBlock = kStrandBlock, class Function>
  void parallel_for(const std::string& name, int threads, const Function& function) {
    if (threads <= 0) return;
    launch(name, [&] {
      call_threads<kBlock><<<(threads - 1) / kBlock + 1, kBlock, 0, stream_>>>(function, threads);
    });
  }

  // Calls what queues work on the stream, which is timed and fails under this name.
  template <class Queue>
  void launch(const std::string& name, const Queue& queue) {
    last_ = name;
    if (timing_ == CudaTiming::kOn) begin_timing(name);
    queue();
    check_cuda(cudaGetLastError(), "launching '" + name + "'");
    if (timing_ == CudaTiming::kOn) check_cuda(cudaEventRecord(events_.back().stop, stream_), "timing");
  }

  void synchronize() {
    check_cuda(cudaStreamSynchronize(stream_), last_.empty() ? "copying" : "running '" + last_ + "'");
  }

  std::vector<CudaLaunches> launches() {
    collect_timings();
    return launches_;
  }

 private:
  struct Event {
    std::string name;
    cudaEvent_t start = nullptr, stop = nullptr;
  };

  void begin_timing(const std::string& name) {
    constexpr std::size_t kMostPending = 256;
    if (events_.size() >= kMostPending) collect_timings();
    events_.push_back({name});
    check_cuda(cudaEventCreate(&events_.back().start), "timing");
    check_cuda(cudaEventCreate(&events_.back().stop), "timing");
    check_cuda(cudaEventRecord(events_.back().start, stream_), "timing");
  }

  void collect_timings() {
    synchronize();
    for (; !events_.empty(); events_.pop_front()) {
      const Event& event = events_.front();
      float milliseconds = 0;
      check_cuda(cudaEventElapsedTime(&milliseconds, event.start, event.stop), "timing");
      auto found = std::ranges::find(launches_, event.name, &CudaLaunches::name);
      if (found == launches_.end()) found = launches_.insert(found, CudaLaunches{event.name, 0, 0});
      ++found->count, found->seconds += 1e-3 * milliseconds;
      cudaEventDestroy(event.start), cudaEventDestroy(event.stop);
    }
  }

  cudaStream_t stream_ = nullptr;
  CudaTiming timing_;
  std::string last_;          // the launch that a later error is put down to
  std::deque<Event> events_;  // recorded and not yet read
  std::vector<CudaLaunches> launches_;
};

}  // namespace ringlet::kernels
