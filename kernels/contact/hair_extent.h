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

template <class Backend, class T>
class ExtentFinder {
 public:
  // Leaves out what is several times as far from the middle as hair is on average. `places`: [particles].
  HairExtent find(Backend& backend, const Place<T>* places, const std::int32_t* strand,
                  std::int32_t particles) {
    Near near{{}, kLost};
    double segments = 0;
    for (int k = 0; k < kTimes; ++k) {
      fold<4>(backend, particles, 0, [=] RINGLET_LAMBDA(std::int32_t p, double* sum) {
        if (strand[p] < 0 || !near.holds(places[p])) return;
        sum[0] += 1;
        for (int c = 0; c < 3; ++c) sum[1 + c] += static_cast<double>((&places[p].x)[c]);
      });
      segments = sum(backend, 0);
      if (segments == 0) return {};
      Near next{};
      for (int c = 0; c < 3; ++c) next.middle[c] = sum(backend, 1 + c) / segments;
      fold<1>(backend, particles, 0, [=] RINGLET_LAMBDA(std::int32_t p, double* sum) {
        if (strand[p] >= 0 && near.holds(places[p])) sum[0] += next.away(places[p]);
      });
      next.most = max(kFar * sum(backend, 0) / segments, 1e-3);
      near = next;
    }
    return about(backend, places, strand, particles, near, segments);
  }

  std::size_t bytes() const { return partial_.bytes(); }

 private:
  static constexpr double kFar = 4;
  static constexpr int kTimes = 3;
  static constexpr double kLost = 1e30;  // [m]

  struct Near {
    double middle[3], most;

    // Along the axis where it is farthest; what is not a number is lost.
    RINGLET_KERNEL double away(const Place<T>& place) const {
      double far = 0;
      for (int c = 0; c < 3; ++c) {
        const double apart = static_cast<double>((&place.x)[c]) - middle[c],
                     size = apart < 0 ? -apart : apart;
        far = size < kLost ? max(far, size) : kLost;
      }
      return far;
    }
    RINGLET_KERNEL bool holds(const Place<T>& place) const { return away(place) < most; }
  };

  HairExtent about(Backend& backend, const Place<T>* places, const std::int32_t* strand,
                   std::int32_t particles, const Near& near, double segments) {
    // Highest places, lowest ones' negatives.
    fold<6>(backend, particles, -kLost, [=] RINGLET_LAMBDA(std::int32_t p, double* most) {
      if (strand[p] < 0 || !near.holds(places[p])) return;
      for (int c = 0; c < 3; ++c) {
        const auto x = static_cast<double>((&places[p].x)[c]);
        most[c] = max(most[c], x), most[3 + c] = max(most[3 + c], -x);
      }
    });
    HairExtent extent{};
    for (int c = 0; c < 3; ++c) {
      extent.low[c] = -static_cast<float>(largest(backend, 3 + c));
      extent.high[c] = static_cast<float>(largest(backend, c));
    }
    fold<1>(backend, particles, 0, [=] RINGLET_LAMBDA(std::int32_t p, double* sum) {
      if (strand[p] < 0 || !near.holds(places[p])) return;
      const T size = length(vector_of(places[p + 1]) - vector_of(places[p]));
      sum[0] += size < T(1e3) ? static_cast<double>(size) : 0.0;  // 0 also for what is not a number
    });
    extent.segment_length = max(static_cast<float>(sum(backend, 0) / segments), 1e-6f);
    extent.segments = segments;
    return extent;
  }

  // Calls add(p, values) for all particles: run after run of them, with values of the run's own.
  template <int kValues, class Add>
  void fold(Backend& backend, std::int32_t particles, double from, const Add& add) {
    constexpr std::int32_t kRun = 512, kRunChunk = 8;
    const std::int32_t runs = (particles + kRun - 1) / kRun;
    runs_ = runs;
    partial_.resize(static_cast<std::size_t>(kValues) * runs);
    double* partial = partial_.data();
    backend.parallel_for(
        "hair extent", runs,
        [=] RINGLET_LAMBDA(std::int32_t run) {
          double values[kValues];
          for (double& value : values) value = from;
          const std::int32_t end = particles - run * kRun < kRun ? particles : (run + 1) * kRun;
          for (std::int32_t p = run * kRun; p < end; ++p) add(p, values);
          for (int k = 0; k < kValues; ++k) partial[k * runs + run] = values[k];
        },
        kRunChunk);
  }
  double sum(Backend& backend, int value) const {
    const double* partial = partial_.data() + static_cast<std::int64_t>(value) * runs_;
    return backend.sum("hair extent", runs_, [=] RINGLET_LAMBDA(std::int32_t run) { return partial[run]; });
  }
  double largest(Backend& backend, int value) const {
    const double* partial = partial_.data() + static_cast<std::int64_t>(value) * runs_;
    return backend.largest("hair extent", runs_, -kLost,
                           [=] RINGLET_LAMBDA(std::int32_t run) { return partial[run]; });
  }

  std::int32_t runs_ = 0;
  typename Backend::template Buffer<double> partial_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
