// The CPU as a data-parallel machine, for steps that are not strand-local: the grid, neighbours.
//
// Code of kernels/ brings no threads of its own; the program lends them. Work is cut into chunks whose size
// does not depend on their number, and sums are taken chunk after chunk: no result depends on threads. The
// CUDA backend has the same calls.
#pragma once
#include <cstddef>
#include <cstdint>
#include <new>

#include "kernels/backend/qualifiers.h"

namespace ringlet::kernels {

// Threads lent by the program: `run` calls body(context, chunk) once for each chunk in [0, chunks), on any
// thread, and returns when all are done.
struct HostThreads {
  void (*run)(void* owner, int chunks, void (*body)(const void* context, int chunk), const void* context);
  void* owner;
};

inline namespace RINGLET_ISA {

// Memory of plain values, aligned for packs. Contents are lost where it grows; it never shrinks.
template <class T>
class HostBuffer {
 public:
  HostBuffer() = default;
  HostBuffer(const HostBuffer&) = delete;
  HostBuffer& operator=(const HostBuffer&) = delete;
  ~HostBuffer() { release(); }

  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return capacity_ * sizeof(T); }

  void resize(std::size_t size) {
    if (size > capacity_) {
      release();
      capacity_ = size + size / 4;  // what grows frame by frame is not allocated anew each time
      data_ = static_cast<T*>(::operator new(capacity_ * sizeof(T), kAlignment));
    }
    size_ = size;
  }
  void swap(HostBuffer& other) {
    exchange(data_, other.data_), exchange(size_, other.size_), exchange(capacity_, other.capacity_);
  }

 private:
  static constexpr std::align_val_t kAlignment{64};

  template <class V>
  static void exchange(V& a, V& b) {
    const V old = a;
    a = b, b = old;
  }
  void release() {
    ::operator delete(data_, kAlignment);
    data_ = nullptr, size_ = capacity_ = 0;
  }

  T* data_ = nullptr;
  std::size_t size_ = 0, capacity_ = 0;
};

class Host {
 public:
  template <class T>
  using Buffer = HostBuffer<T>;
  using Lent = HostThreads;
  static constexpr int kChunk = 2048;
  static constexpr bool kCallsShareThreads = true;  // what one call has read the next finds in the cache

  explicit Host(HostThreads threads) : threads_(threads) {}

  // Calls f(i) for each i in [0, n); calls are independent of one another. `chunk`: how many make up a piece
  // of work worth a thread's while.
  template <class F>
  void parallel_for(const char*, int n, const F& f, int chunk = kChunk) const {
    for_chunks(n, chunk, [&f](int, int begin, int end) {
      const F local = f;  // its pointers in registers
#pragma GCC ivdep
      for (int i = begin; i < end; ++i) local(i);
    });
  }

  // values[i] becomes the sum of those before it; returns the sum of all.
  std::int32_t scan(const char*, HostBuffer<std::int32_t>& values, int n) {
    std::int32_t* data = values.data();
    partial_counts_.resize(chunks_of(n, kChunk));
    std::int32_t* partial = partial_counts_.data();
    for_chunks(n, kChunk, [=](int chunk, int begin, int end) {
      std::int32_t sum = 0;
      for (int i = begin; i < end; ++i) sum += data[i];
      partial[chunk] = sum;
    });
    const std::int32_t total = scan_in_order(partial, chunks_of(n, kChunk));
    for_chunks(n, kChunk, [=](int chunk, int begin, int end) {
      std::int32_t sum = partial[chunk];
      for (int i = begin; i < end; ++i) {
        const std::int32_t value = data[i];
        data[i] = sum, sum += value;
      }
    });
    return total;
  }

  // Sorts by the lowest `bits` of the keys; equal keys keep their order.
  void sort(const char*, HostBuffer<std::uint64_t>& keys, HostBuffer<std::uint32_t>& values, int n,
            int bits) {
    sorted_keys_.resize(keys.size()), sorted_values_.resize(values.size());
    for (int shift = 0; shift < bits; shift += kDigitBits) {
      sort_digit(keys.data(), values.data(), n, shift);
      keys.swap(sorted_keys_), values.swap(sorted_values_);
    }
  }

