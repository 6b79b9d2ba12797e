// Strands made by hand and the grid that they move through, without the rest of the program.
#pragma once
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <thread>
#include <vector>

#include "kernels/launch/hair_grid.h"
#include "state/strand_model.h"

namespace ringlet::kernels_testing {

using HairPoints = std::vector<std::vector<Vec3>>;  // a strand's particles, at rest [m]

inline void chunks_in_turn(void*, int chunks, void (*body)(const void*, int), const void* context) {
  for (int chunk = 0; chunk < chunks; ++chunk) body(context, chunk);
}
// On two threads, each taking its chunks from the end; and in an order that no call has twice.
inline void chunks_on_two_threads(void*, int chunks, void (*body)(const void*, int), const void* context) {
  const auto every_other = [=](int first) {
    for (int chunk = chunks - 1 - first; chunk >= 0; chunk -= 2) body(context, chunk);
  };
  std::thread other(every_other, 1);
  every_other(0);
  other.join();
}
inline void chunks_shuffled(void* generator, int chunks, void (*body)(const void*, int),
                            const void* context) {
  std::vector<int> order(chunks);
  for (int k = 0; k < chunks; ++k) order[k] = k;
  std::shuffle(order.begin(), order.end(), *static_cast<std::mt19937*>(generator));
  for (const int chunk : order) body(context, chunk);
}

// A block of straight strands along y, about 9 in a cell of three times their spacing, each a little off its
// place across and up to half a segment along.
inline HairPoints hair_block(const Vec3& low, const Vec3& size, double spacing, int particles,
                             unsigned seed = 1) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> off(-0.3 * spacing, 0.3 * spacing), phase(-0.5, 0.5);
  HairPoints strands;
  for (int i = 0; i < static_cast<int>(std::lround(size[0] / spacing)); ++i)
    for (int k = 0; k < static_cast<int>(std::lround(size[2] / spacing)); ++k) {
      const double x = (i + 0.5) * spacing + off(generator), z = (k + 0.5) * spacing + off(generator);
      const Vec3 foot = low + Vec3(x, phase(generator) * size[1] / (particles - 1), z);
      strands.emplace_back();
      for (int p = 0; p < particles; ++p)
        strands.back().push_back(foot + Vec3(0, size[1] * p / (particles - 1), 0));
    }
  return strands;
}

inline kernels::GridAxes still_axes(double cell) {
  kernels::GridAxes axes{};
  axes.rotation[0] = axes.rotation[4] = axes.rotation[8] = 1;
  axes.cell = cell;
  return axes;
}

// Hair, its state and its grid.
template <class T>
class GridHair {
 public:
  static constexpr double kInterval = 1.0 / 24;

  GridHair(const HairPoints& rest, double cell, kernels::InstructionSet set,
           kernels::HostThreads threads = {chunks_in_turn, nullptr})
      : model(input_of(rest)),
        state(model),
        roots(rest.size()),
        set_(set),
        grid_(kernels::make_hair_grid<T>(set, threads)) {
    for (std::size_t s = 0; s < rest.size(); ++s) roots[s].position = rest[s][0];
    state::pose_at_rest<T>(state, model, roots);
    step.axes = still_axes(cell);
    step.interval = step.substep = kInterval;
    step.pic = T(0), step.residual = 1e-4, step.most_iterations = 200, step.passes = 1, step.clamped = 0;
    grid_->at_rest(told());
  }

  kernels::GridFigures run() { return grid_->run(told()); }
  std::size_t bytes() const { return grid_->bytes(); }
  // The share of a wind that reaches the segments that begin at particles, as rows are laid out.
  state::AlignedVector<T> shelter(const Vec3& wind, double strength, double radius) {
    state::AlignedVector<T> share(model.layout.rows() * kernels::kLanes, T(1));
    grid_->shelter({{wind.x(), wind.y(), wind.z()}, strength, radius, share.data()});
    return share;
  }

  template <class Visit>  // visit(strand, particle)
  void for_each(const Visit& visit) const {
    for (std::size_t s = 0; s < model.layout.strands(); ++s)
      for (int i = 0; i < model.living(s); ++i) visit(s, i);
  }
  Vec3 position(std::size_t s, int i) const { return roots[s].position + read(state.position, s, i); }
  Vec3 velocity(std::size_t s, int i) const { return read(state.velocity, s, i); }
  // What particles have becomes what `f` of their places is.
  void move(const std::function<Vec3(const Vec3&)>& f) {
    for_each(
        [&](std::size_t s, int i) { write(state.position, s, i, f(position(s, i)) - roots[s].position); });
  }
  void speed(const std::function<Vec3(const Vec3&)>& f) {
    for_each([&](std::size_t s, int i) { write(state.velocity, s, i, f(position(s, i))); });
  }
  // As the strands would go on their own.
  void advance(double seconds) {
    for_each([&](std::size_t s, int i) {
      write(state.position, s, i, position(s, i) + seconds * velocity(s, i) - roots[s].position);
    });
  }
  // As the grid's stage does after it has moved hair apart.
  void hold_lengths() {
    const auto batches = static_cast<std::size_t>(model.layout.batches());
    state::AlignedVector<T> figures(batches * kernels::kLengthFigures * kernels::kLanes);
    state::AlignedVector<T> scratch(kernels::scratch_reals(model.layout.longest()));
    const T seconds = static_cast<T>(step.interval), far = T(1e9);
    const kernels::LengthStep<T> lengths{model.view(), state.view(),   seconds, step.clamped, 8,
                                         T(1e-4),      figures.data(), far,     far};
    kernels::cpu_kernels<T>(set_).length_step(lengths, 0, model.layout.batches(), scratch.data());
  }
  Vec3 momentum() const {  // of particles of unit mass
    Vec3 sum = Vec3::Zero();
    for_each([&](std::size_t s, int i) { sum += velocity(s, i); });
    return sum;
  }
  Vec3 centre() const {
    Vec3 sum = Vec3::Zero();
    double count = 0;
    for_each([&](std::size_t s, int i) { sum += position(s, i), ++count; });
    return sum / count;
  }

