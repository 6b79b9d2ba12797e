// Crossing strands do not pass through one another, and a heap of strands comes to rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <random>

#include "contact_support.h"
#include "grid_support.h"
#include "oracle/segment_crossings.h"

namespace ringlet::kernels_testing {
namespace {

constexpr double kRadius = 4e-5;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double symmetric() { return uniform_(engine_); }

 private:
  std::mt19937 engine_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

// Patches of two layers of strands that fly at one another at 1 m/s: those of the lower layer along x, those
// of the upper along z, tilted and jittered. Each strand of a patch is to cross each of the other layer.
struct Layers {
  int patches, side;  // strands of a layer in a patch
  std::vector<HairStrand> strands;

  Layers(int number, int particles, double spacing) {
    side = std::min(20, number / 2);
    patches = number / (2 * side);
    Random random(7);
    const double length = std::max(0.06, (side + 4) * spacing);
    for (int patch = 0; patch < patches; ++patch) {
      const Vec3 at(3 * length * (patch % 32), 0, 3 * length * (patch / 32));
      for (int k = 0; k < 2 * side; ++k) {
        const bool lower = k < side;
        const double place = (k % side - 0.5 * (side - 1)) * spacing, tilt = 0.15 * random.symmetric(),
                     slope = 0.1 * random.symmetric(), height = 0.025 + 0.01 * random.symmetric();
        const Vec3 along = length * (lower ? Vec3(1, slope, tilt) : Vec3(tilt, slope, 1));
        const Vec3 middle = at + (lower ? Vec3(0, -height, place) : Vec3(place, height, 0));
        const Vec3 velocity(0.1 * random.symmetric(), lower ? 0.5 : -0.5, 0.1 * random.symmetric());
        strands.push_back(straight_strand(middle, along, particles, velocity));
      }
    }
  }
  // Pairs of strands that are to meet.
  std::vector<std::pair<std::size_t, std::size_t>> meetings() const {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (int patch = 0; patch < patches; ++patch)
      for (int k = 0; k < side * side; ++k) {
        const std::size_t first = static_cast<std::size_t>(patch) * 2 * side;
        pairs.emplace_back(first + k / side, first + side + k % side);
      }
    return pairs;
  }
};

// Which strands are through which: passages of their segments from one side to the other, back ones taken
// off.
class Passages {
 public:
  using Pair = std::pair<std::size_t, std::size_t>;

  Passages(const HairRun<float>& run, std::vector<Pair> watched)
      : run_(run), watched_(std::move(watched)), sides_(watched_.size()), points_(points_of(run)) {}

  // The run has gone on.
  void look() {
    const auto now = points_of(run_);
    const auto box = [&](std::size_t strand, std::size_t i) {  // of a segment's way
      Eigen::AlignedBox3d box(points_[strand][i]);
      return box.extend(points_[strand][i + 1]).extend(now[strand][i]).extend(now[strand][i + 1]);
    };
    tbb::parallel_for(std::size_t{0}, watched_.size(), [&](std::size_t k) {
      const auto [one, other] = watched_[k];
      for (std::size_t i = 0; i + 1 < now[one].size(); ++i)
        for (std::size_t j = 0; j + 1 < now[other].size(); ++j) {
          if (!box(one, i).intersects(box(other, j))) continue;
          const auto ends = [&](const HairPoints& at) -> oracle::SegmentEnds {
            return {at[one][i], at[one][i + 1], at[other][j], at[other][j + 1]};
          };
          const oracle::SegmentMotion motion{ends(points_), ends(now)};
          if (may_cross(motion)) sides_[k] += oracle::segment_crossings(motion, 200).sides;
        }
    });
    points_ = now;
  }
  int through() const {
    return static_cast<int>(std::count_if(sides_.begin(), sides_.end(), [](int side) { return side != 0; }));
  }

