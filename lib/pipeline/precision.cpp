#include "pipeline/precision.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/log.h"
#include "kernels/strand/strand_batch.h"

namespace ringlet::pipeline {

using kernels::kCouplings;

void refuse_stiff_in_float(const scene::Scene& scene, std::span<const float> scaled) {
  static constexpr const char* kNames[kCouplings] = {"edge", "bend", "twist", "integrity", "angular"};
  const scene::Stiffness& s = scene.model.stiffness;
  double most[kCouplings] = {s.edge, s.bend, s.twist, s.integrity, s.angular};
  if (!scaled.empty()) {  // the grooms' curves have the last word
    std::fill(std::begin(most), std::end(most), 0.0);
    for (std::size_t i = 0; i < scaled.size(); ++i)
      most[i % kCouplings] = std::max(most[i % kCouplings], static_cast<double>(scaled[i]));
  }
  for (int k = 0; k < kCouplings; ++k)
    if (most[k] > kStiffestInFloat)
      throw Error(ErrorKind::kInput, fmt::format("{}#/model/stiffness/{}", scene.file.string(), kNames[k]),
                  fmt::format("is {:.3g}{}, expected at most {:g} in single precision", most[k],
                              scaled.empty() ? "" : " where a groom's curve scales it", kStiffestInFloat),
                  "run it with --precision double, or make it softer: hair keeps its length by inextensible");
}

void hold_lengths_as_float_can(scene::Scene& scene, std::int32_t particles) {
  const double finest = kFinestStrainInFloat * (particles - 1);
  if (!scene.effects.inextensible || scene.effects.inextensible->tolerance >= finest) return;
  log_warning_once(
      fmt::format("{}#/effects/inextensible/tolerance: {:g} is finer than single precision tells lengths on "
                  "strands of {} "
                  "particles; they are held to {:.3g} (--precision double holds them)",
                  scene.file.string(), scene.effects.inextensible->tolerance, particles, finest));
  scene.effects.inextensible->tolerance = finest;
}

}  // namespace ringlet::pipeline