  state::StrandModel<T> model;
  state::StrandState<T> state;
  std::vector<Pose> roots;
  kernels::GridStep<T> step{};

 private:
  const kernels::GridStep<T>& told() {
    step.batches = model.view(), step.state = state.view(), step.root_points = state.root_points.data();
    return step;
  }
  Vec3 read(const state::AlignedVector<T>& values, std::size_t s, int i) const {
    Vec3 value;
    for (int c = 0; c < 3; ++c) value[c] = values[model.layout.at(s, i, 3, c)];
    return value;
  }
  void write(state::AlignedVector<T>& values, std::size_t s, int i, const Vec3& value) {
    for (int c = 0; c < 3; ++c) values[model.layout.at(s, i, 3, c)] = static_cast<T>(value[c]);
  }
  static state::StrandInput input_of(const HairPoints& rest) {
    state::StrandInput input;
    for (const auto& strand : rest) {
      input.counts.push_back(static_cast<std::int32_t>(strand.size()));
      input.rest.insert(input.rest.end(), strand.begin(), strand.end());
    }
    return input;
  }

  kernels::InstructionSet set_;
  std::unique_ptr<kernels::HairGrid<T>> grid_;
};

// Hair's density, mass and momentum on the lattice of still axes, by brute force: all cells of the hair's
// box, and segments in many more pieces than the kernels take.
class HairOnLattice {
 public:
  template <class T>
  HairOnLattice(const GridHair<T>& hair, double cell) : cell_(cell) {
    Eigen::AlignedBox3d box;
    hair.for_each([&](std::size_t s, int i) { box.extend(hair.position(s, i) / cell); });
    low_ = box.min().array().floor().cast<int>() - 2;
    size_ = box.max().array().floor().cast<int>() + 4 - low_.array();
    values_.resize(size_.prod());
    hair.for_each([&](std::size_t s, int i) {
      const int last = hair.model.living(s) - 1;
      if (i == last) return;
      const Vec3 a = hair.position(s, i) / cell, b = hair.position(s, i + 1) / cell;
      const double mass_a = i == 0 ? 2 : 1, mass_b = i + 1 == last ? 2 : 1;
      for (int piece = 0; piece < kPieces; ++piece) {
        const double t = (piece + 0.5) / kPieces, at_a = (1 - t) * mass_a, at_b = t * mass_b;
        const Vec3 x = a + t * (b - a), flow = at_a * hair.velocity(s, i) + at_b * hair.velocity(s, i + 1);
        add(x, -1, (b - a).norm() / kPieces, 0);
        for (int c = 0; c < 3; ++c) add(x, c, (at_a + at_b) / kPieces, flow[c] / kPieces);
      }
    });
  }

  double densest() const {  // cells' edges of hair in a cell
    double most = 0;
    for (const Values& values : values_) most = std::max(most, values.density);
    return most;
  }
  // By how much cells would be denser than `most` after `seconds` of their velocities, all of them together.
  double compressed(double most, double seconds) const {
    double sum = 0;
    for (int n = 0; n < size_.prod(); ++n)
      if (values_[n].density > 0)
        sum += std::max(0.0, values_[n].density * (1 - seconds * divergence(n)) / most - 1);
    return sum;
  }

 private:
  static constexpr int kPieces = 24;
  struct Values {
    double density = 0, mass[3] = {}, momentum[3] = {};
  };
  int stride(int axis) const { return axis == 0 ? 1 : axis == 1 ? size_[0] : size_[0] * size_[1]; }
  // Of the velocity [1/s]; a face without hair is as fast as the one across the cell.
  double divergence(int n) const {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
      const Values &low = values_[n], &high = values_[n + stride(c)];
      if (low.mass[c] > 0 && high.mass[c] > 0)
        sum += high.momentum[c] / high.mass[c] - low.momentum[c] / low.mass[c];
    }
    return sum / cell_;
  }
  // To the faces of an axis, or to the cells' middles as density (-1).
  void add(const Vec3& x, int axis, double value, double momentum) {
    Vec3 from = x - Vec3::Constant(0.5);
    if (axis >= 0) from[axis] += 0.5;
    const Eigen::Vector3i below = from.array().floor().cast<int>();
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i at = below + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2);
      const double weight = (Vec3::Ones() - (from - at.cast<double>()).cwiseAbs()).prod();
      const Eigen::Vector3i place = at - low_;
      Values& to = values_[place[0] + place[1] * stride(1) + place[2] * stride(2)];
      if (axis < 0) {
        to.density += weight * value;
      } else {
        to.mass[axis] += weight * value, to.momentum[axis] += weight * momentum;
      }
    }
  }

  double cell_;
  Eigen::Vector3i low_, size_;
  std::vector<Values> values_;
};

}  // namespace ringlet::kernels_testing