 private:
  static HairPoints points_of(const HairRun<float>& run) {
    HairPoints points(run.strands());
    for (std::size_t s = 0; s < run.strands(); ++s)
      for (int i = 0; i < run.count(s); ++i) points[s].push_back(run.position(s, i));
    return points;
  }

  // Not where the volume has one sign throughout: it is a cubic in time, within its Bernstein coefficients.
  static bool may_cross(const oracle::SegmentMotion& motion) {
    const auto volume = [&](double share) { return oracle::tetrahedron_volume(motion.after(share)); };
    const double first = volume(0), third = volume(1.0 / 3), two_thirds = volume(2.0 / 3), last = volume(1);
    const double one = (-5 * first + 18 * third - 9 * two_thirds + 2 * last) / 6,
                 two = (2 * first - 9 * third + 18 * two_thirds - 5 * last) / 6;
    return std::min({first, one, two, last}) <= 0 && std::max({first, one, two, last}) >= 0;
  }

  const HairRun<float>& run_;
  std::vector<Pair> watched_;
  std::vector<int> sides_;
  HairPoints points_;
};

class CrossingStrands : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Strands, CrossingStrands, testing::Values(2, 200, 20000));

TEST_P(CrossingStrands, DoNotPassThroughOneAnother) {
  constexpr int kFrames = 4;  // after two they have met, without contacts they would be 8 cm past
  const Layers layers(GetParam(), 9, 0.005);
  const auto meetings = layers.meetings();
  const auto all = static_cast<double>(meetings.size());
  HairRun<float> run(layers.strands, kRadius, 0);
  Passages passages(run, meetings);
  double worst = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    run.frame(), passages.look();
    worst = std::max(worst, passages.through() / all);
  }
  RecordProperty("missed_percent", std::to_string(100 * worst));
  std::cout << GetParam() << " strands, " << all << " crossings: " << 100 * worst << " % missed\n";
  EXPECT_TRUE(worst < 0.01) << 100 * worst << " % missed";

  // They meet at all.
  HairRun<float> without(layers.strands, kRadius, 0);
  without.passes = 0;
  Passages free(without, meetings);
  for (int frame = 0; frame < 3; ++frame) without.frame(), free.look();
  EXPECT_GT(free.through(), 0.95 * all);
}

// Hair that grows from a ring towards its middle, straight out, and falls under gravity on a bed of strands
// that are prescribed from end to end, and hair on hair.
class Heap {
 public:
  static constexpr int kHairs = 24, kParticles = 10, kBed = 51;

  static constexpr std::size_t kStrands = kHairs + 2 * kBed;

