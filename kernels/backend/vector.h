// Small vectors and matrices of reals, and the few functions that packs need in polynomial form.
#pragma once
#include "kernels/backend/real.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

template <class R>
struct Vector3 {
  R x, y, z;

  friend RINGLET_KERNEL Vector3 operator+(Vector3 a, Vector3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend RINGLET_KERNEL Vector3 operator-(Vector3 a, Vector3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend RINGLET_KERNEL Vector3 operator*(R s, Vector3 a) { return {s * a.x, s * a.y, s * a.z}; }
};

template <class R>
RINGLET_KERNEL Vector3<R> zero3() {
  return {R(0), R(0), R(0)};
}
template <class R>
RINGLET_KERNEL R dot(Vector3<R> a, Vector3<R> b) {
  return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}
template <class R>
RINGLET_KERNEL Vector3<R> cross(Vector3<R> a, Vector3<R> b) {
  return {fma(a.y, b.z, R(0) - a.z * b.y), fma(a.z, b.x, R(0) - a.x * b.z), fma(a.x, b.y, R(0) - a.y * b.x)};
}
template <class R>
RINGLET_KERNEL R length(Vector3<R> a) {
  return sqrt(dot(a, a));
}
// a * s + b
template <class R>
RINGLET_KERNEL Vector3<R> fma(R s, Vector3<R> a, Vector3<R> b) {
  return {fma(s, a.x, b.x), fma(s, a.y, b.y), fma(s, a.z, b.z)};
}
template <class R>
RINGLET_KERNEL Vector3<R> select(Mask<R> mask, Vector3<R> a, Vector3<R> b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}

// Three components `stride` apart.
template <class R>
RINGLET_KERNEL Vector3<R> load3(const Scalar<R>* p, int stride) {
  return {load<R>(p), load<R>(p + stride), load<R>(p + 2 * stride)};
}
template <class R>
RINGLET_KERNEL void store3(Scalar<R>* p, int stride, Vector3<R> a) {
  store(p, a.x), store(p + stride, a.y), store(p + 2 * stride, a.z);
}

// 1 / a where a is above `smallest`, 0 elsewhere: a direction that does not exist contributes nothing.
template <class R>
RINGLET_KERNEL R inverse_or_zero(R a, R smallest) {
  const Mask<R> exists = a > smallest;
  return select(exists, R(1) / select(exists, a, R(1)), R(0));
}
// Lengths under this [m] have no direction.
template <class R>
RINGLET_KERNEL R shortest_direction() {
  return R(Scalar<R>(1e-15));
}

template <class R>
struct Matrix3 {  // row-major
  R m[9];
  RINGLET_KERNEL Vector3<R> operator*(Vector3<R> a) const {
    return {fma(m[2], a.z, fma(m[1], a.y, m[0] * a.x)), fma(m[5], a.z, fma(m[4], a.y, m[3] * a.x)),
            fma(m[8], a.z, fma(m[7], a.y, m[6] * a.x))};
  }
  RINGLET_KERNEL Vector3<R> transposed_times(Vector3<R> a) const {
    return {fma(m[6], a.z, fma(m[3], a.y, m[0] * a.x)), fma(m[7], a.z, fma(m[4], a.y, m[1] * a.x)),
            fma(m[8], a.z, fma(m[5], a.y, m[2] * a.x))};
  }
};

template <class R>
struct Symmetric3 {
  R xx, xy, xz, yy, yz, zz;

  // += s a a^T
  RINGLET_KERNEL void add_outer(R s, Vector3<R> a) {
    const Vector3<R> b = s * a;
    xx = fma(b.x, a.x, xx), xy = fma(b.x, a.y, xy), xz = fma(b.x, a.z, xz);
    yy = fma(b.y, a.y, yy), yz = fma(b.y, a.z, yz), zz = fma(b.z, a.z, zz);
  }
  RINGLET_KERNEL void add_identity(R s) { xx = xx + s, yy = yy + s, zz = zz + s; }
  RINGLET_KERNEL void add(const Symmetric3& o) {
    xx = xx + o.xx, xy = xy + o.xy, xz = xz + o.xz, yy = yy + o.yy, yz = yz + o.yz, zz = zz + o.zz;
  }
};
template <class R>
RINGLET_KERNEL Symmetric3<R> zero_symmetric() {
  return {R(0), R(0), R(0), R(0), R(0), R(0)};
}
template <class R>
RINGLET_KERNEL Vector3<R> operator*(const Symmetric3<R>& a, Vector3<R> b) {
  return {fma(a.xz, b.z, fma(a.xy, b.y, a.xx * b.x)), fma(a.yz, b.z, fma(a.yy, b.y, a.xy * b.x)),
          fma(a.zz, b.z, fma(a.yz, b.y, a.xz * b.x))};
}

// The angle in [0, pi] whose sine and cosine are in the proportion `sine` >= 0 to `cosine`; 0 where both are
// 0. Relative error under 2e-7 in float, 4e-16 in double: the argument is halved by atan(z) = 2 atan(z / (1 +
// sqrt(1 + z^2))) until the odd Taylor series is short.
template <class R>
RINGLET_KERNEL R angle_between(R sine, R cosine) {
  constexpr bool kDouble = sizeof(Scalar<R>) == 8;
  constexpr int kHalvings = kDouble ? 2 : 1, kTerms = kDouble ? 12 : 9;
  const R adjacent = abs(cosine);
  const Mask<R> steep = sine > adjacent;
  const R large = select(steep, sine, adjacent), small = select(steep, adjacent, sine);
  R z = small / select(large > R(0), large, R(1));
  RINGLET_UNROLL
  for (int i = 0; i < kHalvings; ++i) z = z / (R(1) + sqrt(fma(z, z, R(1))));
  const R z2 = z * z;
  R sum = R(Scalar<R>(1) / (2 * kTerms + 1));
  for (int k = kTerms - 1; k >= 0; --k) sum = fma(R(0) - z2, sum, R(Scalar<R>(1) / (2 * k + 1)));
  const R acute = R(Scalar<R>(1 << kHalvings)) * z * sum;
  const R pi = R(Scalar<R>(3.14159265358979323846));
  const R turned = select(steep, R(Scalar<R>(0.5)) * pi - acute, acute);
  return select(cosine < R(0), pi - turned, turned);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
