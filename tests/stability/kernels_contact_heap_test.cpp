// Crossing strands do not pass through one another, and a heap of strands comes to rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <numbers>
#include <random>

#include "contact_support.h"
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
};

struct Sides {
  int crossings = 0, wrong = 0;  // seen from above; those whose lower layer's strand is above
};

template <class T>
Sides sides_of(const HairRun<T>& run, const Layers& layers) {
  Sides sides;
  const auto look = [&](std::size_t one, std::size_t other) {
    for (int i = 0; i + 1 < run.count(one); ++i)
      for (int k = 0; k + 1 < run.count(other); ++k) {
        const Vec3 a = run.position(one, i), u = run.position(one, i + 1) - a, b = run.position(other, k),
                   w = run.position(other, k + 1) - b, p = b - a;
        const double area = u.x() * w.z() - u.z() * w.x();
        const double s = (p.x() * w.z() - p.z() * w.x()) / area, t = (p.x() * u.z() - p.z() * u.x()) / area;
        if (!(s >= 0 && s < 1 && t >= 0 && t < 1)) continue;
        ++sides.crossings, sides.wrong += (a + s * u).y() > (b + t * w).y();
      }
  };
  for (int patch = 0; patch < layers.patches; ++patch)
    for (int k = 0; k < layers.side * layers.side; ++k) {
      const std::size_t first = static_cast<std::size_t>(patch) * 2 * layers.side;
      look(first + k / layers.side, first + layers.side + k % layers.side);
    }
  return sides;
}

class CrossingStrands : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Strands, CrossingStrands, testing::Values(2, 200, 20000));

TEST_P(CrossingStrands, DoNotPassThroughOneAnother) {
  constexpr int kFrames = 4;  // after two they have met, without contacts they would be 8 cm past
  const Layers layers(GetParam(), 9, 0.005);
  HairRun<float> run(layers.strands, kRadius, 0);
  const int meetings = layers.patches * layers.side * layers.side;
  double worst = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    run.frame();
    const Sides sides = sides_of(run, layers);
    worst = std::max(worst, static_cast<double>(sides.wrong) / meetings);
    EXPECT_GT(sides.crossings, 0.8 * meetings) << "in frame " << frame << " they should still lie across";
  }
  RecordProperty("missed_percent", std::to_string(100 * worst));
  std::cout << GetParam() << " strands, " << meetings << " crossings: " << 100 * worst << " % missed\n";
  EXPECT_TRUE(worst < 0.01) << 100 * worst << " % missed";

  // They meet at all.
  HairRun<float> without(layers.strands, kRadius, 0);
  without.passes = 0;
  for (int frame = 0; frame < 3; ++frame) without.frame();
  EXPECT_GT(sides_of(without, layers).wrong, 0.8 * meetings);
}

// Hair that grows from a ring towards its middle, straight out, and falls under gravity on a bed of strands
// that are prescribed from end to end, and hair on hair.
class Heap {
 public:
  static constexpr int kHairs = 24, kParticles = 10, kBed = 51;

  Heap() : run_(strands(), kRadius, 2) {
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
  // [hairs][kParticles], then those of the bed, two each.
  std::vector<Vec3> points() const {
    std::vector<Vec3> points;
    for (std::size_t s = 0; s < run_.strands(); ++s)
      for (int i = 0; i < run_.count(s); ++i) points.push_back(run_.position(s, i));
    return points;
  }

 private:
  using T = float;
  static std::vector<HairStrand> strands() {
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
    return strands;
  }
  template <class Visit>
  void for_particles(const Visit& visit) const {
    for (std::size_t s = 0; s < kHairs; ++s)
      for (int i = 0; i < kParticles; ++i) visit(s, i);
  }

  HairRun<T> run_;
};

// Which strands are through which: passages of their segments from one side to the other, back ones taken
// off.
class Passages {
 public:
  explicit Passages(std::vector<Vec3> points) : points_(std::move(points)) {
    const int hair = Heap::kHairs * Heap::kParticles;
    for (int p = 0; p + 1 < static_cast<int>(points_.size()); ++p) {
      const bool last = p < hair ? p % Heap::kParticles == Heap::kParticles - 1 : (p - hair) % 2 == 1;
      const int strand = p < hair ? p / Heap::kParticles : Heap::kHairs + (p - hair) / 2;
      if (!last) segments_.emplace_back(p, strand);
    }
  }

  void move_to(std::vector<Vec3> points) {
    for (const auto& [a, one] : segments_)
      for (const auto& [b, other] : segments_) {
        if (one >= other || one >= Heap::kHairs) continue;
        const oracle::SegmentMotion motion{{points_[a], points_[a + 1], points_[b], points_[b + 1]},
                                           {points[a], points[a + 1], points[b], points[b + 1]}};
        const auto below = [](const oracle::SegmentEnds& e) { return oracle::tetrahedron_volume(e) < 0; };
        if (below(motion.start) != below(motion.end) && oracle::segment_crossings(motion, 200).count % 2 == 1)
          sides_[{one, other}] += below(motion.start) ? 1 : -1;
      }
    points_ = std::move(points);
  }
  int through() const {
    return static_cast<int>(
        std::count_if(sides_.begin(), sides_.end(), [](const auto& side) { return side.second != 0; }));
  }

 private:
  std::vector<Vec3> points_;
  std::vector<std::pair<int, int>> segments_;  // first point, strand
  std::map<std::pair<int, int>, int> sides_;
};

TEST(HeapOfStrands, ComesToRest) {
  constexpr int kFrames = 72, kLanded = 6;
  Heap heap;
  Passages passages(heap.points());
  int most = 0, landed = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    heap.frame();
    passages.move_to(heap.points());
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

}  // namespace
}  // namespace ringlet::kernels_testing
