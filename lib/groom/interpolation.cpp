#include "groom/interpolation.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/error.h"
#include "groom/root_tree.h"

namespace ringlet::groom {

// ---- Guides ---------------------------------------------------------------------------------------------

namespace {

const Vec3& root_of(const Strands& strands, std::size_t strand) {
  return strands.points[strands.offsets[strand]];
}

[[noreturn]] void no_such_guides(const std::string& pointer, const std::string& found,
                                 const std::string& expected) {
  throw Error(ErrorKind::kInput, pointer, "found " + found + ", expected " + expected,
              "guides are strands of the groom itself");
}

std::vector<unsigned char> farthest_apart(const Strands& strands, std::size_t count) {
  const std::size_t size = strands.size();
  Vec3 centre = Vec3::Zero();
  for (std::size_t s = 0; s < size; ++s) centre += root_of(strands, s) / static_cast<double>(size);
  std::vector<double> distance(size);  // squared, to the nearest chosen
  for (std::size_t s = 0; s < size; ++s) distance[s] = (root_of(strands, s) - centre).squaredNorm();
  std::size_t next = std::min_element(distance.begin(), distance.end()) - distance.begin();
  std::fill(distance.begin(), distance.end(), std::numeric_limits<double>::infinity());
  std::vector<unsigned char> chosen(size, 0);
  for (std::size_t n = 0; n < count; ++n) {
    chosen[next] = 1;
    distance[next] = -1;  // roots that coincide come after all others, but they come
    const Vec3 root = root_of(strands, next);
    for (std::size_t s = 0; s < size; ++s)
      if (!chosen[s]) distance[s] = std::min(distance[s], (root_of(strands, s) - root).squaredNorm());
    next = std::max_element(distance.begin(), distance.end()) - distance.begin();
  }
  return chosen;
}

std::vector<unsigned char> of_group(const Strands& strands, const scene::Interpolate& interpolate) {
  std::vector<unsigned char> chosen(strands.size(), 0);
  for (std::size_t s = 0; s < chosen.size(); ++s)
    chosen[s] = strands.group_names[strands.groups[s]] == *interpolate.group;
  if (std::find(chosen.begin(), chosen.end(), 1) != chosen.end()) return chosen;
  no_such_guides(
      interpolate.pointer + "/group", fmt::format("\"{}\"", *interpolate.group),
      fmt::format("a group of the groom with strands in it: {}", fmt::join(strands.group_names, ", ")));
}

}  // namespace

std::vector<unsigned char> choose_guides(const Strands& strands, const scene::Interpolate& interpolate) {
  const auto size = static_cast<std::int64_t>(strands.size());
  if (interpolate.group) return of_group(strands, interpolate);
  if (interpolate.count > 0) {
    if (interpolate.count > size)
      no_such_guides(interpolate.pointer + "/count", fmt::format("{}", interpolate.count),
                     fmt::format("at most the groom's {} strands", size));
    return farthest_apart(strands, static_cast<std::size_t>(interpolate.count));
  }
  std::vector<unsigned char> chosen(strands.size(), 0);
  for (std::size_t k = 0; k < interpolate.strands.size(); ++k) {
    const int strand = interpolate.strands[k];
    if (strand >= size)
      no_such_guides(fmt::format("{}/strands/{}", interpolate.pointer, k), fmt::format("{}", strand),
                     fmt::format("a strand of the groom, 0 to {}", size - 1));
    chosen[strand] = 1;
  }
  return chosen;
}

Strands select(const Strands& strands, std::span<const unsigned char> marks) {
  Strands kept;
  kept.group_names = strands.group_names;
  for (std::size_t s = 0; s < strands.size(); ++s) {
    if (!marks[s]) continue;
    const auto begin = strands.offsets[s], end = strands.offsets[s + 1];
    kept.points.insert(kept.points.end(), strands.points.begin() + begin, strands.points.begin() + end);
    if (!strands.widths.empty())
      kept.widths.insert(kept.widths.end(), strands.widths.begin() + begin, strands.widths.begin() + end);
    if (!strands.roots.empty()) kept.roots.push_back(strands.roots[s]);
    if (!strands.groups.empty()) kept.groups.push_back(strands.groups[s]);
    kept.offsets.push_back(static_cast<std::int64_t>(kept.points.size()));
  }
  return kept;
}

// ---- Binding --------------------------------------------------------------------------------------------

namespace {

template <class Points>
auto points_of(Points& points, const std::vector<std::int64_t>& offsets, std::size_t strand) {
  return std::span(points).subspan(offsets[strand], offsets[strand + 1] - offsets[strand]);
}

// Arc length from the root at each point [m].
std::vector<double> arc_lengths(std::span<const Vec3> points) {
  std::vector<double> at(points.size(), 0.0);
  for (std::size_t i = 1; i < points.size(); ++i) at[i] = at[i - 1] + (points[i] - points[i - 1]).norm();
  return at;
}

}  // namespace

void Interpolation::append(const Strands& strands, std::span<const unsigned char> is_guide) {
  const std::int64_t base = offsets_.back();
  for (std::size_t s = 0; s < strands.size(); ++s) {
    guide_.resize(guide_.size() + neighbours_, -1);
    weight_.resize(guide_.size(), 0.0);
    if (is_guide[s]) {
      const auto begin = strands.points.begin() + strands.offsets[s],
                 end = strands.points.begin() + strands.offsets[s + 1];
      guide_rest_.points.insert(guide_rest_.points.end(), begin, end);
      guide_rest_.offsets.push_back(static_cast<std::int64_t>(guide_rest_.points.size()));
      guide_.end()[-neighbours_] = static_cast<std::int32_t>(guides_.size());
      weight_.end()[-neighbours_] = 1;
      guides_.push_back(static_cast<std::int32_t>(offsets_.size() - 1));
    }
    offsets_.push_back(base + strands.offsets[s + 1]);
  }
  rest_.insert(rest_.end(), strands.points.begin(), strands.points.end());
  places_.resize(rest_.size() * neighbours_, Place{0, 0});
}

void Interpolation::follow_nearest(std::size_t first_strand, std::size_t first_guide, int neighbours) {
  RootCloud cloud;
  for (std::size_t g = first_guide; g < guides_.size(); ++g)
    cloud.roots.push_back(guide_rest_.points[guide_rest_.offsets[g]]);
  const RootTree tree(3, cloud);
  const std::size_t wanted = std::min<std::size_t>(neighbours, cloud.roots.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(first_strand, strands(), 64), [&](const auto& range) {
    std::vector<std::uint32_t> nearest(wanted);
    std::vector<double> squared(wanted);
    for (std::size_t s = range.begin(); s < range.end(); ++s) {
      std::int32_t* const guide = guide_.data() + s * neighbours_;
      double* const weight = weight_.data() + s * neighbours_;
      if (guide[0] >= 0) continue;  // follows itself
      tree.knnSearch(rest_[offsets_[s]].data(), wanted, nearest.data(), squared.data());
      const bool coincides = !(squared[0] > 0);  // with a guide's root: it follows that one alone
      double sum = 0;
      for (std::size_t k = 0; k < wanted; ++k) {
        guide[k] = static_cast<std::int32_t>(first_guide + nearest[k]);
        weight[k] = coincides ? (k == 0 ? 1.0 : 0.0) : squared[0] / squared[k];
        sum += weight[k];
      }
      for (std::size_t k = 0; k < wanted; ++k) weight[k] /= sum;
    }
  });
}

void Interpolation::find_places(std::size_t first_strand, std::size_t first_guide) {
  std::vector<std::vector<double>> lengths;  // along the guides from the first on
  for (std::size_t g = first_guide; g < guides_.size(); ++g)
    lengths.push_back(arc_lengths(points_of(guide_rest_.points, guide_rest_.offsets, g)));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(first_strand, strands(), 64), [&](const auto& range) {
    for (std::size_t s = range.begin(); s < range.end(); ++s) {
      const std::vector<double> own = arc_lengths(points_of(rest_, offsets_, s));
      for (int k = 0; k < neighbours_ && guide_[s * neighbours_ + k] >= 0; ++k) {
        const std::int32_t guide = guide_[s * neighbours_ + k];
        const std::vector<double>& along = lengths[guide - first_guide];
        std::size_t below = 0;
        for (std::size_t i = 0; i < own.size(); ++i) {
          while (below + 2 < along.size() && along[below + 1] <= own[i]) ++below;
          const double span = below + 1 < along.size() ? along[below + 1] - along[below] : 0;
          const double on = span > 0 ? std::clamp((own[i] - along[below]) / span, 0.0, 1.0) : 0;
          places_[(offsets_[s] + i) * neighbours_ + k] = {
              static_cast<std::int32_t>(guide_rest_.offsets[guide] + below), static_cast<float>(on)};
        }
      }
    }
  });
}

