// The real grooms, from scene file to frames: scenes/real on the data that RINGLET_DATA names.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>

#include "oracle/mesh_distance.h"
#include "oracle/openings.h"
#include "pipeline/simulation.h"
#include "scene/scene.h"

namespace ringlet::pipeline {
namespace {

using oracle::MeshDistance;

constexpr double kDepth = 0.5e-3;          // [m] deepest that a particle may end a frame inside the mesh
constexpr double kFreeStrain = 1e-3;       // of strands that no solid moved
constexpr double kMovedStrain = 1e-2;      // of those that one did, 99.9th percentile
constexpr double kShortestSegment = 1e-6;  // [m] shorter ones are not held to their lengths
constexpr double kRounding = 4e-7;  // of a length between points in single precision, of their coordinates
constexpr double kStrainRounding = 2e-5;

std::filesystem::path data_folder() {
  const char* named = std::getenv("RINGLET_DATA");
  return named ? named : RINGLET_SOURCE_DIR "/../shared/data";
}

// One of scenes/real, its assets taken from the data folder. `files` go from JSON pointer to path there.
scene::Scene real_scene(const std::string& name, const std::map<std::string, std::string>& files,
                        std::vector<std::string> overrides) {
  for (const auto& [pointer, file] : files)
    overrides.push_back(pointer + "=\"" + (data_folder() / file).string() + "\"");
  return scene::load(std::filesystem::path(RINGLET_SOURCE_DIR) / "scenes/real" / (name + ".json"),
                     {overrides});
}

class Listener : public state::FrameSink {
 public:
  explicit Listener(std::function<void(const state::Frame&, const state::Snapshot&)> heard)
      : heard_(std::move(heard)) {}
  void write(state::Frame frame, state::Snapshot snapshot, double) override { heard_(frame, snapshot); }
  void finish() override {}

 private:
  std::function<void(const state::Frame&, const state::Snapshot&)> heard_;
};

double figure(const state::Frame& frame, const std::string& name) {
  for (const auto& [key, value] : frame.figures)
    if (key == name) return value;
  ADD_FAILURE() << "no figure " << name;
  return NAN;
}

// What every frame of a real groom must hold, from its positions and by means of their own.
class FrameChecks {
 public:
  explicit FrameChecks(const state::RunHeader& header) : header_(header), buried_(strands(), 0) {}

  void check(const state::Frame& frame, bool distances) {
    SCOPED_TRACE("frame " + std::to_string(frame.number));
    ASSERT_TRUE(
        std::all_of(frame.position.begin(), frame.position.end(), [](float x) { return std::isfinite(x); }));
    check_strain(frame);
    if (distances) check_depth(frame);
  }

  void print() const {
    std::printf(
        "%s: %zu strands, %td buried; deepest %.3f mm; strain: free %.1e, moved: p99.9 %.1e, worst %.1e; "
        "strands moved, at most: %.0f; over 1e-2: %td; deep: %d particles\n",
        header_.name.c_str(), strands(), std::count(buried_.begin(), buried_.end(), 1), 1e3 * deepest_, free_,
        moved_p999_, moved_, strands_moved_, stretched_, deep_);
  }

 private:
  std::size_t strands() const { return header_.offsets.size() - 1; }

