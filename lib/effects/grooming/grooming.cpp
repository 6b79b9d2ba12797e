#include "effects/grooming/grooming.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>

#include "core/error.h"
#include "core/log.h"
#include "kernels/solid/touch.h"
#include "solids/mesh_distance.h"

namespace ringlet::effects {

template <class T>
Grooming<T>::Grooming(const scene::Scene& scene, std::span<const std::int32_t> groom_of_strand,
                      state::StrandModel<T>& model, state::StrandState<T>& state)
    : scene_(scene), groom_of_strand_(groom_of_strand), model_(model), state_(state) {
  for (std::size_t s = 0; s < model_.layout.strands(); ++s)
    spacing_.push_back(groom::spacing(model_.shape(s)));
  for (const scene::GroomingOperation& operation : scene_.effects.grooming) {
    const auto* trim = std::get_if<scene::Trim>(&operation.what);
    cutters_.push_back(trim && trim->mesh ? solids::distance_to(*trim->mesh, scene_.units)
                                          : groom::SignedDistance());
  }
}

template <class T>
std::size_t Grooming<T>::bytes() const {
  return spacing_.size() * sizeof(double);
}

template <class T>
bool Grooming<T>::concerns(const scene::GroomingOperation& operation, std::size_t strand) const {
  return operation.groom.empty() || operation.groom == scene_.grooms[groom_of_strand_[strand]].name;
}

template <class T>
bool Grooming<T>::apply(int frame, std::span<const Pose> roots) {
  const auto& operations = scene_.effects.grooming;
  bool any = false;
  for (std::size_t k = 0; k < operations.size(); ++k) {
    if (operations[k].frame != frame) continue;
    apply(operations[k], cutters_[k], roots);
    any = true;
  }
  return any;
}

template <class T>
void Grooming<T>::apply(const scene::GroomingOperation& operation, const groom::SignedDistance& cutter,
                        std::span<const Pose> roots) {
  std::atomic<std::int64_t> changed = 0, hair = 0;  // strands; those with more than a root
  tbb::parallel_for(std::size_t{0}, model_.layout.strands(), [&](std::size_t s) {
    if (!concerns(operation, s)) return;
    groom::EditedStrand strand = read(s, roots[s]);
    if (groom::edit(strand, operation, cutter)) {
      write(s, strand, operation);
      ++changed;
    }
    hair += model_.living(s) > 1;
  });
  if (hair == 0 && std::holds_alternative<scene::Trim>(operation.what))
    throw Error(ErrorKind::kInput, operation.pointer,
                fmt::format("leaves nothing of any strand in frame {}, expected some hair", operation.frame),
                "look at its place, its unit and which side it keeps; earlier frames are kept");
  log_info(
      fmt::format("frame {}: {}: {} strands changed", operation.frame, operation.pointer, changed.load()));
}

template <class T>
groom::EditedStrand Grooming<T>::read(std::size_t strand, const Pose& root) const {
  groom::EditedStrand edited{model_.shape(strand),
                             {},
                             {},
                             root.rotation,
                             spacing_[strand],
                             static_cast<std::size_t>(scene_.model.clamped_particles)};
  const auto vector = [&](const state::AlignedVector<T>& array, int i) {
    const auto at = [&](int c) { return static_cast<double>(array[model_.layout.at(strand, i, 3, c)]); };
    return Vec3(at(0), at(1), at(2));
  };
  for (int i = 0; i < model_.living(strand); ++i) {
    edited.position.push_back(root.position + vector(state_.position, i));
    edited.velocity.push_back(vector(state_.velocity, i));
  }
  return edited;
}

// What the operation did not move keeps its bits: rounding to the world and back must not be a motion.
template <class T>
void Grooming<T>::write(std::size_t strand, const groom::EditedStrand& edited,
                        const scene::GroomingOperation& operation) {
  const int room = model_.layout.count(strand);
  const std::size_t n = std::min<std::size_t>(edited.rest.size(), room);
  const groom::EditedStrand before = read(strand, {edited.rotation, edited.position[0]});
  model_.set_shape(strand, std::span(edited.rest).first(n));
  const auto put = [&](state::AlignedVector<T>& array, int i, const Vec3& value) {
    for (int c = 0; c < 3; ++c) array[model_.layout.at(strand, i, 3, c)] = static_cast<T>(value[c]);
  };
  for (int i = 0; i < room; ++i) {
    const auto k = static_cast<std::size_t>(i);
    if (k >= n) {
      put(state_.position, i, Vec3::Zero()), put(state_.velocity, i, Vec3::Zero());
      continue;
    }
    if (k >= before.position.size() || edited.position[k] != before.position[k])
      put(state_.position, i, edited.position[k] - edited.position[0]);
    if (k >= before.velocity.size() || edited.velocity[k] != before.velocity[k])
      put(state_.velocity, i, edited.velocity[k]);
  }
  // What pressed it where it was does so no more.
  if (!state_.touches.empty())
    for (int i = 0; i < room; ++i)
      for (int k = 0; k < kernels::kTouchReals; ++k)
        state_.touches[model_.layout.at(strand, i, kernels::kTouchReals, k)] = T(0);
  // What hair has suffered it keeps, whatever its new shape; particles that are new have suffered nothing and
  // stand free.
  for (int i = 0; i < room; ++i) {
    if (static_cast<std::size_t>(i) < std::min(n, before.position.size())) continue;
    const std::size_t at = model_.layout.at(strand, i, 1, 0);
    if (!state_.elongation.empty()) state_.elongation[at] = T(0);
    if (!state_.shelter.empty()) state_.shelter[at] = T(1);
  }
  if (std::holds_alternative<scene::Rest>(operation.what) && scene_.model.preload && scene_.effects.gravity)
    model_.set_preload(strand, *scene_.effects.gravity, edited.rotation);
}

template class Grooming<float>;
template class Grooming<double>;

}  // namespace ringlet::effects