void Interpolation::add(const Strands& strands, std::span<const unsigned char> is_guide, int neighbours) {
  const std::size_t first_strand = this->strands(), first_guide = guides_.size();
  append(strands, is_guide);
  follow_nearest(first_strand, first_guide, neighbours);
  find_places(first_strand, first_guide);
}

// ---- Following ------------------------------------------------------------------------------------------

namespace {

// How each particle of a guide has turned since the rest pose: the root frame's rotation carried along the
// strand by the least rotations that take each segment's direction at rest to the present one; a particle has
// the mean of its two segments'.
void turns_of_guide(std::span<const Vec3> rest, std::span<const Vec3> now, const Mat3& root,
                    std::span<Mat3> out) {
  Quat turn(root), before = turn;
  for (std::size_t i = 0; i < rest.size(); ++i) {
    const Quat previous = turn;
    if (i + 1 < rest.size()) {
      const Vec3 at_rest = turn * (rest[i + 1] - rest[i]), at_present = now[i + 1] - now[i];
      if (at_rest.squaredNorm() > 0 && at_present.squaredNorm() > 0)
        turn = (Quat::FromTwoVectors(at_rest, at_present) * turn).normalized();
    }
    before = i == 0 ? turn : previous;
    const double side = before.dot(turn) < 0 ? -1 : 1;
    const Eigen::Vector4d mean = before.coeffs() + side * turn.coeffs();
    out[i] = Quat(mean).normalized().toRotationMatrix();
  }
}

}  // namespace

