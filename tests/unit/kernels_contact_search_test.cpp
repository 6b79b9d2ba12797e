// The search for pairs of segments against all pairs, and the tubes that it compares.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "contact_support.h"
#include "kernels/backend/host.h"
#include "kernels/contact/pair_search.h"
#include "kernels/contact/segment_sorter.h"

namespace ringlet::kernels_testing {
namespace {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double symmetric() { return uniform_(engine_); }
  double between(double low, double high) { return low + 0.5 * (high - low) * (1 + symmetric()); }
  Vec3 vector(double size) { return size * Vec3(symmetric(), symmetric(), symmetric()); }

 private:
  std::mt19937 engine_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
};

template <class T>
kernels::Vector3<T> vector_of(const Vec3& v) {
  return {static_cast<T>(v.x()), static_cast<T>(v.y()), static_cast<T>(v.z())};
}

// A segment that moves, and what is about it.
struct Moved {
  Vec3 begin[2], end[2];
  double margin;

  template <class T>
  kernels::Tube<T> tube(bool still, int axis) const {
    using V = kernels::Vector3<T>;
    const V first = vector_of<T>(begin[0]), last = vector_of<T>(end[0]);
    if (still) return kernels::Tube<T>::template about<1>({first}, {last}, static_cast<T>(margin), axis);
    return kernels::Tube<T>::template about<2>({first, vector_of<T>(begin[1])}, {last, vector_of<T>(end[1])},
                                               static_cast<T>(margin), axis);
  }
  Vec3 place(double along, double time) const {
    const Vec3 first = begin[0] + time * (begin[1] - begin[0]), last = end[0] + time * (end[1] - end[0]);
    return first + along * (last - first);
  }
};

template <class T>
class ContactSearch : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(ContactSearch, Precisions);

// Two that come as near as their margins at some places and times have tubes that meet, whatever the axis.
TYPED_TEST(ContactSearch, TubesOfWhatIsNearMeet) {
  Random random(3);
  int told_apart = 0, apart = 0;
  constexpr int kTrials = 20000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const bool still = trial % 2 == 0;
    Moved one, other;
    const Vec3 along = random.vector(0.01);  // of both, more or less, or of neither
    const double spread = trial % 3 == 0 ? 0.01 : 0.001;
    for (Moved* segment : {&one, &other}) {
      segment->begin[0] = random.vector(0.003),
      segment->end[0] = segment->begin[0] + along + random.vector(spread);
      segment->begin[1] = segment->begin[0] + random.vector(0.002);
      segment->end[1] = segment->end[0] + random.vector(0.002);
      segment->margin = random.between(0, 1e-3);
      if (trial % 50 == 1) segment->end[0] = segment->begin[0];  // of no length
    }
    double nearest = 1;
    constexpr int kPlaces = 12, kTimes = 5;
    for (int a = 0; a <= kPlaces; ++a)
      for (int b = 0; b <= kPlaces; ++b)
        for (int t = 0; t <= kTimes; ++t)
          for (int u = 0; u <= kTimes; ++u) {
            const double times[2] = {still ? 0.0 : t / double{kTimes}, still ? 0.0 : u / double{kTimes}};
            nearest = std::min(nearest, (one.place(a / double{kPlaces}, times[0]) -
                                         other.place(b / double{kPlaces}, times[1]))
                                            .norm());
            if (still) t = u = kTimes;
          }
    for (int axis = 0; axis < 3; ++axis) {
      const bool meet = one.tube<TypeParam>(still, axis).meets(other.tube<TypeParam>(still, axis));
      EXPECT_TRUE(meet || nearest > one.margin + other.margin - 1e-8) << trial << ' ' << axis;
      if (nearest > one.margin + other.margin + 0.002) told_apart += !meet, ++apart;
    }
  }
  EXPECT_GT(told_apart, 0.5 * apart) << "tubes are of use";
}

