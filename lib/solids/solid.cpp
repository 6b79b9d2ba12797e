#include "solids/solid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/error.h"
#include "core/log.h"
#include "core/timer.h"
#include "solids/folds.h"
#include "solids/level_set_cache.h"
#include "solids/level_set_queue.h"
#include "solids/surface.h"

namespace ringlet::solids {
namespace {

using Motion = AnimatedMesh::Motion;
using Vertices = std::vector<Eigen::Vector3f>;

// A surface as it travels: a rigid pose, and what is left of its motion in the axes that move with that.
// Level sets of two frames are then near each other however fast the whole goes.
struct Carried {
  Pose pose;
  Vertices vertices;
};

constexpr double kMostVoxels = 2048;   // along the longest axis: a surface of that size is some 10^7 voxels
constexpr double kSameInstant = 1e-6;  // of a frame

Eigen::AlignedBox3d bounds_of(const std::vector<Vec3>& vertices) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : vertices) box.extend(v);
  return box;
}

// Of a deforming mesh the longest of several instants, whatever part of its motion is run: keys may scale it.
double longest_side(const AnimatedMesh& mesh) {
  if (mesh.motion() != Motion::kDeforming) return bounds_of(mesh.rest_vertices()).sizes().maxCoeff();
  constexpr int kInstants = 9;
  double longest = 0;
  std::vector<Vec3> vertices(mesh.vertex_count());
  for (int k = 0; k < kInstants; ++k) {
    mesh.sample(mesh.duration() * k / (kInstants - 1), vertices);
    longest = std::max(longest, bounds_of(vertices).sizes().maxCoeff());
  }
  return longest;
}

float voxel_size(const scene::Solid& desc, double longest) {
  if (!(longest > 0)) throw Error(ErrorKind::kInput, desc.pointer, desc.name + " is a single point");
  const double voxel = desc.voxel.value_or(longest / desc.resolution);
  if (!(voxel > 0) || longest / voxel > kMostVoxels)
    throw Error(
        ErrorKind::kInput, desc.pointer,
        fmt::format(
            "a voxel of {:g} m for a solid {:g} m long: expected at most {} voxels along its longest axis",
            voxel, longest, kMostVoxels),
        "take a larger voxel");
  return static_cast<float>(voxel);
}

}  // namespace

struct Solid::Impl {
  Impl(const scene::Solid& desc, const AnimatedMesh& collider, const scene::Frames& run, double first_time,
       const std::filesystem::path& cache_directory)
      : name(desc.name),
        mesh(collider),
        fps(run.fps),
        surface(close_surface(desc.name, collider.rest_vertices(), collider.triangles())) {
    origin = bounds_of(mesh.rest_vertices()).center();
    options = {voxel_size(desc, longest_side(mesh)), desc.half_width,
               desc.level_set_cache.value_or(cache_directory), name};
    view.friction = static_cast<float>(desc.friction);
    view.offset = static_cast<float>(desc.offset);
    view.triangles = surface.triangles.front().data();
    view.neighbours = surface.neighbours.data();
    view.triangle_count = static_cast<std::int32_t>(surface.triangles.size());
    if (mesh.motion() == Motion::kDeforming) {
      queue.emplace([this](int frame) { return build_frame(frame); }, frame_of(first_time),
                    run.last - run.first);
      log_info(fmt::format("{}: deforms; a level set a frame, voxels of {:g} m", name, options.voxel_size));
    } else {
      build_once();
    }
  }

  int frame_of(double time) const { return static_cast<int>(std::floor(time * fps + kSameInstant)); }

  // Of `vertices`, the surface's, at rest or at a time: caps in place, relative to the origin.
  Vertices local(std::vector<Vec3> vertices) const {
    vertices.resize(surface.vertex_count());
    surface.follow(vertices);
    Vertices result;
    result.reserve(vertices.size());
    for (const Vec3& v : vertices) result.push_back((v - origin).cast<float>());
    return result;
  }

  Carried carried_at(double time) const {
    std::vector<Vec3> vertices(mesh.vertex_count());
    mesh.sample(time, vertices);
    const Pose pose = mesh.nearest_pose(vertices);
    for (Vec3& v : vertices) v = pose.rotation.transpose() * (v - pose.position);
    return {pose, local(std::move(vertices))};
  }

  void place(double (&rotation)[9], double (&translation)[3], const Pose& pose) const {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>{rotation} = pose.rotation;
    Eigen::Map<Vec3>{translation} = pose.rotation * origin + pose.position;
  }

  void warn_if_empty(const LevelSet& level_set) const {
    if (!level_set.encloses_volume())
      log_warning(name +
                  ": the surface encloses no volume that its voxels can see; hair will not collide with it");
  }

  FrameSurface surface_of(const Vertices& now) const {
    return {cached_level_set(surface, now, options), folded_triangles(surface, now, options.voxel_size)};
  }

  // Of the pair's frames.
  void join_folds() {
    folded.clear();
    std::ranges::set_union(pair.before.folded, pair.after.folded, std::back_inserter(folded));
  }