std::vector<Mat3> Interpolation::turns(const GuidesNow& now) const {
  std::vector<Mat3> turns(guide_rest_.points.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, guides_.size(), 64), [&](const auto& range) {
    for (std::size_t g = range.begin(); g < range.end(); ++g) {
      const std::span<Mat3> out = points_of(turns, guide_rest_.offsets, g);
      turns_of_guide(points_of(guide_rest_.points, guide_rest_.offsets, g),
                     now.points.subspan(guide_rest_.offsets[g], out.size()), now.rotation[g], out);
    }
  });
  return turns;
}

template <class T, class At>
T Interpolation::mix(std::size_t strand, std::size_t particle, T zero, const At& at) const {
  T sum = zero;
  for (int k = 0; k < neighbours_ && guide_[strand * neighbours_ + k] >= 0; ++k) {
    const Place place = places_[particle * neighbours_ + k];
    T value = at(place.particle);
    const double share = place.share;
    if (share > 0) value += share * (at(place.particle + 1) - value);
    sum += weight_[strand * neighbours_ + k] * value;
  }
  return sum;
}

std::int64_t Interpolation::own_particles(std::size_t strand) const {
  const std::int32_t first = guide_[strand * neighbours_];
  return guides_[first] == static_cast<std::int32_t>(strand) ? guide_rest_.offsets[first] : -1;
}

void Interpolation::follow(const GuidesNow& now, std::span<const Vec3> roots, std::span<Vec3> out) const {
  const std::vector<Mat3> turn = turns(now);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, strands(), 64), [&](const auto& range) {
    for (std::size_t s = range.begin(); s < range.end(); ++s) {
      const auto begin = static_cast<std::size_t>(offsets_[s]),
                 end = static_cast<std::size_t>(offsets_[s + 1]);
      if (const std::int64_t own = own_particles(s); own >= 0) {
        std::copy_n(now.points.begin() + own, end - begin, out.begin() + begin);
        continue;
      }
      for (std::size_t i = begin; i < end; ++i)
        out[i] = mix(s, i, Vec3(Vec3::Zero()), [&](std::int32_t p) -> Vec3 {
          return now.points[p] + turn[p] * (rest_[i] - guide_rest_.points[p]);
        });
      const Vec3 shift = roots[s] - out[begin];
      for (std::size_t i = begin; i < end; ++i) out[i] += shift;
      out[begin] = roots[s];
    }
  });
}

void Interpolation::blend(std::span<const float> of_guides, std::span<float> out) const {
  for (std::size_t s = 0; s < strands(); ++s) {
    const std::int64_t own = own_particles(s);
    for (std::int64_t i = offsets_[s]; i < offsets_[s + 1]; ++i) {
      const auto at = [&](std::int64_t p) { return static_cast<double>(of_guides[p]); };
      out[i] = own >= 0 ? of_guides[own + i - offsets_[s]] : static_cast<float>(mix(s, i, 0.0, at));
    }
  }
}

std::size_t Interpolation::bytes() const {
  return offsets_.size() * sizeof offsets_[0] + rest_.size() * sizeof rest_[0] +
         guide_rest_.offsets.size() * sizeof offsets_[0] + guide_rest_.points.size() * sizeof rest_[0] +
         (guides_.size() + guide_.size()) * sizeof guide_[0] + weight_.size() * sizeof weight_[0] +
         places_.size() * sizeof places_[0];
}

}  // namespace ringlet::groom