  // The sum of f(i) over [0, n), in an order of its own that is always the same.
  template <class F>
  double sum(const char*, int n, const F& f) {
    partial_sums_.resize(chunks_of(n, kChunk));
    double* partial = partial_sums_.data();
    for_chunks(n, kChunk, [&f, partial](int chunk, int begin, int end) {
      const F local = f;
      double lane[kSumLanes] = {};
      int i = begin;
      for (; i + kSumLanes <= end; i += kSumLanes)
        for (int k = 0; k < kSumLanes; ++k) lane[k] += local(i + k);
      for (int k = 0; i + k < end; ++k) lane[k] += local(i + k);
      double total = 0;
      for (int k = 0; k < kSumLanes; ++k) total += lane[k];
      partial[chunk] = total;
    });
    double total = 0;
    for (int chunk = 0; chunk < chunks_of(n, kChunk); ++chunk) total += partial[chunk];
    return total;
  }

  // The largest of f(i) over [0, n), at least `least`; values that are not numbers do not count.
  template <class F>
  double largest(const char*, int n, double least, const F& f) {
    partial_sums_.resize(chunks_of(n, kChunk));
    double* partial = partial_sums_.data();
    for_chunks(n, kChunk, [&f, partial, least](int chunk, int begin, int end) {
      const F local = f;
      double most = least;
      for (int i = begin; i < end; ++i) {
        const double value = local(i);
        most = value > most ? value : most;
      }
      partial[chunk] = most;
    });
    double most = least;
    for (int chunk = 0; chunk < chunks_of(n, kChunk); ++chunk)
      most = partial[chunk] > most ? partial[chunk] : most;
    return most;
  }

  std::size_t bytes() const {
    return partial_counts_.bytes() + partial_sums_.bytes() + counts_.bytes() + sorted_keys_.bytes() +
           sorted_values_.bytes();
  }

 private:
  static constexpr int kDigitBits = 11, kDigits = 1 << kDigitBits, kSortChunk = 1 << 15, kSumLanes = 16;

  static int chunks_of(int n, int chunk) { return n <= 0 ? 0 : (n - 1) / chunk + 1; }

  // Calls f(chunk, begin, end).
  template <class F>
  void for_chunks(int n, int chunk, const F& f) const {
    struct Context {
      const F& f;
      int n, chunk;
    } const context{f, n, chunk};
    const auto body = [](const void* shared, int k) {
      const Context& c = *static_cast<const Context*>(shared);
      const int begin = k * c.chunk, end = c.n - begin < c.chunk ? c.n : begin + c.chunk;
      c.f(k, begin, end);
    };
    const int chunks = chunks_of(n, chunk);
    if (chunks == 1)
      body(&context, 0);
    else if (chunks > 1)
      threads_.run(threads_.owner, chunks, body, &context);
  }

  static std::int32_t scan_in_order(std::int32_t* values, int n) {
    std::int32_t sum = 0;
    for (int i = 0; i < n; ++i) {
      const std::int32_t value = values[i];
      values[i] = sum, sum += value;
    }
    return sum;
  }

  void sort_digit(const std::uint64_t* keys, const std::uint32_t* values, int n, int shift) {
    const int chunks = chunks_of(n, kSortChunk);
    counts_.resize(static_cast<std::size_t>(chunks) * kDigits);
    std::int32_t* counts = counts_.data();
    for_chunks(n, kSortChunk, [=](int chunk, int begin, int end) {
      std::int32_t count[kDigits] = {};
      for (int i = begin; i < end; ++i) ++count[keys[i] >> shift & (kDigits - 1)];
      for (int digit = 0; digit < kDigits; ++digit) counts[digit * chunks + chunk] = count[digit];
    });
    scan_in_order(counts, chunks * kDigits);
    std::uint64_t* to_keys = sorted_keys_.data();
    std::uint32_t* to_values = sorted_values_.data();
    for_chunks(n, kSortChunk, [=](int chunk, int begin, int end) {
      std::int32_t place[kDigits];
      for (int digit = 0; digit < kDigits; ++digit) place[digit] = counts[digit * chunks + chunk];
      for (int i = begin; i < end; ++i) {
        const std::int32_t to = place[keys[i] >> shift & (kDigits - 1)]++;
        to_keys[to] = keys[i], to_values[to] = values[i];
      }
    });
  }

  HostThreads threads_;
  HostBuffer<std::int32_t> partial_counts_, counts_;
  HostBuffer<double> partial_sums_;
  HostBuffer<std::uint64_t> sorted_keys_;
  HostBuffer<std::uint32_t> sorted_values_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
