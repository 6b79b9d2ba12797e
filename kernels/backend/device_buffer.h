// Memory on the CUDA device, owned.
#pragma once
#include <cuda_runtime.h>

#include <span>
#include <string>
#include <utility>

#include "kernels/launch/cuda_kernels.h"

namespace ringlet::kernels {

inline void check_cuda(cudaError_t status, const std::string& during) {
  if (status == cudaSuccess) return;
  cudaGetLastError();  // reported here, not again by the next launch
  throw CudaError("CUDA: " + during + ": " + cudaGetErrorString(status));
}

template <class T>
class DeviceBuffer {
 public:
  DeviceBuffer() = default;
  explicit DeviceBuffer(std::size_t size) { resize(size); }
  DeviceBuffer(DeviceBuffer&& other) noexcept { swap(other); }
  DeviceBuffer& operator=(DeviceBuffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ~DeviceBuffer() { cudaFree(data_); }  // fails only where the device is lost, and then so is the memory

  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return capacity_ * sizeof(T); }

  // Contents are lost where it grows; it never shrinks.
  void resize(std::size_t size) {
    if (size > capacity_) {
      cudaFree(std::exchange(data_, nullptr));
      size_ = capacity_ = 0;
      check_cuda(cudaMalloc(&data_, size * sizeof(T)),
                 "allocating " + std::to_string(size * sizeof(T)) + " bytes");
      capacity_ = size;
    }
    size_ = size;
  }
  void swap(DeviceBuffer& other) noexcept {
    std::swap(data_, other.data_), std::swap(size_, other.size_), std::swap(capacity_, other.capacity_);
  }
  // Done with `host` when it returns: pageable memory is staged.
  void upload(std::span<const T> host, cudaStream_t stream) {
    resize(host.size());
    if (host.empty()) return;
    check_cuda(cudaMemcpyAsync(data_, host.data(), host.size_bytes(), cudaMemcpyHostToDevice, stream),
               "upload");
  }
  // In `host` only once the stream is synchronised.
  void download(std::span<T> host, cudaStream_t stream) const {
    if (host.empty()) return;
    check_cuda(cudaMemcpyAsync(host.data(), data_, host.size_bytes(), cudaMemcpyDeviceToHost, stream),
               "download");
  }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

}  // namespace ringlet::kernels
