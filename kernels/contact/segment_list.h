// Tubes of segments, picked from a table to be compared with one another.
#pragma once
#include "kernels/backend/lane_bits.h"
#include "kernels/contact/segment_table.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class F>
struct SegmentList {
  static constexpr int kWidth = Traits<F>::kWidth, kRoom = 512, kWidest = 16, kStride = kRoom + kWidest;
  alignas(64) float numbers[Tube<F>::kNumbers][kStride];
  std::int32_t at[kStride];  // in the table
  int count = 0;

  RINGLET_KERNEL bool full() const { return count > kRoom - kWidest; }
  // Those of a pack of the table, first, first + 1, ..., whose bit is set.
  RINGLET_KERNEL void append(const Tube<F>& tubes, std::int32_t first, std::uint32_t bits) {
    for_numbers(tubes, [&](int k, F number) { append_selected(numbers[k] + count, number, bits); });
    count += append_lanes<kWidth>(at + count, first, bits);
  }
  // What is read of the last pack beyond the last tube meets nothing.
  RINGLET_KERNEL void close() {
    for (int k = count; k % kWidth; ++k) {
      for (auto& number : numbers) number[k] = 0;
      numbers[0][k] = 3e38f, numbers[1][k] = -3e38f;
    }
  }
  RINGLET_KERNEL Tube<F> pack(int first) const { return load_tube<F>(numbers[0] + first, kStride); }
  RINGLET_KERNEL Tube<float> tube(int k) const { return load_tube<float>(numbers[0] + k, kStride); }

  // One that holds all; there is at least one.
  RINGLET_FUNCTION Tube<float> around() const {
    Tube<float> all = tube(0);
    for (int k = 1; k < count; ++k) {
      const Tube<float> one = tube(k);
      all.low = min(all.low, one.low), all.high = max(all.high, one.high);
      all.slope[0] += one.slope[0], all.slope[1] += one.slope[1];
    }
    for (int side = 0; side < 2; ++side) {
      const float slope = all.slope[side] / static_cast<float>(count);
      float low = 3e38f, high = -3e38f;
      for (int k = 0; k < count; ++k) {
        const Tube<float> one = tube(k);
        for (const float here : {one.low, one.high}) {
          const float from_middle = one.middle_at(side, here) - slope * here;
          low = min(low, from_middle - one.half[side]), high = max(high, from_middle + one.half[side]);
        }
      }
      all.slope[side] = slope, all.middle[side] = 0.5f * (low + high), all.half[side] = 0.5f * (high - low);
    }
    return all;
  }
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
