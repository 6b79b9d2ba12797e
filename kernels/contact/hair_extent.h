// Where the hair is, but for what was flung far away.
#pragma once
#include "kernels/contact/contact_data.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// Of the places that segments begin at [m].
struct HairExtent {
  float low[3], high[3];
  float segment_length;  // mean
  double segments;       // that there are, not flung far away

  RINGLET_KERNEL float longest() const {
    float size = 1e-3f;
    for (int c = 0; c < 3; ++c) size = max(size, high[c] - low[c]);
    return size;
  }
  RINGLET_KERNEL bool holds(Vector3<float> at) const {
    return low[0] <= at.x && at.x <= high[0] && low[1] <= at.y && at.y <= high[1] && low[2] <= at.z &&
           at.z <= high[2];
  }
};

// Leaves out what is several times as far from the middle as hair is on average. `places`: [particles].
template <class Backend, class T>
HairExtent find_extent(Backend& backend, const Place<T>* places, const std::int32_t* strand,
                       std::int32_t particles) {
  constexpr double kFar = 4;
  constexpr int kTimes = 3;
  constexpr double kLost = 1e30;  // [m]
  double middle[3] = {}, most = kLost;
  const auto away = [=] RINGLET_LAMBDA(std::int32_t p, const double* from) {
    double far = 0;
    for (int c = 0; c < 3; ++c) {
      const double apart = static_cast<double>((&places[p].x)[c]) - from[c],
                   size = apart < 0 ? -apart : apart;
      far = size < kLost ? max(far, size) : kLost;  // what is not a number is lost too
    }
    return far;
  };
  struct Near {
    double middle[3], most;
  };
  const auto sum = [&](const auto& values) {
    const Near near{{middle[0], middle[1], middle[2]}, most};
    return backend.sum("hair extent", particles, [=] RINGLET_LAMBDA(std::int32_t p) {
      return strand[p] >= 0 && away(p, near.middle) < near.most ? static_cast<double>(values(p)) : 0.0;
    });
  };
  double segments = 0;
  for (int k = 0; k < kTimes; ++k) {
    segments = sum([=] RINGLET_LAMBDA(std::int32_t) { return 1.0; });
    if (segments == 0) return {};
    double mean[3];
    for (int c = 0; c < 3; ++c)
      mean[c] = sum([=] RINGLET_LAMBDA(std::int32_t p) { return (&places[p].x)[c]; }) / segments;
    const Near centre{{mean[0], mean[1], mean[2]}, 0};
    const double far = sum([=] RINGLET_LAMBDA(std::int32_t p) { return away(p, centre.middle); }) / segments;
    for (int c = 0; c < 3; ++c) middle[c] = mean[c];
    most = max(kFar * far, 1e-3);
  }
  HairExtent extent{};
  const Near near{{middle[0], middle[1], middle[2]}, most};
  for (int c = 0; c < 3; ++c) {
    const auto furthest = [&](double sign) {
      return static_cast<float>(
          sign * backend.largest("hair extent", particles, -1e30, [=] RINGLET_LAMBDA(std::int32_t p) {
            return strand[p] >= 0 && away(p, near.middle) < near.most
                       ? sign * static_cast<double>((&places[p].x)[c])
                       : -1e30;
          }));
    };
    extent.low[c] = furthest(-1), extent.high[c] = furthest(1);
  }
  const double total = sum([=] RINGLET_LAMBDA(std::int32_t p) {
    const T size = length(vector_of(places[p + 1]) - vector_of(places[p]));
    return size < T(1e3) ? size : T(0);  // 0 also for what is not a number
  });
  extent.segment_length = max(static_cast<float>(total / segments), 1e-6f);
  extent.segments = segments;
  return extent;
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