// Segments of one to a hundred millimetres that move together and a little each for itself.
TYPED_TEST(ContactSearch, FindsThePairsThatThereAre) {
  using T = TypeParam;
  constexpr int kStrands = 900;
  constexpr double kRadius = 1e-4;
  Random random(11);
  std::vector<HairStrand> strands;
  for (int s = 0; s < kStrands; ++s) {
    const double length = std::pow(10, random.between(-3, -1));
    const Vec3 middle = s == 0 ? Vec3(40, -30, 20) : random.vector(0.05);  // one was flung away
    strands.push_back(straight_strand(middle, length * random.vector(1).normalized(), 2, Vec3::Zero()));
  }
  HairRun<T> run(strands, kRadius, 0);
  run.remember();
  const auto read = [&](std::size_t s) {
    return kernels::Segment<T>{vector_of<T>(run.position(s, 0)), vector_of<T>(run.position(s, 1))};
  };
  std::vector<kernels::Segment<T>> start, end;
  for (std::size_t s = 0; s < kStrands; ++s) start.push_back(read(s));
  for (std::size_t s = 0; s < kStrands; ++s)
    for (int i = 0; i < 2; ++i) {
      const Vec3 at = run.position(s, i);
      const Vec3 together(0.03 + 0.05 * at.y(), -0.01, 0.02 * at.x());
      run.set_position(s, i, at + together + random.vector(0.002));
    }
  for (std::size_t s = 0; s < kStrands; ++s) end.push_back(read(s));

  int pairs = 0, crossed = 0;
  for (std::size_t a = 0; a < kStrands; ++a)
    for (std::size_t b = a + 1; b < kStrands; ++b) {
      const auto contact = kernels::find_contact(kernels::SegmentPair<T>{start[a], start[b], end[a], end[b]},
                                                 T(2 * kRadius), T(0));
      crossed += contact.crossed;
      pairs += contact.crossed || contact.distance < T(kernels::kNear * 2 * kRadius);
    }
  EXPECT_GT(crossed, 50);
  EXPECT_EQ(run.contacts->begin(run.contact_step()).pairs, pairs);
}

// The search by itself, over segments that lie in one bundle, more than a list holds and more than a group,
// so dense that each has dozens of pairs, and over others all about, some of which share cells with what is
// far away.
template <class T>
class Searched {
 public:
  static constexpr double kRadius = 2e-5, kFarthest = 5e-4;

  explicit Searched(int bundle, int about) {
    Random random(5);
    for (int s = 0; s < bundle; ++s)
      add(random.vector(1).cwiseProduct(Vec3(7e-4, 0.02, 7e-4)), Vec3(0, 0.01, 0) + random.vector(5e-4),
          random);
    for (int s = 0; s < about; ++s) add(random.vector(1), random.vector(0.004), random);
    kernels::Host host(kernels::HostThreads{run_with_tbb, nullptr});
    const kernels::HairPlaces<T> places{start_.data(), end_.data(), strand_.data(),
                                        static_cast<std::int32_t>(start_.size())};
    kernels::ExtentFinder<kernels::Host, T> finder;
    const kernels::HairExtent extent = finder.find(host, places.start, places.strand, places.particles);
    kernels::SegmentSorter<kernels::Host, float, T> sorter;
    const auto table =
        sorter.sort(host, places, {extent, carried_.data(), true, 0, static_cast<float>(kFarthest)},
                    [](int) { return true; });
    const std::int32_t groups = (table.segments + kernels::kGroupSegments - 1) / kernels::kGroupSegments;
    meetings.assign(start_.size(), 0);
    std::vector<std::int32_t> hits(groups);
    kernels::PairMemory<kernels::Host> memory;
    memory.fill(host, groups, [&](const kernels::PairPool& pool) {
      std::fill(meetings.begin(), meetings.end(), 0);
      const kernels::PairSearch<float, T> search{table, meetings.data(), hits.data(), pool};
      for (std::int32_t group = 0; group < groups; ++group) search(group);
    });
    for (std::int32_t group = 0; group < groups; ++group)
      memory.pool().for_pairs(group, [&](const kernels::RankedPair& pair) { pairs.push_back(pair); });
  }

