#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <cmath>

#include "core/error.h"
#include "core/log.h"
#include "groom/closest_triangle.h"
#include "groom/groom.h"

namespace ringlet::groom {

namespace {
Vec3 point_at(std::span<const Vec3> vertices, const Triangle& triangle, const Vec3& weights) {
  return weights[0] * vertices[triangle[0]] + weights[1] * vertices[triangle[1]] +
         weights[2] * vertices[triangle[2]];
}

// Right-handed orthonormal frame of a triangle: first edge, then in the plane, then the normal. A triangle
// that has collapsed keeps what it can of `fallback`: finite always.
Mat3 triangle_frame(std::span<const Vec3> vertices, const Triangle& triangle, const Mat3& fallback) {
  const Vec3& origin = vertices[triangle[0]];
  const Vec3 edge = vertices[triangle[1]] - origin, side = vertices[triangle[2]] - origin;
  const Vec3 area = edge.cross(side);
  const double edge_squared = edge.squaredNorm(), area_squared = area.squaredNorm();
  if (!(edge_squared > 0)) return fallback;
  Mat3 frame;
  frame.col(0) = edge * (1 / std::sqrt(edge_squared));
  if (area_squared > 1e-24 * edge_squared * side.squaredNorm()) {
    frame.col(2) = area * (1 / std::sqrt(area_squared));
  } else {  // no area: the old normal made perpendicular to the edge, or any that is
    const Vec3 normal = fallback.col(2) - fallback.col(2).dot(frame.col(0)) * frame.col(0);
    frame.col(2) = normal.norm() > 1e-6 ? Vec3(normal.normalized()) : Vec3(frame.col(0).unitOrthogonal());
  }
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

// How far the stored coordinates may lie from the root beyond the triangle's own nearest point, in longest
// edges.
constexpr double kStoredTolerance = 0.01;

ClosestPoint site_of_stored(const Vec3& root, const RootSite& stored, const Scalp& rest, bool& trusted) {
  const Triangle& triangle = rest.triangles[stored.triangle];
  const Vec3 &a = rest.vertices[triangle[0]], &b = rest.vertices[triangle[1]],
             &c = rest.vertices[triangle[2]];
  ClosestPoint site = closest_on_triangle(root, a, b, c);
  site.triangle = stored.triangle;
  const Vec3 point = point_at(rest.vertices, triangle, stored.barycentric);
  const double longest =
      std::sqrt(std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()}));
  const double distance = (root - point).norm();
  trusted = distance <= std::sqrt(site.squared_distance) + kStoredTolerance * longest;
  if (!trusted) return site;
  return {stored.triangle, stored.barycentric, point, distance * distance};
}

void check_stored(const Strands& strands, const Scalp& rest, const scene::Groom& desc) {
  const std::string where = desc.pointer + "/attach";
  if (strands.roots.empty()) {
    throw Error(ErrorKind::kInput, where, fmt::format("groom \"{}\" stores no roots", desc.name),
                "use \"nearest\", or name its .tfxskin");
  }
  for (std::size_t strand = 0; strand < strands.size(); ++strand) {
    const std::int32_t triangle = strands.roots[strand].triangle;
    if (triangle >= 0 && static_cast<std::size_t>(triangle) < rest.triangles.size()) continue;
    throw Error(
        ErrorKind::kInput, where,
        fmt::format("groom \"{}\": strand {} is rooted on triangle {}, the head has triangles 0 to {}",
                    desc.name, strand, triangle, rest.triangles.size() - 1),
        "the roots were stored for another mesh");
  }
}

std::vector<ClosestPoint> find_sites(const Strands& strands, const Scalp& rest, const scene::Groom& desc) {
  const ClosestTriangle nearest(rest.vertices, rest.triangles);
  if (nearest.empty()) {
    throw Error(ErrorKind::kInput, desc.pointer,
                fmt::format("the head has no triangle with an area to hold groom \"{}\"", desc.name));
  }
  const bool stored = desc.attach == scene::Attach::kStored;
  if (stored) check_stored(strands, rest, desc);
  std::vector<ClosestPoint> sites(strands.size());
  std::atomic<std::size_t> distrusted = 0, degenerate = 0;
  tbb::parallel_for(std::size_t{0}, strands.size(), [&](std::size_t strand) {
    const Vec3& root = strands.points[strands.offsets[strand]];
    if (stored) {
      const RootSite& site = strands.roots[strand];
      const Triangle& v = rest.triangles[site.triangle];
      if (!is_degenerate(rest.vertices[v[0]], rest.vertices[v[1]], rest.vertices[v[2]])) {
        bool trusted;
        sites[strand] = site_of_stored(root, site, rest, trusted);
        distrusted += !trusted;
        return;
      }
      ++degenerate;
    }
    sites[strand] = nearest.find(root);
  });
  if (distrusted > 0) {
    log_warning(
        fmt::format("groom \"{}\": the stored coordinates of {} of {} strands do not lie at their roots; the "
                    "nearest point of the stored triangle is used",
                    desc.name, distrusted.load(), sites.size()));
  }
  if (degenerate > 0) {
    log_warning(fmt::format(
        "groom \"{}\": {} strands are rooted on triangles without area; the nearest other triangle is "
        "used",
        desc.name, degenerate.load()));
  }
  return sites;
}

void check_distances(const std::vector<ClosestPoint>& sites, const scene::Groom& desc) {
  std::size_t worst = 0, beyond = 0;
  for (std::size_t strand = 0; strand < sites.size(); ++strand) {
    beyond += std::sqrt(sites[strand].squared_distance) > desc.attach_distance;
    if (sites[strand].squared_distance > sites[worst].squared_distance) worst = strand;
  }
  if (beyond == 0) return;
  throw Error(
      ErrorKind::kInput, desc.pointer,
      fmt::format(
          "groom \"{}\": the root of strand {} is {:.4g} m from the head, at most {:.4g} m is allowed; so "
          "are {} of {} strands",
          desc.name, worst, std::sqrt(sites[worst].squared_distance), desc.attach_distance, beyond,
          sites.size()),
      "check the units and up axis of groom and head, or raise attach_distance");
}
}  // namespace

