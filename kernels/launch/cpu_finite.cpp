// finite.h for one instruction set: compiled once for each, with RINGLET_ISA naming it.
#include "kernels/backend/pack.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {
namespace {

template <class R>
bool finite(const Scalar<R>* values, std::int64_t count) {
  using T = Scalar<R>;
  constexpr int kWidth = Traits<R>::kWidth, kSums = 8;  // so many additions under way at once
  R sums[kSums];
  for (R& sum : sums) sum = R(0);
  std::int64_t k = 0;
  for (; k + kSums * kWidth <= count; k += kSums * kWidth) {
    RINGLET_UNROLL
    for (int s = 0; s < kSums; ++s) sums[s] = fma(R(0), load<R>(values + k + s * kWidth), sums[s]);
  }
  for (; k < count; k += kWidth) sums[0] = fma(R(0), load<R>(values + k), sums[0]);
  R sum = sums[0];
  for (int s = 1; s < kSums; ++s) sum = sum + sums[s];
  alignas(64) T left[kWidth];
  store(left, sum);
  for (const T one : left)
    if (!(one == T(0))) return false;
  return true;
}

}  // namespace

bool finite_floats(const float* values, std::int64_t count) { return finite<FloatPack>(values, count); }
bool finite_doubles(const double* values, std::int64_t count) { return finite<DoublePack>(values, count); }

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
