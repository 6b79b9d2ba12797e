#include "state/strand_model.h"

#include <algorithm>

#include "kernels/backend/vector.h"

namespace ringlet::state {

using kernels::kCouplings;
using kernels::kLanes;
using kernels::kRootValues;

namespace {

template <class T>
using V = kernels::Vector3<T>;

template <class T>
V<T> get(const AlignedVector<T>& array, const StrandLayout& layout, std::size_t strand, int particle) {
  return {array[layout.at(strand, particle, 3, 0)], array[layout.at(strand, particle, 3, 1)],
          array[layout.at(strand, particle, 3, 2)]};
}

}  // namespace

template <class T>
StrandModel<T>::StrandModel(const StrandInput& input)
    : layout(input.counts),
      count(layout.batches() * kLanes, T(0)),
      rest(layout.rows() * 3 * kLanes, T(0)),
      rest_length(layout.rows() * 3 * kLanes, T(0)),
      stiffness(input.stiffness.empty() ? 0 : layout.rows() * kCouplings * kLanes, T(0)),
      preload(layout.batches() * 3 * kLanes, T(0)),
      rest_companion(input.companions ? rest.size() : 0, T(0)),
      per_length(input.elongation ? layout.batches() * kLanes : 0, T(0)),
      radius(input.radius.empty() ? 0 : layout.rows() * kLanes, T(0)) {
  std::size_t first = 0;
  for (std::size_t strand = 0; strand < input.counts.size(); ++strand) {
    const int n = input.living.empty() ? input.counts[strand] : input.living[strand];
    const auto points = std::span(input.rest).subspan(first, n);
    std::vector<Vec3> shape;
    for (const Vec3& point : points) shape.push_back(point - points[0]);
    set_shape(strand, shape);
    for (int i = 0; i < input.counts[strand] && !stiffness.empty(); ++i)
      for (int k = 0; k < kCouplings; ++k)
        stiffness[layout.at(strand, i, kCouplings, k)] =
            static_cast<T>(input.stiffness[(first + i) * kCouplings + k]);
    for (int i = 0; i < input.counts[strand] && !radius.empty(); ++i)
      radius[layout.at(strand, i, 1, 0)] = static_cast<T>(input.radius[first + i]);
    if (input.companions) {
      const std::vector<Vec3> companions = rest_companions(points);
      for (int i = 0; i + 1 < n; ++i)
        for (int c = 0; c < 3; ++c)
          rest_companion[layout.at(strand, i, 3, c)] = static_cast<T>(companions[i][c]);
    }
    if (input.preload) set_preload(strand, *input.preload, input.first_rotation[strand]);
    first += input.counts[strand];
  }
}

template <class T>
std::vector<Vec3> StrandModel<T>::shape(std::size_t strand) const {
  std::vector<Vec3> shape;
  for (int i = 0; i < living(strand); ++i) {
    const V<T> at = get(rest, layout, strand, i);
    shape.emplace_back(at.x, at.y, at.z);
  }
  return shape;
}

template <class T>
void StrandModel<T>::set_shape(std::size_t strand, std::span<const Vec3> shape) {
  const int n = static_cast<int>(shape.size()), room = layout.count(strand);
  count[layout.at_strand(strand, 1, 0)] = static_cast<T>(n);
  double length = 0;
  for (int i = 0; i < room; ++i) {
    for (int c = 0; c < 3; ++c) rest[layout.at(strand, i, 3, c)] = i < n ? static_cast<T>(shape[i][c]) : T(0);
    if (i > 0 && i < n) length += (shape[i] - shape[i - 1]).norm();
  }
  // By the very operations of the step's springs, so that the rest shape carries no force at all.
  for (int i = 0; i < room; ++i)
    for (int a = 0; a < 3; ++a)
      rest_length[layout.at(strand, i, 3, a)] =
          i + 1 + a < n ? kernels::length(get(rest, layout, strand, i + 1 + a) - get(rest, layout, strand, i))
                        : T(0);
  if (!per_length.empty())
    per_length[layout.at_strand(strand, 1, 0)] = static_cast<T>(length > 0 ? 1 / length : 0);
}

template <class T>
void StrandModel<T>::set_preload(std::size_t strand, const Vec3& gravity, const Mat3& rotation) {
  const Vec3 against = -(rotation.transpose() * gravity);
  for (int c = 0; c < 3; ++c) preload[layout.at_strand(strand, 3, c)] = static_cast<T>(against[c]);
}

template <class T>
kernels::StrandBatches<T> StrandModel<T>::view() const {
  const auto or_null = [](const AlignedVector<T>& array) { return array.empty() ? nullptr : array.data(); };
  return {layout.batches(), layout.row().data(),     count.data(),
          rest.data(),      rest_length.data(),      or_null(stiffness),
          preload.data(),   or_null(rest_companion), or_null(per_length)};
}

template <class T>
std::size_t StrandModel<T>::bytes() const {
  return (count.size() + rest.size() + rest_length.size() + stiffness.size() + preload.size() +
          rest_companion.size() + per_length.size() + radius.size()) *
         sizeof(T);
}

template <class T>
StrandState<T>::StrandState(const StrandModel<T>& model)
    : position(model.rest.size(), T(0)),
      velocity(model.rest.size(), T(0)),
      root_motion(model.count.size() * kRootValues, T(0)),
      root_points(model.count.size() * 3, 0.0),
      companion_position(model.rest_companion.size(), T(0)),
      companion_velocity(model.rest_companion.size(), T(0)) {}

template <class T>
kernels::StrandState<T> StrandState<T>::view() {
  if (companion_position.empty()) return {position.data(), velocity.data()};
  return {position.data(), velocity.data(), companion_position.data(), companion_velocity.data()};
}

template <class T>
std::size_t StrandState<T>::bytes() const {
  return (position.size() + velocity.size() + root_motion.size() + elongation.size() + shelter.size() +
          companion_position.size() + companion_velocity.size() + touches.size()) *
             sizeof(T) +
         root_points.size() * sizeof(double);
}

template <class T>
void set_root_motion(StrandState<T>& state, const StrandLayout& layout, std::size_t strand,
                     const Pose& before, const Pose& after) {
  const auto put = [&](int value, double x) {
    state.root_motion[layout.at_strand(strand, kRootValues, value)] = static_cast<T>(x);
  };
  for (int k = 0; k < 9; ++k) {
    put(k, before.rotation(k / 3, k % 3));
    put(9 + k, after.rotation(k / 3, k % 3) - before.rotation(k / 3, k % 3));
  }
  for (int c = 0; c < 3; ++c) {
    put(18 + c, after.position[c] - before.position[c]);
    state.root_points[layout.at_strand(strand, 3, c)] = after.position[c];
  }
}

std::vector<Vec3> rest_companions(std::span<const Vec3> rest) {
  std::vector<Vec3> companions;
  Vec3 tangent = Vec3::Zero(), side = Vec3::UnitX();
  for (std::size_t i = 0; i + 1 < rest.size(); ++i) {
    const Vec3 segment = rest[i + 1] - rest[i];
    const double length = segment.norm();
    if (length > 0) {  // the side is carried along the hair without turning about it
      const Vec3 next = segment / length;
      side = tangent.isZero() ? next.unitOrthogonal() : Vec3(Quat::FromTwoVectors(tangent, next) * side);
      tangent = next;
    }
    const Vec3 across = tangent.cross(side);
    const Vec3 offset[4] = {side, across, -side, -across};
    companions.push_back(rest[i] - rest[0] + 0.5 * segment + 0.5 * length * offset[i % 4]);
  }
  return companions;
}

namespace {

// `rest` [rows][3] carried by the roots' rotations.
template <class T>
void turn_by_roots(const StrandLayout& layout, const AlignedVector<T>& rest, std::span<const Pose> roots,
                   AlignedVector<T>& position) {
  for (std::size_t strand = 0; strand < layout.strands(); ++strand) {
    kernels::Matrix3<T> rotation;
    for (int k = 0; k < 9; ++k) rotation.m[k] = static_cast<T>(roots[strand].rotation(k / 3, k % 3));
    for (int i = 0; i < layout.count(strand); ++i) {
      const V<T> x = rotation * get(rest, layout, strand, i);
      const T components[3] = {x.x, x.y, x.z};
      for (int c = 0; c < 3; ++c) position[layout.at(strand, i, 3, c)] = components[c];
    }
  }
}

}  // namespace

template <class T>
void pose_at_rest(StrandState<T>& state, const StrandModel<T>& model, std::span<const Pose> roots) {
  turn_by_roots(model.layout, model.rest, roots, state.position);
  if (!model.rest_companion.empty())
    turn_by_roots(model.layout, model.rest_companion, roots, state.companion_position);
  for (AlignedVector<T>* array :
       {&state.velocity, &state.companion_velocity, &state.elongation, &state.touches})
    std::fill(array->begin(), array->end(), T(0));
  std::fill(state.shelter.begin(), state.shelter.end(), T(1));
  for (std::size_t strand = 0; strand < model.layout.strands(); ++strand)
    for (int c = 0; c < 3; ++c)
      state.root_points[model.layout.at_strand(strand, 3, c)] = roots[strand].position[c];
}

template struct StrandModel<float>;
template struct StrandModel<double>;
template struct StrandState<float>;
template struct StrandState<double>;
template void set_root_motion(StrandState<float>&, const StrandLayout&, std::size_t, const Pose&,
                              const Pose&);
template void set_root_motion(StrandState<double>&, const StrandLayout&, std::size_t, const Pose&,
                              const Pose&);
template void pose_at_rest(StrandState<float>&, const StrandModel<float>&, std::span<const Pose>);
template void pose_at_rest(StrandState<double>&, const StrandModel<double>&, std::span<const Pose>);

}  // namespace ringlet::state