Attachment Attachment::to_head(const Strands& strands, const Scalp& rest, const scene::Groom& desc) {
  const std::vector<ClosestPoint> sites = find_sites(strands, rest, desc);
  check_distances(sites, desc);
  Attachment attachment;
  for (std::size_t strand = 0; strand < sites.size(); ++strand) {
    const Triangle& triangle = rest.triangles[sites[strand].triangle];
    attachment.sites_.push_back({sites[strand].triangle, sites[strand].barycentric});
    attachment.triangles_.push_back(triangle);
    attachment.rest_frame_.push_back(triangle_frame(rest.vertices, triangle, Mat3::Identity()));
    attachment.rest_point_.push_back(point_at(rest.vertices, triangle, sites[strand].barycentric));
    attachment.rest_root_.push_back(desc.root_offset == scene::RootOffset::kSnap
                                        ? attachment.rest_point_.back()
                                        : strands.points[strands.offsets[strand]]);
  }
  return attachment;
}

void Attachment::place(Strands& strands) const {
  for (std::size_t s = 0; s < strands.size(); ++s) {
    const Vec3 shift = rest_root_[s] - strands.points[strands.offsets[s]];
    for (auto i = strands.offsets[s]; i < strands.offsets[s + 1]; ++i) strands.points[i] += shift;
    strands.points[strands.offsets[s]] = rest_root_[s];
  }
}

Attachment Attachment::select(std::span<const unsigned char> marks) const {
  Attachment chosen;
  for (std::size_t s = 0; s < sites_.size(); ++s) {
    if (!marks[s]) continue;
    chosen.sites_.push_back(sites_[s]);
    chosen.triangles_.push_back(triangles_[s]);
    chosen.rest_frame_.push_back(rest_frame_[s]);
    chosen.rest_point_.push_back(rest_point_[s]);
    chosen.rest_root_.push_back(rest_root_[s]);
  }
  return chosen;
}

void Attachment::pose(std::span<const Vec3> vertices, std::span<Pose> out) const {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, sites_.size(), 256), [&](const auto& range) {
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Mat3 frame = triangle_frame(vertices, triangles_[i], rest_frame_[i]);
      const Vec3 point = point_at(vertices, triangles_[i], sites_[i].barycentric);
      const Vec3 offset = rest_root_[i] - rest_point_[i];
      // Unmoved vertices give the same bits again: then the pose is the identity and the rest root, not
      // nearly so.
      out[i].rotation = frame == rest_frame_[i] ? Mat3::Identity() : Mat3(frame * rest_frame_[i].transpose());
      out[i].position = rest_root_[i] + ((point - rest_point_[i]) + (out[i].rotation * offset - offset));
    }
  });
}

}  // namespace ringlet::groom
