// finite.h for one instruction set: compiled once for each, with RINGLET_ISA naming it.
#include "kernels/backend/pack.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {
namespace {

template <class R>
bool finite(const Scalar<R>* values, std::int64_t count) {
  using T = Scalar<R>;
  constexpr int kWidth = Traits<R>::kWidth, kSums = kLanes / kWidth;  // so many additions under way at once
  R sums[kSums];
  for (R& sum : sums) sum = R(0);
  for (std::int64_t k = 0; k < count; k += kLanes)
    for (int s = 0; s < kSums; ++s) sums[s] = fma(R(0), load<R>(values + k + s * kWidth), sums[s]);
  alignas(64) T left[kLanes];
  for (int s = 0; s < kSums; ++s) store(left + s * kWidth, sums[s]);
  for (const T one : left)
    if (!(one == T(0))) return false;
  return true;
}

}  // namespace

bool finite_floats(const float* values, std::int64_t count) { return finite<FloatPack>(values, count); }
bool finite_doubles(const double* values, std::int64_t count) { return finite<DoublePack>(values, count); }

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
