// What collisions moved takes the rest of the mesh along (hair mesh paper, equations 3 and 4): with x the
// positions before and x'' those after, the least
//   sum over edges |(x''_i - x''_j) - (x_i - x_j)|^2
// over all vertices but the corrected ones and the roots. For the displacement u = x'' - x that is A^T A u =
// 0 with u given there, A the edges' incidence matrix: a scalar Laplacian of the mesh, fixed once and for
// all.
#pragma once
#include "kernels/hairmesh/pair_lanes.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

// A^T A, applied to each of the three components, split by the mesh's columns as BlockMatrix is: D couples a
// vertex with those above and below, the rest with the same layer of other columns.
template <class T>
class MeshLaplacian {
 public:
  // `degree` counts a column's edges of the scalp; of their other ends `neighbour` holds the later columns.
  MeshLaplacian(const PairLanes<T>& lanes, const std::int32_t* degree, const std::int32_t* first,
                const std::int32_t* neighbour)
      : lanes_(lanes) {
    const auto pairs = static_cast<std::size_t>(lanes.pairs());
    zero_values(kOctet * pairs * static_cast<std::size_t>(lanes.fours()), degree_, joined_);
    zero_values(kOctet * pairs * static_cast<std::size_t>(lanes.rows()), inverse_, below_);
    zero_values(4 * kOctet * static_cast<std::size_t>(lanes.fours()), solved_);
    first_.resize(2 * pairs + 1), offset_.resize(static_cast<std::size_t>(first[lanes.columns()]));
    std::int32_t* offset = offset_.data();
    for (std::int32_t k = 0; k < lanes.pairs(); ++k)
      for (int half = 0; half < 2; ++half) {
        const std::int32_t c = lanes.pair(k).column[half];
        first_.data()[2 * k + half] = static_cast<std::int32_t>(offset - offset_.data());
        if (!lanes.is_column(c)) continue;
        for (std::int32_t n = first[c]; n < first[c + 1]; ++n) *offset++ = lanes.offset(neighbour[n]);
        for (std::int32_t row = 0; row < lanes.rows(); ++row) {
          const bool has_below = row + lanes.first_layer() > 0, has_above = row + 1 < lanes.rows();
          *lane(degree_, k, half, row) =
              static_cast<T>(degree[c] + (has_below ? 1 : 0) + (has_above ? 1 : 0));
          *lane(joined_, k, half, row) = has_above ? T(1) : T(0);
        }
      }
    first_.data()[2 * pairs] = static_cast<std::int32_t>(offset - offset_.data());
  }

  std::size_t bytes() const {
    return first_.bytes() + offset_.bytes() + degree_.bytes() + joined_.bytes() + inverse_.bytes() +
           below_.bytes() + solved_.bytes();
  }

  // Factors the columns, with vertices that are wholly prescribed taken out.
  void factor(const VertexFilter<T>& filter) {
    for (std::int32_t c = 0; c < lanes_.columns(); ++c) {
      const std::int32_t place = lanes_.place(c), first = lanes_.first_vertex(c);
      T last = 0;  // 1 / E of the vertex below, where one is joined to it
      for (std::int32_t row = 0; row < lanes_.rows(); ++row) {
        const bool free = filter.is_free(first + row);
        const T below = free ? -last : T(0);
        const T inverse = free ? T(1) / (*lane(degree_, place / 2, place % 2, row) + below) : T(1);
        const std::int64_t at =
            kOctet * (std::int64_t{place / 2} * lanes_.rows() + row) + kSecondHalf * (place % 2);
        for (int k = 0; k < 4; ++k) below_.data()[at + k] = below, inverse_.data()[at + k] = inverse;
        last = free ? inverse : T(0);
      }
    }
  }
  RINGLET_KERNEL void solve(std::int32_t pair, const Octets<T>* g, Octets<T>* x) const {
    const std::int64_t first = std::int64_t{pair} * lanes_.rows();
    const auto *below = reinterpret_cast<const Octets<T>*>(below_.data()) + first,
               *inverse = reinterpret_cast<const Octets<T>*>(inverse_.data()) + first;
    auto* solved = reinterpret_cast<Octets<T>*>(solved_.data());
    Octets<T> last{};
    lanes_.read_rows(g, [&](std::int32_t i, Octets<T> w) {
      last = w - below[i] * last;
      solved[i] = inverse[i] * last;
    });
    lanes_.write_rows(x, [&](std::int32_t i) {
      last = i + 1 < lanes_.rows() ? solved[i] - below[i + 1] * last : solved[i];
      return last;
    });
  }
  RINGLET_KERNEL void later(std::int32_t pair, const T* x, Octets<T>* y) const {
    const std::int32_t* first = first_.data() + 2 * pair;
    for (std::int32_t k = 0; k < lanes_.octets(); ++k) {
      Padded<T> sum[2]{};
      for (int half = 0; half < 2; ++half)
        for (std::int32_t n = first[half]; n < first[half + 1]; ++n)
          sum[half] -= four_at(x + offset_.data()[n] + kOctet * k);
      y[k] = side_by_side<T>(sum[0], sum[1]);
    }
  }
  RINGLET_KERNEL void add_to_later(std::int32_t pair, const Octets<T>* x, T* to) const {
    const std::int32_t* first = first_.data() + 2 * pair;
    for (std::int32_t k = 0; k < lanes_.octets(); ++k) {
      const Padded<T> halves[2] = {half_of<0, T>(x[k]), half_of<1, T>(x[k])};
      for (int half = 0; half < 2; ++half)
        for (std::int32_t n = first[half]; n < first[half + 1]; ++n)
          *reinterpret_cast<Padded<T>*>(to + offset_.data()[n] + kOctet * k) -= halves[half];
    }
  }
  RINGLET_KERNEL void add_own(std::int32_t pair, const Octets<T>* x, Octets<T>* y) const {
    const auto *degree =
                   reinterpret_cast<const Octets<T>*>(degree_.data()) + std::int64_t{pair} * lanes_.fours(),
               *joined =
                   reinterpret_cast<const Octets<T>*>(joined_.data()) + std::int64_t{pair} * lanes_.fours();
    const Octets<T> none{};
    for (std::int32_t four = 0; four < lanes_.fours(); ++four)
      for (int c = 0; c < 3; ++c) {
        const std::int32_t k = 3 * four + c;
        const Octets<T> before = four > 0 ? joined[four - 1] * x[k - 3] : none,
                        above = shift_down(x[k], four + 1 < lanes_.fours() ? x[k + 3] : none);
        y[k] += degree[four] * x[k] - (shift_up(before, joined[four] * x[k]) + joined[four] * above);
      }
  }

 private:
  T* lane(const HostBuffer<T>& values, std::int32_t pair, std::int32_t half, std::int32_t row) const {
    return values.data() + kOctet * (std::int64_t{pair} * lanes_.fours() + row / 4) + kSecondHalf * half +
           row % 4;
  }

  const PairLanes<T>& lanes_;
  HostBuffer<std::int32_t> first_, offset_;
  HostBuffer<T> degree_, joined_;  // of a vertex: its edges, whether one leads up
  HostBuffer<T> inverse_, below_;  // of a vertex: 1 / E, and N to the one below, in all of its half
  HostBuffer<T> solved_;
};

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
