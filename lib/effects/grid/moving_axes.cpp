#include "effects/grid/moving_axes.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace ringlet::effects {
namespace {

// A mean that no order shows in: of integers. To a billionth [m], [-].
class Mean {
 public:
  void add(double value) { sum_ += std::llround(value * kUnit), ++count_; }
  double value() const { return count_ > 0 ? static_cast<double>(sum_) / kUnit / count_ : 0; }

 private:
  static constexpr double kUnit = 1 << 30;
  std::int64_t sum_ = 0, count_ = 0;
};

// The rotation nearest to a matrix.
Mat3 nearest_rotation(const Mat3& m) {
  const Eigen::JacobiSVD<Mat3> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

template <class T>
Vec3 lowest_root(const state::StrandLayout& layout, const state::StrandState<T>& state) {
  Eigen::AlignedBox3d box;
  for (std::size_t s = 0; s < layout.strands(); ++s)
    box.extend(Vec3(state.root_points[layout.at_strand(s, 3, 0)],
                    state.root_points[layout.at_strand(s, 3, 1)],
                    state.root_points[layout.at_strand(s, 3, 2)]));
  return box.isEmpty() ? Vec3(Vec3::Zero()) : box.min();
}

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

}  // namespace

template <class T>
kernels::GridAxes moving_axes(const state::StrandModel<T>& model, const state::StrandState<T>& state,
                              double cell, double substep) {
  const state::StrandLayout& layout = model.layout;
  const Vec3 low = lowest_root(layout, state);  // sums from there stay small wherever the scene lies
  Mean before[9], after[9], place[3], way[3];
  for (std::size_t s = 0; s < layout.strands(); ++s) {
    const auto motion = [&](int value) {
      return static_cast<double>(state.root_motion[layout.at_strand(s, kernels::kRootValues, value)]);
    };
    for (int k = 0; k < 9; ++k) before[k].add(motion(k)), after[k].add(motion(k) + motion(9 + k));
    for (int c = 0; c < 3; ++c)
      place[c].add(state.root_points[layout.at_strand(s, 3, c)] - low[c]), way[c].add(motion(18 + c));
  }
  RowMajor from, to;
  for (int k = 0; k < 9; ++k) from.data()[k] = before[k].value(), to.data()[k] = after[k].value();
  const Mat3 start = nearest_rotation(from), end = nearest_rotation(to);
  kernels::GridAxes axes{};
  Eigen::Map<RowMajor>(axes.rotation) = end;
  // By backward differences, as the strands' velocities are.
  Eigen::Map<RowMajor>(axes.slope) = (end - start) * end.transpose() / substep;
  for (int c = 0; c < 3; ++c)
    axes.origin[c] = low[c] + place[c].value(), axes.velocity[c] = way[c].value() / substep;
  axes.cell = cell;
  return axes;
}

template <class T>
double longest_side(const state::StrandModel<T>& model, const state::StrandState<T>& state,
                    const kernels::GridAxes& axes) {
  const Mat3 into = Eigen::Map<const RowMajor>(axes.rotation).transpose();
  Eigen::AlignedBox3d box;
  for (std::size_t s = 0; s < model.layout.strands(); ++s)
    for (int i = 0; i < model.living(s); ++i) {
      Vec3 x;
      for (int c = 0; c < 3; ++c)
        x[c] = state.root_points[model.layout.at_strand(s, 3, c)] - axes.origin[c] +
               static_cast<double>(state.position[model.layout.at(s, i, 3, c)]);
      box.extend(into * x);
    }
  return box.isEmpty() ? 0 : box.sizes().maxCoeff();
}

template <class T>
double mean_radius(const state::StrandModel<T>& model) {
  constexpr double kUnit = 1e3;  // a mean is exact to a billionth of what is added [1/mm]
  Mean radius;
  for (std::size_t s = 0; s < model.layout.strands(); ++s)
    for (int i = 0; i < model.living(s); ++i)
      radius.add(kUnit * static_cast<double>(model.radius[model.layout.at(s, i, 1, 0)]));
  return radius.value() / kUnit;
}

template double mean_radius(const state::StrandModel<float>&);
template double mean_radius(const state::StrandModel<double>&);
template kernels::GridAxes moving_axes(const state::StrandModel<float>&, const state::StrandState<float>&,
                                       double, double);
template kernels::GridAxes moving_axes(const state::StrandModel<double>&, const state::StrandState<double>&,
                                       double, double);
template double longest_side(const state::StrandModel<float>&, const state::StrandState<float>&,
                             const kernels::GridAxes&);
template double longest_side(const state::StrandModel<double>&, const state::StrandState<double>&,
                             const kernels::GridAxes&);

}  // namespace ringlet::effects
