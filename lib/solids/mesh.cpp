#include "solids/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/log.h"
#include "core/trace.h"
#include "solids/bind_pose.h"
#include "solids/import.h"
#include "solids/keyframes.h"
#include "solids/rigid_fit.h"
#include "solids/sequence.h"
#include "solids/weld.h"

namespace ringlet::solids {
namespace {

constexpr double kStillness = 1e-6;      // of the mesh's extent: motion below it is none
constexpr std::size_t kWitnesses = 256;  // vertices that a rigid pose is fitted to

// The similarity as a transform.
Affine transform(const Similarity& s) {
  Affine result;
  result.linear() = s.scale * s.rotate.toRotationMatrix();
  result.translation() = s.translate;
  return result;
}

double largest_distance(std::span<const Vec3> a, std::span<const Vec3> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).squaredNorm());
  return std::sqrt(largest);
}

// The length that rounding errors of the vertices scale with: the bounds' diagonal, or how far they lie from
// the origin.
double extent(std::span<const Vec3> vertices) {
  Eigen::AlignedBox3d box;
  for (const Vec3& v : vertices) box.extend(v);
  return std::max(box.diagonal().norm(), std::max(box.min().norm(), box.max().norm()));
}

template <class T>
std::vector<T> pick(std::span<const T> all, const std::vector<std::size_t>& chosen) {
  std::vector<T> result;
  for (const std::size_t i : chosen) result.push_back(all[i]);
  return result;
}

}  // namespace

struct AnimatedMesh::Impl {
  Impl(const scene::MeshDesc& desc, const scene::Units& scene_units, const scene::Frames& run)
      : animation(desc.animation), frames(run) {
    DeclaredUnits declared;
    if (is_sequence(desc.file)) {
      if (animation.clip)
        throw Error(ErrorKind::kInput, desc.file.string(), "a numbered sequence has no clips",
                    "leave `clip` out: the files are the animation");
      sequence = read_sequence(desc.file);
      declared = sequence.declared;
      rig = std::move(sequence.rig);
    } else {
      ImportedMesh mesh = import_mesh(desc.file, animation.clip);
      declared = mesh.declared;
      const Weld weld = find_weld(mesh.rig);
      rig = apply(std::move(mesh.rig), weld);
      const double moved = rest_in_bind_pose(rig);
      if (moved > 0)
        log_debug(
            fmt::format("{}: at rest the skin is in its bind pose, up to {:g} (file units) from where "
                        "the nodes put it",
                        desc.file.string(), moved));
    }
    units.linear() = file_to_scene(desc.file, declared, desc.units, scene_units);
    units.translation().setZero();
    rest.resize(rig.vertices.size());
    sample(-seconds(frames.preroll), 0, rest);
    if (!std::all_of(rest.begin(), rest.end(), [](const Vec3& v) { return v.allFinite(); }))
      throw Error(ErrorKind::kInput, desc.file.string(),
                  "the file's transforms make vertices that are not finite");
    for (std::size_t i = 0, step = rest.size() / kWitnesses + 1; i < rest.size(); i += step)
      witnesses.push_back(i);
    rest_witnesses = pick<Vec3>(rest, witnesses);
    motion = classify();
  }

  double seconds(double frame_count) const { return frame_count / frames.fps; }

  // How far from the rest pose (0) to the animation (1).
  double presence(double time) const {
    if (time >= 0 || frames.preroll == 0) return 1;
    return ease(1 + time / seconds(frames.preroll));
  }

  // The clip's time: held at its end, or wrapped.
  double clip_time(double time) const {
    time *= animation.speed;
    if (!animation.loop || rig.clip_length == 0) return std::min(time, rig.clip_length);
    return std::fmod(time, rig.clip_length);
  }

  void sample(double time, double presence, std::span<Vec3> out) const {
    const double after_start = std::max(time, 0.0);
    const Similarity keys = sample_animation(animation, frames, after_start);
    const Affine placement = transform(interpolate({}, keys, presence)) * units;
    if (sequence.frames.empty()) {
      sample_rig(rig, {clip_time(after_start), rig.has_clip ? presence : 0}, placement, out);
    } else {
      sample_sequence(sequence, after_start * animation.speed * frames.fps, animation.loop, placement, out);
    }
  }

  void sample(double time, std::span<Vec3> out) const { sample(time, presence(time), out); }

  double duration() const {
    double end = rig.has_clip ? rig.clip_length : 0;
    if (!sequence.frames.empty())
      end = std::max(end, seconds(static_cast<double>(sequence.frames.size()) - 1));
    for (const auto* keys : {&animation.keys, &animation.carrier})
      for (const scene::Key& key : *keys) end = std::max(end, seconds(key.frame - frames.first));
    return end / animation.speed;
  }