  MeshDistance::Vec3 point(const std::vector<float>& from, std::int64_t i) const {
    return header_.metres_per_unit * MeshDistance::Vec3(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
  }

  // The head as posed, its openings closed: an open mesh has no inside of its own.
  MeshDistance posed_head(const state::Frame& frame) const {
    const std::vector<float>& coordinates = frame.surface_vertices.at(0);
    std::vector<MeshDistance::Vec3> vertices;
    for (std::size_t v = 0; v < coordinates.size() / 3; ++v)
      vertices.push_back(point(coordinates, static_cast<std::int64_t>(v)));
    const std::vector<std::int32_t>& t = header_.surfaces.at(0).triangles;
    std::vector<MeshDistance::Triangle> triangles;
    for (std::size_t k = 0; k < t.size(); k += 3) triangles.push_back({t[k], t[k + 1], t[k + 2]});
    return oracle::with_openings_closed(std::move(vertices), std::move(triangles));
  }

  double rest_edge(std::int64_t i) const {
    return (point(header_.rest_position, i + 1) - point(header_.rest_position, i)).norm();
  }

  // Strands whose root lies deeper than they are long.
  void find_buried(const state::Frame& frame, const MeshDistance& head) {
    for_each_strand([&](std::size_t s) {
      double length = 0;
      for (auto i = header_.offsets[s]; i + 1 < header_.offsets[s + 1]; ++i) length += rest_edge(i);
      buried_[s] = -head.signed_distance(point(frame.position, header_.offsets[s])) > 0.999 * length;
    });
  }

  void check_strain(const state::Frame& frame) {
    std::vector<double> strain(strands(), 0.0);
    for_each_strand([&](std::size_t s) {
      for (auto i = header_.offsets[s]; i + 1 < header_.offsets[s + 1]; ++i) {
        const double now = (point(frame.position, i + 1) - point(frame.position, i)).norm(),
                     rest = rest_edge(i);
        const double rounding = kRounding * point(frame.position, i).norm();
        if (rest >= kShortestSegment)
          strain[s] = std::max(strain[s], (std::abs(now - rest) - rounding) / rest);
      }
    });
    if (frame.number == header_.first_frame) return;  // not stepped yet: no figures
    const double free = figure(frame, "edge_strain_free"), worst = figure(frame, "edge_strain_moved"),
                 p999 = figure(frame, "edge_strain_moved_p999"), moved = figure(frame, "strands_moved");
    EXPECT_TRUE(free <= kFreeStrain) << free;
    EXPECT_TRUE(p999 <= kMovedStrain) << p999;
    const auto beyond = [&](double limit) {
      return std::count_if(strain.begin(), strain.end(),
                           [&](double e) { return !(e <= limit + kStrainRounding); });
    };
    EXPECT_EQ(beyond(std::max(free, worst)), 0) << "figures are smaller than the positions'";
    EXPECT_LE(beyond(std::max(free, p999)), moved - 1 - std::ceil(0.999 * (moved - 1)));
    EXPECT_LE(beyond(kFreeStrain), moved);
    EXPECT_LE(beyond(kMovedStrain), 1e-3 * moved);
    stretched_ = std::max(stretched_, beyond(kMovedStrain));
    free_ = std::max(free_, free), moved_ = std::max(moved_, worst),
    moved_p999_ = std::max(moved_p999_, p999);
    strands_moved_ = std::max(strands_moved_, moved);
  }

  // No particle deep inside, roots and their neighbours aside.
  void check_depth(const state::Frame& frame) {
    const MeshDistance head = posed_head(frame);
    find_buried(frame, head);
    std::atomic<int> deep = 0;
    std::mutex mutex;
    const double asked = std::min(deepest_, kDepth);  // what is no deeper needs no winding number
    for_each_strand([&](std::size_t s) {
      if (buried_[s]) return;
      for (auto i = header_.offsets[s] + 2; i < header_.offsets[s + 1]; ++i) {
        const MeshDistance::Vec3 x = point(frame.position, i);
        const double depth = head.closest(x).distance;
        if (depth <= asked || !head.inside(x)) continue;
        deep += !(depth <= kDepth);
        const std::lock_guard lock(mutex);
        deepest_ = std::max(deepest_, depth);
      }
    });
    deep_ = std::max(deep_, deep.load());
    EXPECT_EQ(deep, 0) << "the deepest so far " << 1e3 * deepest_ << " mm";
  }

  template <class Visit>
  void for_each_strand(const Visit& visit) const {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, strands(), 32), [&](const auto& range) {
      for (std::size_t s = range.begin(); s < range.end(); ++s) visit(s);
    });
  }

  const state::RunHeader& header_;
  std::vector<char> buried_;
  std::ptrdiff_t stretched_ = 0;
  int deep_ = 0;
  double deepest_ = 0, free_ = 0, moved_ = 0, moved_p999_ = 0, strands_moved_ = 0;
};

struct RealGroom {
  const char* scene;
  std::map<std::string, std::string> files;
  std::vector<std::string> overrides;
  std::int64_t strands, particles;
  int distances_every;  // frames: the independent distances take longer than the frames
};

std::ostream& operator<<(std::ostream& out, const RealGroom& groom) { return out << groom.scene; }

const std::map<std::string, std::string> kHarolongo{{"/head/mesh", "curly/head_shake.glb"},
                                                    {"/groom/file", "curly/harolongo.data"}};

class RealGrooms : public testing::TestWithParam<RealGroom> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(data_folder())) GTEST_SKIP() << "no RINGLET_DATA";
  }
};

TEST_P(RealGrooms, RunOutsideTheirHeadsAndKeepTheirLengths) {
  const RealGroom& groom = GetParam();
  const scene::Scene scene = real_scene(groom.scene, groom.files, groom.overrides);
  const auto simulation = Simulation::create(scene, {});
  EXPECT_EQ(simulation->plan().strands, groom.strands);
  EXPECT_EQ(simulation->plan().particles, groom.particles);
  const FrameRange range{scene.frames.first, scene.frames.last};
  const state::RunHeader header = simulation->header(range);
  FrameChecks checks(header);
  int frames = 0;
  Listener sink([&](const state::Frame& frame, const state::Snapshot&) {
    ++frames;
    checks.check(frame, frame.number % groom.distances_every == 0 || frame.number == range.last);
  });
  EXPECT_TRUE(simulation->run(range, sink, {}));
  EXPECT_EQ(frames, range.last - range.first + 1);
  checks.print();
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::printf("%s: peak memory %.0f MB, the test's own distances included\n", groom.scene,
              usage.ru_maxrss / 1024.0);
  EXPECT_LT(usage.ru_maxrss, 600 * 1024);
}

