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
  return {fnma(a.z, b.y, a.y * b.z), fnma(a.x, b.z, a.z * b.x), fnma(a.y, b.x, a.x * b.y)};
}
template <class R>
RINGLET_KERNEL R length(Vector3<R> a) {
  return sqrt(dot(a, a));
}
// s a + b
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
  // this a + b
  RINGLET_KERNEL Vector3<R> times_plus(Vector3<R> a, Vector3<R> b) const {
    return {fma(m[2], a.z, fma(m[1], a.y, fma(m[0], a.x, b.x))),
            fma(m[5], a.z, fma(m[4], a.y, fma(m[3], a.x, b.y))),
            fma(m[8], a.z, fma(m[7], a.y, fma(m[6], a.x, b.z)))};
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
  RINGLET_KERNEL void scale(R s) {
    xx = s * xx, xy = s * xy, xz = s * xz, yy = s * yy, yz = s * yz, zz = s * zz;
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

// atan(z) / z for z in [0, 1], as a polynomial in z2 = z^2: the minimax one of relative error 1.5e-8 in
// float; in double the Taylor series, good to 2e-17 up to z = 0.2.
template <class R>
RINGLET_KERNEL R arctangent_over(R z2) {
  if constexpr (sizeof(Scalar<R>) == 8) {
    R sum = R(1.0 / 25);
    RINGLET_UNROLL
    for (int k = 11; k >= 0; --k) sum = fnma(z2, sum, R(1.0 / (2 * k + 1)));
    return sum;
  } else {
    R sum = R(2.84988687e-3f);
    sum = fma(z2, sum, R(-1.60686152e-2f));
    sum = fma(z2, sum, R(4.26914918e-2f));
    sum = fma(z2, sum, R(-7.50429169e-2f));
    sum = fma(z2, sum, R(1.06409324e-1f));
    sum = fma(z2, sum, R(-1.4203644e-1f));
    sum = fma(z2, sum, R(1.99926193e-1f));
    sum = fma(z2, sum, R(-3.33330733e-1f));
    return fma(z2, sum, R(9.99999985e-1f));
  }
}

// The angle in [0, pi] whose sine and cosine are in the proportion `sine` >= 0 to `cosine`; 0 where both are
// 0, NaN where either is. Relative error under 3e-7 in float, 1e-15 in double, where atan(z) = 2 atan(z / (1
// + sqrt(1 + z^2))) shortens the series.
template <class R>
RINGLET_KERNEL R angle_between(R sine, R cosine) {
  constexpr int kHalvings = sizeof(Scalar<R>) == 8 ? 2 : 0;
  const R adjacent = abs(cosine);
  const Mask<R> steep = sine > adjacent;
  const R large = select(steep, sine, adjacent), small = select(steep, adjacent, sine);
  R z = small / max(large, R(Scalar<R>(1e-37)));
  RINGLET_UNROLL
  for (int i = 0; i < kHalvings; ++i) z = z / (R(1) + sqrt(fma(z, z, R(1))));
  const R acute = R(Scalar<R>(1 << kHalvings)) * z * arctangent_over(z * z);
  const R pi = R(Scalar<R>(3.14159265358979323846));
  const R turned = select(steep, fma(R(Scalar<R>(0.5)), pi, -acute), acute);
  return select(cosine < R(0), pi - turned, turned);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
