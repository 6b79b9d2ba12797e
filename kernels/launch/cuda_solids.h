// Solids on the CUDA device: copies of what the host's views point at, refreshed no more often than needed.
#pragma once
#include <algorithm>

#include "kernels/backend/device_buffer.h"

namespace ringlet::kernels {

class CudaLevelSet {
 public:
  void upload(const LevelSetView& host, cudaStream_t stream) {
    const std::size_t tiles = std::size_t(host.tile_count[0]) * host.tile_count[1] * host.tile_count[2];
    const std::span tile(host.tile, tiles);
    const std::int32_t last = tiles == 0 ? -1 : std::max(-1, *std::ranges::max_element(tile));
    const std::size_t voxels = (std::size_t(last) + 1) * 512;
    tile_.upload(tile, stream);
    distance_.upload({host.distance, voxels}, stream);
    triangle_.upload({host.triangle, voxels}, stream);
  }
  LevelSetView view(LevelSetView host) const {
    host.tile = tile_.data(), host.distance = distance_.data(), host.triangle = triangle_.data();
    return host;
  }
  std::size_t bytes() const { return tile_.bytes() + distance_.bytes() + triangle_.bytes(); }

 private:
  DeviceBuffer<std::int32_t> tile_;
  DeviceBuffer<float> distance_;
  DeviceBuffer<std::int32_t> triangle_;
};

class CudaSolid {
 public:
  // The view with the device's pointers.
  SolidView upload(const SolidView& host, std::int64_t interval, cudaStream_t stream) {
    const bool moving = deforms(host), moved = deforms(last_);
    // A deforming solid's memory may hold something else in another interval although its address is the
    // same.
    const bool stale = !same_surface(host) || ((moving || moved) && interval != interval_);
    if (stale) upload_surface(host, stream);
    if (stale || moving || moved || host.vertices != last_.vertices)
      vertices_.upload({host.vertices, 3 * vertex_count_}, stream);
    if (moving) vertices_before_.upload({host.vertices_before, 3 * vertex_count_}, stream);
    if (host.folded_tiles != nullptr && (stale || moving || moved)) upload_folds(host, stream);
    last_ = host, interval_ = interval;
    return view(host);
  }
  std::size_t bytes() const {
    return level_set_[0].bytes() + level_set_[1].bytes() + triangles_.bytes() + neighbours_.bytes() +
           vertices_.bytes() + vertices_before_.bytes() + bin_start_.bytes() + bin_triangle_.bytes() +
           folded_tiles_.bytes();
  }

 private:
  static bool two_level_sets(const SolidView& s) {
    return s.level_set[0].distance != s.level_set[1].distance;
  }
  static bool deforms(const SolidView& s) { return two_level_sets(s) || s.vertices != s.vertices_before; }
  bool same_surface(const SolidView& s) const {
    const auto same_set = [](const LevelSetView& a, const LevelSetView& b) {
      return a.tile == b.tile && a.distance == b.distance && a.triangle == b.triangle;
    };
    return same_set(s.level_set[0], last_.level_set[0]) && same_set(s.level_set[1], last_.level_set[1]) &&
           s.triangles == last_.triangles && s.neighbours == last_.neighbours &&
           s.triangle_count == last_.triangle_count;
  }
  void upload_surface(const SolidView& host, cudaStream_t stream) {
    level_set_[0].upload(host.level_set[0], stream);
    if (two_level_sets(host)) level_set_[1].upload(host.level_set[1], stream);
    const std::span triangles(host.triangles, 3 * std::size_t(host.triangle_count));
    triangles_.upload(triangles, stream);
    neighbours_.upload({host.neighbours, triangles.size()}, stream);
    vertex_count_ = triangles.empty() ? 0 : std::size_t(*std::ranges::max_element(triangles)) + 1;
  }
  void upload_folds(const SolidView& host, cudaStream_t stream) {
    const CrossingsView& crossings = host.crossings;
    const std::size_t bins = std::size_t(crossings.count[0]) * crossings.count[1];
    bin_start_.upload({crossings.start, bins + 1}, stream);
    bin_triangle_.upload({crossings.triangle, std::size_t(crossings.start[bins])}, stream);
    const std::int32_t* tiles = host.level_set[0].tile_count;
    folded_tiles_.upload({host.folded_tiles, std::size_t(tiles[0]) * tiles[1] * tiles[2]}, stream);
  }
  SolidView view(SolidView host) const {
    host.level_set[1] = level_set_[two_level_sets(host) ? 1 : 0].view(host.level_set[1]);
    host.level_set[0] = level_set_[0].view(host.level_set[0]);
    host.vertices_before = deforms(host) ? vertices_before_.data() : vertices_.data();
    host.vertices = vertices_.data();
    host.triangles = triangles_.data(), host.neighbours = neighbours_.data();
    if (host.folded_tiles == nullptr) return host;
    host.crossings.start = bin_start_.data(), host.crossings.triangle = bin_triangle_.data();
    host.folded_tiles = folded_tiles_.data();
    return host;
  }

  SolidView last_{};  // as the host had it
  std::int64_t interval_ = 0;
  CudaLevelSet level_set_[2];
  DeviceBuffer<std::int32_t> triangles_, neighbours_, bin_start_, bin_triangle_;
  DeviceBuffer<unsigned char> folded_tiles_;
  DeviceBuffer<float> vertices_, vertices_before_;
  std::size_t vertex_count_ = 0;
};

class CudaSolids {
 public:
  void upload(std::span<const SolidView> solids, std::int64_t interval, cudaStream_t stream) {
    solids_.resize(solids.size());
    std::vector<SolidView> views(solids.size());
    for (std::size_t k = 0; k < solids.size(); ++k) views[k] = solids_[k].upload(solids[k], interval, stream);
    views_.upload(views, stream);
  }
  const SolidView* views() const { return views_.data(); }
  std::int32_t count() const { return static_cast<std::int32_t>(views_.size()); }
  std::size_t bytes() const {
    std::size_t sum = views_.bytes();
    for (const CudaSolid& solid : solids_) sum += solid.bytes();
    return sum;
  }

 private:
  std::vector<CudaSolid> solids_;
  DeviceBuffer<SolidView> views_;
};

}  // namespace ringlet::kernels