INSTANTIATE_TEST_SUITE_P(
    Data, RealGrooms,
    testing::Values(
        RealGroom{"harolongo", kHarolongo, {}, 7905, 166005, 4},
        RealGroom{"ponytail",
                  {{"/head/mesh", "ponytail/head.obj"}, {"/groom/file", "ponytail/ponytail.hair"}},
                  {"/frames/last=25"},
                  4933,
                  78928,
                  6},
        RealGroom{"bear",
                  {{"/head/mesh", "bear/bear_walk.glb"},
                   {"/groom/file", "bear/bear.tfx"},
                   {"/groom/skin", "bear/bear.tfxskin"}},
                  {"/frames/last=25"},
                  48113,
                  192452,
                  8},
        RealGroom{"stubble", {{"/head/mesh", "face/head_morph.glb"}}, {"/frames/last=25"}, 12000, 48000, 6}),
    [](const auto& info) { return std::string(info.param.scene); });

class Quiet : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(data_folder())) GTEST_SKIP() << "no RINGLET_DATA";
  }

  // The solver's own reals, in its own order: root-relative metres.
  template <class T>
  static std::vector<T> positions(const state::Snapshot& snapshot) {
    const std::vector<std::byte>& bytes = snapshot.arrays.at("position");
    std::vector<T> values(bytes.size() / sizeof(T));
    std::memcpy(values.data(), bytes.data(), bytes.size());
    return values;
  }

  // How far anything moves, over all frames, in parts of the shortest strand's length.
  template <class T>
  static double drift(int last_frame, Precision precision) {
    const scene::Scene scene = real_scene(
        "harolongo", kHarolongo,
        {"/head/animation=null", "/effects/solids=null", "/frames/last=" + std::to_string(last_frame)});
    Options options;
    options.precision = precision;
    const auto simulation = Simulation::create(scene, options);
    const state::RunHeader header = simulation->header({1, last_frame});
    double shortest = 1e30;
    for (std::size_t s = 0; s + 1 < header.offsets.size(); ++s) {
      double length = 0;
      for (auto i = 3 * header.offsets[s]; i < 3 * (header.offsets[s + 1] - 1); i += 3)
        length += std::hypot(header.rest_position[i + 3] - header.rest_position[i],
                             header.rest_position[i + 4] - header.rest_position[i + 1],
                             header.rest_position[i + 5] - header.rest_position[i + 2]);
      shortest = std::min(shortest, length * header.metres_per_unit);
    }
    std::vector<T> start;
    double farthest = 0;
    Listener sink([&](const state::Frame&, const state::Snapshot& snapshot) {
      const std::vector<T> now = positions<T>(snapshot);
      if (start.empty()) start = now;
      for (std::size_t i = 0; i < now.size(); ++i) {
        const double moved = std::abs(static_cast<double>(now[i]) - static_cast<double>(start[i]));
        if (!(moved <= farthest)) farthest = moved;
      }
    });
    simulation->run({1, last_frame}, sink, {});
    std::printf("drift: %.2g m, the shortest strand is %.2g m long\n", farthest, shortest);
    return farthest / shortest;
  }
};

TEST_F(Quiet, TenSecondsOfHarolongoOnAStillHead) {
  const double moved = drift<float>(241, Precision::kFloat);
  EXPECT_TRUE(moved <= 1e-5) << moved;
}

TEST_F(Quiet, InDoubleToRounding) {
  const double moved = drift<double>(25, Precision::kDouble);
  EXPECT_TRUE(moved <= 1e-12) << moved;
}

TEST_F(Quiet, ParticlesThatStartInsideTheHeadAreNotKicked) {
  const scene::Scene scene = real_scene("harolongo", kHarolongo, {"/head/animation=null", "/frames/last=25"});
  const auto simulation = Simulation::create(scene, {});
  double fastest = 0;
  Listener sink([&](const state::Frame& frame, const state::Snapshot&) {
    if (frame.number == scene.frames.first) return;
    const double speed = figure(frame, "speed_max");
    if (!(speed <= fastest)) fastest = speed;
  });
  simulation->run({1, 25}, sink, {});
  std::printf("fastest particle of the first second: %.3g m/s\n", fastest);
  EXPECT_TRUE(fastest <= 0.05) << fastest;
}

}  // namespace
}  // namespace ringlet::pipeline