  // How many pairs each segment is in.
  std::vector<std::int32_t> expected() const {
    std::vector<std::int32_t> count(start_.size());
    for (std::size_t a = 0; a < start_.size(); a += 2)
      for (std::size_t b = a + 2; b < start_.size(); b += 2) {
        if (length(vector_of(start_[a]) - vector_of(start_[b])) > T(0.05)) continue;
        const auto contact = kernels::find_contact(
            kernels::SegmentPair<T>{ends(start_, a), ends(start_, b), ends(end_, a), ends(end_, b)},
            T(2 * kRadius), T(0));
        if (!contact.crossed && !(contact.distance < T(kernels::kNear * 2 * kRadius))) continue;
        const std::int32_t met = contact.crossed ? 1 + kernels::kCrossing : 1;
        count[a] += met, count[b] += met;
      }
    return count;
  }

  std::vector<std::int32_t> meetings;
  std::vector<kernels::RankedPair> pairs;

 private:
  using Places = std::vector<kernels::Place<T>>;

  // A strand of one segment, which moves less far than it is looked for.
  void add(const Vec3& begin, const Vec3& along, Random& random) {
    const auto place = [](const Vec3& at, double extra) {
      return kernels::Place<T>{T(at.x()), T(at.y()), T(at.z()), T(extra)};
    };
    for (const Vec3& at : {begin, Vec3(begin + along)}) {
      const auto s = static_cast<std::int32_t>(start_.size() / 2);
      strand_.push_back(start_.size() % 2 == 0 ? s : -1);
      start_.push_back(place(at, 1)), end_.push_back(place(at + random.vector(0.3 * kFarthest), kRadius));
      carried_.push_back({float(at.x()), float(at.y()), float(at.z()), 0});
    }
  }
  static kernels::Segment<T> ends(const Places& places, std::size_t s) {
    return {vector_of(places[s]), vector_of(places[s + 1])};
  }
  static kernels::Vector3<T> vector_of(const kernels::Place<T>& place) { return {place.x, place.y, place.z}; }

  Places start_, end_;
  std::vector<kernels::Place<float>> carried_;
  std::vector<std::int32_t> strand_;
};

TYPED_TEST(ContactSearch, FindsEachPairOnceAndKeepsWhatMattersMost) {
  const Searched<TypeParam> searched(3500, 3000);
  EXPECT_EQ(searched.meetings, searched.expected());
  std::map<std::int32_t, std::vector<std::int32_t>> ranks;
  std::set<std::pair<std::int32_t, std::int32_t>> different;
  for (const kernels::RankedPair& pair : searched.pairs) {
    different.insert(std::minmax(pair.a, pair.b));
    ranks[pair.a].push_back(pair.rank);
  }
  EXPECT_EQ(different.size(), searched.pairs.size());
  std::size_t most = 0;
  for (auto& [segment, its] : ranks) {
    most = std::max(most, its.size());
    EXPECT_EQ(std::set<std::int32_t>(its.begin(), its.end()).size(), its.size()) << "ranks of " << segment;
  }
  EXPECT_EQ(most, kernels::kMostPairs) << "some have more pairs than are kept";
}

// Pairs that become a little more each time are looked for once each time, but for a few.
TEST(PairMemory, GrowsAheadOfWhatItHolds) {
  constexpr int kTimes = 30, kGroups = 40;
  kernels::Host host(kernels::HostThreads{run_with_tbb, nullptr});
  kernels::PairMemory<kernels::Host> memory;
  int searches = 0, pairs = 600;  // of each group
  for (int time = 0; time < kTimes; ++time, pairs += pairs / 20) {
    memory.fill(host, kGroups, [&](const kernels::PairPool& pool) {
      ++searches;
      for (int group = 0; group < kGroups; ++group) {
        kernels::PairWriter writer{pool};
        for (int k = 0; k < pairs; ++k) writer.add({group, k, 0});
        pool.last[group] = writer.block, pool.count[group] = writer.count;
      }
    });
    const kernels::PairPool pool = memory.pool();
    std::vector<int> found(pairs);
    for (int group = 0; group < kGroups; ++group)
      pool.for_pairs(group, [&](const kernels::RankedPair& pair) { found[pair.b] += pair.a == group; });
    ASSERT_EQ(found, std::vector<int>(pairs, kGroups)) << "at time " << time;
  }
  EXPECT_LE(searches, kTimes + 6);
}

}  // namespace
}  // namespace ringlet::kernels_testing
