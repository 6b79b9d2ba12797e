// Sums and largest values as a device's threads take them, each thread a few of the values.
#pragma once
#include "kernels/backend/qualifiers.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// In the order that Host adds in, so that a sum has the host's bits: chunks one after the other, in each as
// many sums side by side.
inline constexpr int kSumChunk = 2048, kSumLanes = 16;

inline int sum_threads(int n) { return n <= 0 ? 0 : ((n - 1) / kSumChunk + 1) * kSumLanes; }

// A thread's part of the sum of f(i) over [0, n).
template <class F>
struct LaneSum {
  F f;
  int n;
  double* sums;  // [sum_threads(n)]

  RINGLET_LAMBDA void operator()(int thread) const {
    const int begin = thread / kSumLanes * kSumChunk, end = n - begin < kSumChunk ? n : begin + kSumChunk;
    double sum = 0;
    for (int i = begin + thread % kSumLanes; i < end; i += kSumLanes) sum += f(i);
    sums[thread] = sum;
  }
};

// What the threads have found, added up.
inline double total_of(const double* sums, int threads) {
  double total = 0;
  for (int t = 0; t < threads; t += kSumLanes) {
    double chunk = 0;
    for (int k = 0; k < kSumLanes; ++k) chunk += sums[t + k];
    total += chunk;
  }
  return total;
}

// The largest of f(i) over every `threads`-th i, at least `least`; no order shows in it.
template <class F>
struct LaneLargest {
  F f;
  int n, threads;
  double least;
  double* largest;  // [threads]

  RINGLET_LAMBDA void operator()(int thread) const {
    double most = least;
    for (int i = thread; i < n; i += threads) {
      const double value = f(i);
      most = value > most ? value : most;
    }
    largest[thread] = most;
  }
};

struct ValueAt {
  const double* values;
  RINGLET_LAMBDA double operator()(int i) const { return values[i]; }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
