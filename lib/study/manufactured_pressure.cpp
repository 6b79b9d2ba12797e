#include "study/manufactured_pressure.h"

#include <array>
#include <cmath>

#include "core/geometry.h"

namespace ringlet::study {
namespace {

using kernels::kDirections;

double p(const Vec3& x) {
  return (1 - x.squaredNorm()) * (3 + std::cos(3 * x[0]) + std::cos(2 * x[1]) * std::cos(4 * x[2]));
}

double k(const Vec3& x) { return 1 + 0.5 * std::sin(2 * x[0] + x[1]); }

// With p = s q and s = 1 - r^2: grad p = s grad q - 2 q x, and lap p = s lap q - 4 x . grad q - 6 q.
double f(const Vec3& x) {
  const double s = 1 - x.squaredNorm();
  const double across = std::cos(2 * x[1]) * std::cos(4 * x[2]);
  const double q = 3 + std::cos(3 * x[0]) + across;
  const Vec3 grad_q(-3 * std::sin(3 * x[0]), -2 * std::sin(2 * x[1]) * std::cos(4 * x[2]),
                    -4 * std::cos(2 * x[1]) * std::sin(4 * x[2]));
  const double lap_q = -9 * std::cos(3 * x[0]) - 20 * across;
  const Vec3 grad_k = 0.5 * std::cos(2 * x[0] + x[1]) * Vec3(2, 1, 0);
  return -k(x) * (s * lap_q - 4 * x.dot(grad_q) - 6 * q) - grad_k.dot(s * grad_q - 2 * q * x);
}

}  // namespace

template <class T>
ManufacturedPressure<T>::ManufacturedPressure(int edge) : edge_(edge) {
  // The keys of a cube whose edge is a power of two are consecutive.
  const std::uint64_t cube = std::uint64_t{1} * edge * edge * edge;
  std::vector<std::int32_t> number(cube, -1);  // by key; -1: beyond the sphere
  for (std::uint64_t key = 0; key < cube; ++key) {
    const Vec3 place(kernels::gather_bits(key), kernels::gather_bits(key >> 1),
                     kernels::gather_bits(key >> 2));
    if ((place + Vec3::Constant(0.5)).norm() >= edge) continue;
    number[key] = cells();
    key_.push_back(key);
  }
  const auto n = static_cast<std::size_t>(cells());
  neighbour_.resize(kDirections * n), face_.resize(kDirections * n);
  open_.resize(n), right_.resize(n), exact_.resize(n);
  for (std::int32_t cell = 0; cell < cells(); ++cell) add_cell(cell, number);
}

template <class T>
void ManufacturedPressure<T>::add_cell(std::int32_t cell, const std::vector<std::int32_t>& number) {
  const std::uint64_t key = key_[cell];
  const std::array<int, 3> place = {static_cast<int>(kernels::gather_bits(key)),
                                    static_cast<int>(kernels::gather_bits(key >> 1)),
                                    static_cast<int>(kernels::gather_bits(key >> 2))};
  const double h = 1.0 / edge_;
  const Vec3 middle = h * (Vec3(place[0], place[1], place[2]) + Vec3::Constant(0.5));
  double right = h * h * f(middle);
  T open = T(0);
  for (int d = 0; d < kDirections; ++d) {
    const int axis = d / 2, side = d % 2 ? 1 : -1;
    const std::size_t at = d * key_.size() + cell;
    neighbour_[at] = cell;
    if (place[axis] + side < 0) continue;  // a wall
    const Vec3 beyond = middle + h * side * Vec3::Unit(axis);
    const T c = static_cast<T>(k((middle + beyond) / 2));
    open += c;
    const bool in_cube = place[axis] + side < edge_;
    const std::uint64_t key_beyond =
        side > 0 ? kernels::key_after(key, axis) : kernels::key_before(key, axis);
    const std::int32_t other = in_cube ? number[key_beyond] : -1;
    if (other < 0)
      right += c * p(beyond);
    else
      neighbour_[at] = other, face_[at] = c;
  }
  open_[cell] = open, right_[cell] = static_cast<T>(right);
  exact_[cell] = p(middle);
}

template class ManufacturedPressure<float>;
template class ManufacturedPressure<double>;

}  // namespace ringlet::study