  // For the vertices now, where closest triangles do not tell the side (folds.h).
  void find_folds() {
    view.crossings = {}, view.folded_tiles = nullptr;
    if (folded.empty()) return;
    crossings.build(vertices, surface.triangles);
    mark_tiles(view.level_set[0], vertices, surface.triangles, folded, folded_tiles);
    view.crossings = crossings.view(), view.folded_tiles = folded_tiles.data();
  }

  // ---- Still and rigid --------------------------------------------------------------------------

  void build_once() {
    const Timer timer;
    vertices = local(mesh.rest_vertices());
    pair.before = pair.after = surface_of(vertices);
    log_info(fmt::format("{}: level set of {} tiles, voxels of {:g} m, {:.1f} MB, {:.2f} s", name,
                         pair.before.level_set->distance.size() / 512, options.voxel_size,
                         1e-6 * pair.before.bytes(), timer.seconds()));
    warn_if_empty(*pair.before.level_set);
    join_folds();
    show(pair, 0);
    find_folds();
    view.vertices_before = view.vertices = vertices.front().data();
  }

  void place_rigid(double time_before, double time) {
    place(view.rotation_before, view.translation_before, mesh.pose(time_before));
    place(view.rotation, view.translation, mesh.pose(time));
  }

  // ---- Deforming --------------------------------------------------------------------------------

  // On the queue's thread. A frame that looks like the last one built shares its level set.
  FrameSurface build_frame(int frame) {
    Vertices now = carried_at(frame / fps).vertices;
    if (last_built.level_set && now == last_built_vertices) return last_built;
    const Timer timer;
    last_built = surface_of(now);
    if (last_built_vertices.empty()) warn_if_empty(*last_built.level_set);
    log_debug(fmt::format("{}: level set {} frames after the first, {:.1f} MB, {:.2f} s", name, frame,
                          1e-6 * last_built.bytes(), timer.seconds()));
    last_built_vertices = std::move(now);
    return last_built;
  }

  void place_deforming(double time_before, double time) {
    const int now = frame_of(time_before);
    if (!frame || *frame != now) pair = queue->at(now), join_folds();
    frame = now;
    show(pair, std::clamp(time * fps - now, 0.0, 1.0));
    if (!surface_time || *surface_time != time_before) move_surface(time_before);
    vertices_before.swap(vertices);
    place(view.rotation_before, view.translation_before, surface_pose);
    move_surface(time);
    find_folds();
    place(view.rotation, view.translation, surface_pose);
    view.vertices_before = vertices_before.front().data();
    view.vertices = vertices.front().data();
  }

  void move_surface(double time) {
    Carried now = carried_at(time);
    surface_pose = now.pose, vertices = std::move(now.vertices);
    surface_time = time;
  }

  void show(const LevelSetQueue::Pair& level_sets, double blend) {
    view.level_set[0] = level_sets.before.level_set->view();
    view.level_set[1] = level_sets.after.level_set->view();
    view.blend = static_cast<float>(blend);
  }

  std::size_t bytes() const {
    return (vertices.size() + vertices_before.size()) * sizeof(Eigen::Vector3f) +
           surface.triangles.size() * sizeof(Triangle) + crossings.bytes() + folded_tiles.size() +
           (queue ? queue->bytes() : pair.before.bytes());
  }

  const std::string name;
  const AnimatedMesh& mesh;
  const double fps;
  const ClosedSurface surface;
  Vec3 origin;  // of level-set coordinates, scene axes
  LevelSetOptions options;
  kernels::SolidView view{};
  LevelSetQueue::Pair pair;
  std::vector<std::int32_t> folded;         // triangles folded at either frame
  Crossings crossings;                      // where there are any
  std::vector<unsigned char> folded_tiles;  // likewise
  Vertices vertices, vertices_before;       // at the substep's end and start

  std::optional<int> frame;            // whose level sets `pair` holds (deforming)
  std::optional<double> surface_time;  // of `vertices` and the pose (deforming)
  Pose surface_pose;
  Vertices last_built_vertices;  // the queue's thread alone
  FrameSurface last_built;
  std::optional<LevelSetQueue> queue;  // last: its thread uses the others
};

Solid::Solid(const scene::Solid& desc, const AnimatedMesh& mesh, const scene::Frames& frames,
             double first_time, const std::filesystem::path& cache_directory)
    : impl_(std::make_unique<Impl>(desc, mesh, frames, first_time, cache_directory)) {}
Solid::~Solid() = default;
Solid::Solid(Solid&&) noexcept = default;

const std::string& Solid::name() const { return impl_->name; }
std::size_t Solid::bytes() const { return impl_->bytes(); }

const kernels::SolidView& Solid::at(double time_before, double time) {
  if (impl_->queue) {
    impl_->place_deforming(time_before, time);
  } else {
    impl_->place_rigid(time_before, time);
  }
  return impl_->view;
}

}  // namespace ringlet::solids
