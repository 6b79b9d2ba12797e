#include "effects/solids/penetration.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "kernels/solid/response.h"

namespace ringlet::effects {
namespace {

// How far outside a moved point comes to rest [m]: past the rounding of single precision, nothing one could
// see.
constexpr double kClearance = 2e-5;

// Strands shorter than this [m] cannot be deep in a solid that their root is not; their segments are no
// longer than the rounding of contacts.
constexpr double kShortest = 4e-4;

// The solid as a strand that grows on one of its triangles meets it.
struct Surface {
  const kernels::SolidView& solid;
  kernels::Patch skin;

  Surface(const kernels::SolidView& view, std::int32_t triangle, const Vec3& root) : solid(view) {
    if (triangle >= 0) skin = {triangle, kernels::is_covered(solid, triangle, local(root))};
  }

  kernels::Vector3<double> local(const Vec3& x) const {
    const Vec3 away = x - Vec3(solid.translation[0], solid.translation[1], solid.translation[2]);
    return kernels::rotate_back(solid.rotation, kernels::Vector3<double>{away.x(), away.y(), away.z()});
  }
  kernels::SurfaceSample<double> at(const Vec3& x) const {
    return kernels::sample_surface(solid, local(x), skin);
  }
  Vec3 normal(const kernels::SurfaceSample<double>& sample) const {
    const kernels::Vector3<double> n = kernels::rotate(solid.rotation, sample.normal);
    return {n.x, n.y, n.z};
  }
};

// Out along the normal; again where another part of the surface is in the way.
void push_out(const Surface& surface, Vec3& x) {
  constexpr int kTries = 8;
  for (int i = 0; i < kTries; ++i) {
    const auto sample = surface.at(x);
    if (!sample.exact || sample.distance >= 0.5 * kClearance) return;
    x += (kClearance - sample.distance) * surface.normal(sample);
  }
}

// Segments too, as the contact stage will see them: where one dips deeper than that stage allows, both ends
// move.
void push_out_segments(const Surface& surface, std::span<Vec3> strand) {
  const double voxel = surface.solid.level_set[0].voxel_size, allowed = 0.9 * kernels::kChordVoxels * voxel;
  for (std::size_t i = 1; i + 1 < strand.size(); ++i) {
    Vec3 &a = strand[i], &b = strand[i + 1];
    const int pieces = static_cast<int>(std::min(64.0, (b - a).norm() / (2 * voxel))) + 1;
    for (int k = 1; k < pieces; ++k) {
      const double t = static_cast<double>(k) / pieces;
      const auto sample = surface.at(a + t * (b - a));
      const double depth = -sample.distance - allowed;
      if (depth <= 0 || !sample.exact) continue;
      const Vec3 push = depth / ((1 - t) * (1 - t) + t * t) * surface.normal(sample);
      a += (1 - t) * push, b += t * push;
    }
  }
}

void push_out_strand(const Surface& surface, std::span<Vec3> strand) {
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    push_out_segments(surface, strand);
    for (std::size_t i = 1; i < strand.size(); ++i) push_out(surface, strand[i]);
  }
}

struct StrandReport {
  std::int64_t inside = 0;
  double deepest = 0;
  bool buried = false;
  bool too_short = false;
};

StrandReport inspect(const Surface& surface, std::span<const Vec3> points) {
  StrandReport report;
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    length += (points[i] - points[i - 1]).norm();
    const double distance = surface.at(points[i]).distance;
    if (distance >= 0) continue;
    ++report.inside;
    report.deepest = std::max(report.deepest, -distance);
  }
  report.buried = -surface.at(points[0]).distance > length;
  report.too_short = length < kShortest;
  return report;
}

}  // namespace

PenetrationReport resolve_penetration(scene::Penetration policy, const kernels::SolidView& solid,
                                      std::span<const std::int64_t> offsets, std::span<Vec3> points,
                                      std::span<std::int32_t> skin, std::span<unsigned char> prune) {
  const std::size_t strands = offsets.size() - 1;
  std::vector<StrandReport> reports(strands);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, strands, 64), [&](const auto& range) {
    for (std::size_t s = range.begin(); s < range.end(); ++s) {
      const std::span<Vec3> strand = points.subspan(offsets[s], offsets[s + 1] - offsets[s]);
      const Surface surface(solid, skin[s], strand[0]);
      reports[s] = inspect(surface, strand);
      if (reports[s].buried || reports[s].too_short) {
        skin[s] = kernels::kIgnoresHome;
      } else if (policy == scene::Penetration::kPushOut) {
        push_out_strand(surface, strand);
      } else if (policy == scene::Penetration::kPrune && reports[s].inside > 0) {
        prune[s] = 1;
      }
    }
  });
  PenetrationReport total;
  for (const StrandReport& report : reports) {
    total.inside += report.inside;
    total.strands += report.inside > 0;
    total.deepest = std::max(total.deepest, report.deepest);
    total.buried += report.buried;
  }
  return total;
}

}  // namespace ringlet::effects