  // Every instant at which the motion may change its course, and the middles between.
  std::vector<double> telling_times() const {
    const double begin = -seconds(frames.preroll), end = seconds(frames.last - frames.first);
    std::set<double> times;
    for (int frame = -frames.preroll; frame <= frames.last - frames.first; ++frame)
      times.insert(seconds(frame));
    for (const auto* keys : {&animation.keys, &animation.carrier})
      for (const scene::Key& key : *keys) times.insert(seconds(key.frame - frames.first) / animation.speed);
    for (std::size_t k = 0; k < sequence.frames.size(); ++k)
      times.insert(seconds(static_cast<double>(k)) / animation.speed);
    if (rig.has_clip) {
      const double period = animation.loop && rig.clip_length > 0
                                ? rig.clip_length
                                : animation.speed * end + rig.clip_length + 1;
      for (const double key : rig.key_times())
        for (double time = key; time <= animation.speed * end; time += period)
          times.insert(time / animation.speed);
    }
    std::vector<double> result;
    for (const double time : times) {
      if (time < begin || time > end) continue;
      if (!result.empty()) result.push_back(0.5 * (result.back() + time));
      result.push_back(time);
    }
    return result;
  }

  Motion classify() const {
    if (!animation.keyed() && !rig.has_clip && sequence.frames.size() < 2) return Motion::kStill;
    const double tolerance = kStillness * extent(rest);
    std::vector<Vec3> now(rest.size()), rigid(rest.size());
    Motion motion = Motion::kStill;
    for (const double time : telling_times()) {
      sample(time, now);
      if (largest_distance(now, rest) <= tolerance) continue;
      const Pose pose = fit_pose(rest_witnesses, pick<Vec3>(now, witnesses));
      for (std::size_t i = 0; i < rest.size(); ++i) rigid[i] = pose.rotation * rest[i] + pose.position;
      if (!(largest_distance(now, rigid) <= tolerance)) return Motion::kDeforming;
      motion = Motion::kRigid;
    }
    return motion;
  }

  Pose pose(double time) const {
    if (motion == Motion::kStill) return {};
    std::vector<Vec3> now(rest.size());
    sample(time, now);
    return nearest_pose(now);
  }

  Pose nearest_pose(std::span<const Vec3> now) const {
    const std::vector<Vec3> now_witnesses = pick<Vec3>(now, witnesses);
    return now_witnesses == rest_witnesses ? Pose{} : fit_pose(rest_witnesses, now_witnesses);
  }

  scene::Animation animation;
  scene::Frames frames;
  Rig rig;
  Sequence sequence;  // its rig has moved to `rig`
  Affine units;       // scene metres and axes from the file's
  std::vector<Vec3> rest;
  std::vector<std::size_t> witnesses;
  std::vector<Vec3> rest_witnesses;
  Motion motion;
};

AnimatedMesh::AnimatedMesh(const scene::MeshDesc& desc, const scene::Units& scene_units,
                           const scene::Frames& frames) {
  trace::Span span("mesh", "set-up");
  span.tell("file", desc.file.filename().string());
  impl_ = std::make_unique<Impl>(desc, scene_units, frames);
}
AnimatedMesh::~AnimatedMesh() = default;
AnimatedMesh::AnimatedMesh(AnimatedMesh&&) noexcept = default;

std::size_t AnimatedMesh::vertex_count() const { return impl_->rest.size(); }
const std::vector<Triangle>& AnimatedMesh::triangles() const { return impl_->rig.triangles; }
const std::vector<std::int32_t>& AnimatedMesh::mesh_of_triangle() const {
  return impl_->rig.mesh_of_triangle;
}
const std::vector<std::string>& AnimatedMesh::mesh_names() const { return impl_->rig.mesh_names; }
const std::vector<Vec3>& AnimatedMesh::rest_vertices() const { return impl_->rest; }
AnimatedMesh::Motion AnimatedMesh::motion() const { return impl_->motion; }
double AnimatedMesh::duration() const { return impl_->duration(); }
Pose AnimatedMesh::pose(double time) const { return impl_->pose(time); }
Pose AnimatedMesh::nearest_pose(std::span<const Vec3> vertices) const {
  return impl_->nearest_pose(vertices);
}

void AnimatedMesh::sample(double time, std::span<Vec3> out) const {
  switch (impl_->motion) {
    case Motion::kStill:
      std::copy(impl_->rest.begin(), impl_->rest.end(), out.begin());
      return;
    case Motion::kRigid: {
      const Pose pose = impl_->pose(time);
      for (std::size_t i = 0; i < out.size(); ++i) out[i] = pose.rotation * impl_->rest[i] + pose.position;
      return;
    }
    case Motion::kDeforming:
      impl_->sample(time, out);
      return;
  }
}

}  // namespace ringlet::solids
