// The grid on a device against the host's, bit for bit: as a device runs it, thread by thread on the host,
// and on a device where there is one.
#include <gtest/gtest.h>

#include <cstring>
#include <numeric>

#include "grid_support.h"
#include "kernels/backend/host.h"
#include "kernels/backend/lane_sums.h"
#include "kernels/grid/grid_solver.h"
#include "kernels/launch/cuda_kernels.h"
#include "parity/cuda_sphere.h"

namespace ringlet::cuda_testing {
namespace {

using namespace kernels;
using Hair = kernels_testing::GridHair<float>;

// ---- A backend as kernels/backend/cuda.h without a device: a thread for each index, in an order that is not
// the host's, and memory that holds no zeros.

template <class T>
class UnclearedBuffer {
 public:
  T* data() const { return memory_.data(); }
  std::size_t size() const { return memory_.size(); }
  std::size_t bytes() const { return memory_.bytes(); }
  void resize(std::size_t size) {
    const std::size_t before = memory_.bytes();
    memory_.resize(size);
    if (memory_.bytes() != before) std::memset(static_cast<void*>(memory_.data()), 0xff, memory_.bytes());
  }
  void swap(UnclearedBuffer& other) { memory_.swap(other.memory_); }

 private:
  HostBuffer<T> memory_;
};

class Threads {
 public:
  template <class T>
  using Buffer = UnclearedBuffer<T>;
  struct Lent {};
  static constexpr bool kCallsShareThreads = false;

  explicit Threads(Lent) {}