  // `first`: which of the strands their list begins with; it goes round.
  explicit Heap(std::size_t first = 0, kernels::HostThreads threads = {run_with_tbb, nullptr})
      : first_(first), run_(strands(first), kRadius, 2, kernels::best_instruction_set(), threads) {
    run_.strand.gravity[1] = T(-9.81), run_.strand.drag = T(2), run_.passes = 16;
  }
  void frame() { run_.frame(true); }
  double fastest() const {
    double most = 0;
    for_particles([&](std::size_t s, int i) { most = std::max(most, run_.velocity(s, i).norm()); });
    return most;
  }
  double kinetic_energy() const {  // a particle
    double sum = 0;
    for_particles([&](std::size_t s, int i) { sum += 0.5 * run_.velocity(s, i).squaredNorm(); });
    return sum / (kHairs * kParticles);
  }
  double lowest() const {  // but for tips, which may hang in the bed's meshes
    double least = 1;
    for_particles([&](std::size_t s, int i) {
      if (i + 1 < kParticles) least = std::min(least, run_.position(s, i).y());
    });
    return least;
  }
  // Places and velocities of the hairs.
  std::vector<Vec3> state() const {
    std::vector<Vec3> state;
    for_particles([&](std::size_t s, int i) {
      state.push_back(run_.position(s, i)), state.push_back(run_.velocity(s, i));
    });
    return state;
  }
  // Of which one may be through the other: a hair and another strand.
  std::vector<std::pair<std::size_t, std::size_t>> meetings() const {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t s = 0; s < kHairs; ++s)
      for (std::size_t other = s + 1; other < kStrands; ++other) pairs.emplace_back(number(s), number(other));
    return pairs;
  }
  const HairRun<float>& run() const { return run_; }

 private:
  using T = float;
  static std::vector<HairStrand> strands(std::size_t first) {
    Random random(11);
    std::vector<HairStrand> strands;
    for (int s = 0; s < kHairs; ++s) {
      const double turn = 2 * std::numbers::pi * s / kHairs;
      const Vec3 out(std::cos(turn), 0, std::sin(turn));
      const Vec3 along =
          -0.07 *
          (out + 0.3 * Vec3(random.symmetric(), 0.2 * random.symmetric(), random.symmetric())).normalized();
      const Vec3 root = 0.045 * out + Vec3(0, 0.002 + 0.001 * s, 0);
      strands.push_back(straight_strand(root + 0.5 * along, along, kParticles, Vec3::Zero()));
    }
    for (int k = 0; k < 2 * kBed; ++k) {
      const double at = 0.002 * (k / 2 - kBed / 2);
      const Vec3 along = 0.12 * (k % 2 ? Vec3::UnitX() : Vec3::UnitZ());
      const Vec3 middle = k % 2 ? Vec3(0, 0, at) : Vec3(at, -2.5 * kRadius, 0);
      strands.push_back(straight_strand(middle, along, 2, Vec3::Zero()));
    }
    std::rotate(strands.begin(), strands.begin() + static_cast<std::ptrdiff_t>(first), strands.end());
    return strands;
  }
  // Of a strand in the run's list.
  std::size_t number(std::size_t strand) const { return (strand + kStrands - first_) % kStrands; }
  template <class Visit>
  void for_particles(const Visit& visit) const {
    for (std::size_t s = 0; s < kHairs; ++s)
      for (int i = 0; i < kParticles; ++i) visit(number(s), i);
  }

  std::size_t first_;
  HairRun<T> run_;
};

TEST(HeapOfStrands, ComesToRest) {
  constexpr int kFrames = 72, kLanded = 6;
  Heap heap;
  Passages passages(heap.run(), heap.meetings());
  int most = 0, landed = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    heap.frame(), passages.look();
    most = std::max(most, passages.through());
    if (frame + 1 == kLanded) landed = passages.through();
  }
  // Each hair lies across half of either layer of the bed and half of the other hairs.
  const int meetings = Heap::kHairs * (Heap::kBed + Heap::kHairs / 4);
  std::cout << "heap: of some " << meetings << " meetings " << most << " missed at most, "
            << passages.through() << " at rest\n";
  EXPECT_LT(most, 0.01 * meetings);
  EXPECT_LE(passages.through(), landed + 1);  // what lies, lies
  EXPECT_TRUE(heap.kinetic_energy() <= 2e-5) << heap.kinetic_energy();
  EXPECT_TRUE(heap.fastest() <= 0.05) << heap.fastest();
  EXPECT_GT(heap.lowest(), -1e-3);  // on the bed
}

// While it falls, with strands through one another that are known from one substep to the next.
TEST(HeapOfStrands, IsTheSameInAnyOrderAndByAnyThreads) {
  constexpr int kFrames = 12;
  std::mt19937 generator(5);
  Heap heap, other_order(Heap::kHairs / 2), shuffled(0, {chunks_shuffled, &generator}),
      both(Heap::kStrands - 7, {chunks_on_two_threads, nullptr});
  int through = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    for (Heap* h : {&heap, &other_order, &shuffled, &both}) h->frame();
    through = std::max(through, heap.run().contacts->kept());
    for (const Heap* h : {&other_order, &shuffled, &both})
      ASSERT_EQ(h->state(), heap.state()) << "in frame " << frame;
  }
  EXPECT_GT(through, 0) << "nothing was through anything";
}

}  // namespace
}  // namespace ringlet::kernels_testing
