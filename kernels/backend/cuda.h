// A CUDA stream as a data-parallel machine: Host's calls, queued. One that returns a number waits for it;
// sums have the host's bits.
#pragma once
#include <cstdint>
#include <cub/device/device_radix_sort.cuh>
#include <cub/device/device_scan.cuh>

#include "kernels/backend/lane_sums.h"
#include "kernels/backend/parallel_for.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Memory on the device as HostBuffer: contents are lost where it grows; it never shrinks.
template <class T>
class CudaBuffer {
 public:
  T* data() const { return memory_.data(); }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return memory_.bytes(); }

  void resize(std::size_t size) {
    // To allocate stops the device: what grows frame by frame must not do so each time.
    if (size > memory_.size()) memory_.resize(size + size / 4);
    size_ = size;
  }
  void swap(CudaBuffer& other) {
    memory_.swap(other.memory_);
    std::swap(size_, other.size_);
  }

 private:
  DeviceBuffer<T> memory_;
  std::size_t size_ = 0;
};

class Cuda {
 public:
  template <class T>
  using Buffer = CudaBuffer<T>;
  using Lent = CudaStream*;                          // outlives this
  static constexpr bool kCallsShareThreads = false;  // a thread for each

  explicit Cuda(CudaStream* stream) : stream_(stream) {}

  // Calls f(i) for each i in [0, n), a thread each, whatever the host would take for a piece of work.
  template <class F>
  void parallel_for(const char* name, int n, const F& f, int = 0) const {
    stream_->parallel_for<kLightBlock>(name, n, f);
  }

  // values[i] becomes the sum of those before it; returns the sum of all.
  std::int32_t scan(const char* name, CudaBuffer<std::int32_t>& values, int n) {
    if (n <= 0) return 0;
    std::int32_t last = 0, before_last = 0;
    download(&last, values.data() + n - 1, 1);
    with_temporary(name, [&](void* temporary, std::size_t& bytes) {
      return cub::DeviceScan::ExclusiveSum(temporary, bytes, values.data(), n, stream_->get());
    });
    download(&before_last, values.data() + n - 1, 1);
    return before_last + last;
  }

  // Sorts by the lowest `bits` of the keys; equal keys keep their order.
  void sort(const char* name, CudaBuffer<std::uint64_t>& keys, CudaBuffer<std::uint32_t>& values, int n,
            int bits) {
    if (n <= 0) return;
    sorted_keys_.resize(keys.size()), sorted_values_.resize(values.size());
    cub::DoubleBuffer<std::uint64_t> both_keys(keys.data(), sorted_keys_.data());
    cub::DoubleBuffer<std::uint32_t> both_values(values.data(), sorted_values_.data());
    with_temporary(name, [&](void* temporary, std::size_t& bytes) {
      return cub::DeviceRadixSort::SortPairs(temporary, bytes, both_keys, both_values, n, 0, bits,
                                             stream_->get());
    });
    if (both_keys.Current() != keys.data()) keys.swap(sorted_keys_);
    if (both_values.Current() != values.data()) values.swap(sorted_values_);
  }

  // The sum of f(i) over [0, n), in the host's order.
  template <class F>
  double sum(const char* name, int n, const F& f) {
    const int threads = sum_threads(n);
    partial_.resize(threads);
    parallel_for(name, threads, LaneSum<F>{f, n, partial_.data()});
    return total_of(partial_on_host(0, threads), threads);
  }

  // The largest of f(i) over [0, n), at least `least`; values that are not numbers do not count.
  template <class F>
  double largest(const char* name, int n, double least, const F& f) {
    constexpr int kFirst = 1 << 14, kLast = 1 << 7;
    const int first = n < kFirst ? n : kFirst, last = n < kLast ? n : kLast;
    partial_.resize(kFirst + kLast);
    double *most = partial_.data(), *most_of_most = most + kFirst;
    parallel_for(name, first, LaneLargest<F>{f, n, first, least, most});
    parallel_for(name, last, LaneLargest<ValueAt>{{most}, first, last, least, most_of_most});
    const double* on_host = partial_on_host(kFirst, last);
    for (int k = 0; k < last; ++k) least = on_host[k] > least ? on_host[k] : least;
    return least;
  }

  std::size_t bytes() const {
    return partial_.bytes() + sorted_keys_.bytes() + sorted_values_.bytes() + temporary_.bytes();
  }

 private:
  // Runs one of CUB's calls, which ask for memory first.
  template <class Call>
  void with_temporary(const char* name, const Call& call) {
    std::size_t bytes = 0;
    check_cuda(call(nullptr, bytes), name);
    temporary_.resize(bytes);
    stream_->launch(name, [&] { check_cuda(call(temporary_.data(), bytes), name); });
  }

  template <class T>
  void download(T* to, const T* from, int n) {
    check_cuda(cudaMemcpyAsync(to, from, n * sizeof(T), cudaMemcpyDeviceToHost, stream_->get()), "download");
    stream_->synchronize();
  }
  const double* partial_on_host(int first, int n) {
    on_host_.resize(n);
    if (n > 0) download(on_host_.data(), partial_.data() + first, n);
    return on_host_.data();
  }

  CudaStream* stream_;
  CudaBuffer<double> partial_;
  std::vector<double> on_host_;
  CudaBuffer<std::uint64_t> sorted_keys_;
  CudaBuffer<std::uint32_t> sorted_values_;
  CudaBuffer<unsigned char> temporary_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