  template <class F>
  void parallel_for(const char*, int n, const F& f, int = 0) const {
    for (int i = n; i-- > 0;) f(i);
  }
  std::int32_t scan(const char*, Buffer<std::int32_t>& values, int n) {
    std::int32_t sum = 0;
    for (int i = 0; i < n; ++i) sum += std::exchange(values.data()[i], sum);
    return sum;
  }
  void sort(const char*, Buffer<std::uint64_t>& keys, Buffer<std::uint32_t>& values, int n, int bits) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> both(n);
    for (int i = 0; i < n; ++i) both[i] = {keys.data()[i], values.data()[i]};
    const std::uint64_t mask = (std::uint64_t{1} << bits) - 1;
    std::ranges::stable_sort(both, {}, [mask](const auto& pair) { return pair.first & mask; });
    for (int i = 0; i < n; ++i) keys.data()[i] = both[i].first, values.data()[i] = both[i].second;
  }
  template <class F>
  double sum(const char* name, int n, const F& f) {
    std::vector<double> sums(sum_threads(n));
    parallel_for(name, sum_threads(n), LaneSum<F>{f, n, sums.data()});
    return total_of(sums.data(), sum_threads(n));
  }
  template <class F>
  double largest(const char* name, int n, double least, const F& f) {
    const int threads = std::min(n, 100);
    std::vector<double> most(threads);
    parallel_for(name, threads, LaneLargest<F>{f, n, threads, least, most.data()});
    return std::accumulate(most.begin(), most.end(), least,
                           [](double a, double b) { return std::max(a, b); });
  }
  std::size_t bytes() const { return 0; }
};

Host host() { return Host({kernels_testing::chunks_in_turn, nullptr}); }

TEST(CudaSums, HaveTheHostsBits) {
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  for (const int n : {0, 1, 15, 16, 17, 2047, 2048, 2049, 2063, 100'003}) {
    std::vector<double> values(n);
    for (double& value : values) value = std::exp(20 * normal(generator)) * normal(generator);
    const auto at = [&](int i) { return values[i]; };
    EXPECT_EQ(Threads({}).sum("", n, at), host().sum("", n, at)) << n;
  }
}

TEST(CudaSums, FindTheLargest) {
  for (const int n : {0, 1, 99, 100, 101, 5000})
    for (const int where : {0, n / 2, n - 1}) {
      const auto at = [&](int i) { return i == where ? 3.0 : i % 7 == 0 ? NAN : -2.0; };
      EXPECT_EQ(Threads({}).largest("", n, -5, at), host().largest("", n, -5, at)) << n << " " << where;
      EXPECT_EQ(Threads({}).largest("", n, -5, at), n > 0 ? 3 : -5);
    }
}

// ---- The whole grid

// Hair that is squeezed, thrown together and hit by a sphere, in wind.
struct Squeezed {
  static constexpr double kCell = 0.005;  // [m]

  Squeezed() : sphere(0.02, 1, 0.006f), solid(sphere.view()), hair(rest(), kCell, InstructionSet::kGeneric) {
    hair.state.shelter.assign(hair.state.position.size() / 3, 1.0f);
    solid.translation[1] = solid.translation_before[1] = 0.04;
    solid.translation[2] = solid.translation_before[2] = 0.03, solid.translation_before[0] = -0.02;
    hair.step.solids = &solid, hair.step.solid_count = 1, hair.step.clamped = 1;
    hair.step.pic = 0.05f, hair.step.passes = 4;
  }
  static kernels_testing::HairPoints rest() {
    return kernels_testing::hair_block({0, 0, 0}, {0.06, 0.08, 0.06}, kCell / 3, 9);
  }
  GridStep<float> step() {
    GridStep<float> told = hair.step;
    told.batches = hair.model.view(), told.state = hair.state.view();
    told.root_points = hair.state.root_points.data();
    return told;
  }
  HairShelter<float> shelter() { return {{3, -1, 0.5}, 1, 40e-6, hair.state.shelter.data()}; }
  void squeeze() {
    hair.move([](const Vec3& x) { return Vec3(0.85 * (x[0] - 0.03) + 0.03, x[1], x[2]); });
    hair.speed([](const Vec3& x) { return Vec3(5 * (Vec3(0.03, 0.04, 0.03) - x)); });
  }

  Sphere sphere;
  SolidView solid;
  Hair hair;
};

// What a grid leaves of a `Squeezed`: after `steps`, of which each has its figures.
struct Left {
  std::vector<GridFigures> figures;
  std::vector<float> position, velocity, shelter;
};
constexpr int kSteps = 3;

void expect_same(const Left& a, const Left& b) {
  const auto same = [](const std::vector<float>& x, const std::vector<float>& y) {
    return x.size() == y.size() && std::memcmp(x.data(), y.data(), x.size() * sizeof(float)) == 0;
  };
  EXPECT_TRUE(same(a.position, b.position));
  EXPECT_TRUE(same(a.velocity, b.velocity));
  EXPECT_TRUE(same(a.shelter, b.shelter));
  for (int k = 0; k < kSteps; ++k) {
    EXPECT_EQ(a.figures[k].iterations, b.figures[k].iterations);
    EXPECT_EQ(a.figures[k].residual, b.figures[k].residual);
    EXPECT_EQ(a.figures[k].solves, b.figures[k].solves);
    EXPECT_EQ(a.figures[k].density, b.figures[k].density);
    EXPECT_EQ(a.figures[k].cells, b.figures[k].cells);
    EXPECT_EQ(a.figures[k].moved, b.figures[k].moved);
  }
}

Left run_on_host(HairGrid<float>& grid) {
  Squeezed squeezed;
  grid.at_rest(squeezed.step());
  squeezed.squeeze();
  Left left;
  for (int k = 0; k < kSteps; ++k) left.figures.push_back(grid.run(squeezed.step()));
  grid.shelter(squeezed.shelter());
  const auto& state = squeezed.hair.state;
  left.position.assign(state.position.begin(), state.position.end());
  left.velocity.assign(state.velocity.begin(), state.velocity.end());
  left.shelter.assign(state.shelter.begin(), state.shelter.end());
  return left;
}
Left run_on_host(InstructionSet set) {
  return run_on_host(*make_hair_grid<float>(set, {kernels_testing::chunks_in_turn, nullptr}));
}

TEST(CudaThreads, RunTheGridAsTheHostDoes) {
  const Left host = run_on_host(InstructionSet::kGeneric);
  GridSolver<Threads, float> threads(Threads::Lent{});
  expect_same(run_on_host(threads), host);
  EXPECT_GT(host.figures[0].iterations, 0);
  EXPECT_TRUE(host.figures[0].moved);
  EXPECT_LT(std::ranges::min(host.shelter), 0.9f);
}

Left run_on_device() {
  Squeezed squeezed;
  auto& hair = squeezed.hair;
  const auto strands = make_cuda_strands(hair.model.view(), CudaTiming::kOff);
  const auto upload = [&] {
    strands->upload_state({hair.state.position, hair.state.velocity, {}, {}, {}, hair.state.shelter});
  };
  upload();
  strands->upload_roots(hair.state.root_motion, hair.state.root_points);
  strands->grid_at_rest(squeezed.step());
  squeezed.squeeze();
  upload();
  Left left;
  for (int k = 0; k < kSteps; ++k) left.figures.push_back(strands->grid_step(squeezed.step()));
  strands->grid_shelter(squeezed.shelter());
  left.position.resize(hair.state.position.size()), left.velocity.resize(hair.state.velocity.size());
  left.shelter.resize(hair.state.shelter.size());
  strands->download_state({left.position, left.velocity, {}, {}, {}, left.shelter});
  return left;
}

TEST(CudaGrid, HasTheHostsBits) {
  std::string why_not;
  if (!find_cuda_device(&why_not)) GTEST_SKIP() << why_not;
  const InstructionSet set = best_instruction_set();
  if (set == InstructionSet::kGeneric) GTEST_SKIP() << "no fused multiply-add on this processor";
  const Left device = run_on_device();
  expect_same(device, run_on_host(set));
  expect_same(device, run_on_device());
}

}  // namespace
}  // namespace ringlet::cuda_testing
