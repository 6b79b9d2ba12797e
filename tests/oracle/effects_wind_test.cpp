// The wind: mean, gusts and their way, turbulence, shelter.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "effects/wind/shelter_map.h"
#include "effects/wind/wind_field.h"

namespace ringlet::effects {
namespace {

const scene::Frames kFrames{1, 100, 24, 0};

scene::Wind constant(const Vec3& velocity) {
  scene::Wind wind{};
  wind.keys = {{0, velocity}};
  return wind;
}
scene::Wind turbulent(double strength, int octaves = 3, std::int64_t seed = 0) {
  scene::Wind wind = constant({4, 1, 0});
  wind.turbulence = {strength, 0.3, octaves, seed};
  return wind;
}

// The air at a point of the world.
template <class T>
Vec3 air_at(const kernels::WindField<T>& field, const Vec3& x) {
  const Vec3 relative = x - Vec3(field.origin[0], field.origin[1], field.origin[2]);
  const kernels::Vector3<T> u = kernels::air_velocity<T>(
      field, {static_cast<T>(relative.x()), static_cast<T>(relative.y()), static_cast<T>(relative.z())});
  return Vec3(u.x, u.y, u.z);
}

std::vector<Vec3> random_points(int count, double size) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-size, size);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) p = Vec3(uniform(generator), uniform(generator), uniform(generator));
  return points;
}

TEST(Wind, SinesAreSines) {
  double worst = 0, worst_float = 0;
  for (int k = -40000; k <= 40000; ++k) {
    const double x = k * 1.0001e-4, sine = std::sin(2 * std::numbers::pi * x);
    worst = std::max(worst, std::abs(kernels::sine_of_turns(x) - sine));
    const float f = static_cast<float>(x);
    worst_float = std::max(worst_float, std::abs(kernels::sine_of_turns(f) -
                                                 std::sin(2 * std::numbers::pi * static_cast<double>(f))));
  }
  EXPECT_TRUE(worst < 1e-13) << worst;
  EXPECT_TRUE(worst_float < 3e-7) << worst_float;
  EXPECT_TRUE(std::isnan(kernels::sine_of_turns(std::nan(""))));
}

TEST(Wind, KeysAreLinearAndHeld) {
  scene::Wind wind{};
  wind.keys = {{25, {1, 0, 0}}, {49, {3, 2, 0}}};  // 1 s and 2 s
  const WindField field(wind, kFrames, Vec3::Zero());
  EXPECT_EQ(field.mean(-5), Vec3(1, 0, 0));
  EXPECT_EQ(field.mean(0.5), Vec3(1, 0, 0));
  EXPECT_LT((field.mean(1.5) - Vec3(2, 1, 0)).norm(), 1e-15);
  EXPECT_EQ(field.mean(9), Vec3(3, 2, 0));
  EXPECT_LT((field.travel(3) - Vec3(1 + 2 + 3, 1 + 2, 0)).norm(), 1e-14);
  EXPECT_LT((field.travel(-2) - Vec3(-2, 0, 0)).norm(), 1e-15);
}

TEST(Wind, GustsStayWithinTheirStrengthAndMeanNothing) {
  scene::Wind wind = constant({2, 0, 0});
  wind.gusts = {0.5, 1.5, 3};
  const WindField field(wind, kFrames, Vec3::Zero());
  double least = 9, most = 0;
  for (int k = 0; k < 100000; ++k) {
    const double speed = field.mean(0.01 * k).x();
    least = std::min(least, speed), most = std::max(most, speed);
  }
  EXPECT_TRUE(least >= 1 && least < 1.1 && most <= 3 && most > 2.9) << least << " " << most;
  EXPECT_NEAR(field.travel(1000).x() / 1000, 2, 2e-3);
}

// The way is the integral of the mean wind: Simpson's rule over it, keys and gusts together.
TEST(Wind, TravelsTheIntegralOfItsMean) {
  scene::Wind wind{};
  wind.keys = {{1, {1, 0, 5}}, {13, {3, 2, -1}}, {37, {0, 0, 0}}};
  wind.gusts = {0.8, 0.7, 3};
  const WindField field(wind, kFrames, Vec3::Zero());
  for (const double end : {0.3, 0.5, 1.7, 4.0, -1.3}) {
    Vec3 sum = Vec3::Zero();
    const double knots[] = {0, std::min(end, 0.5), std::min(end, 1.5), end};
    for (int piece = 0; piece < 3; ++piece) {
      constexpr int kSteps = 400;
      const double h = (knots[piece + 1] - knots[piece]) / kSteps;
      for (int k = 0; k <= kSteps; ++k)
        sum += h / 3 * (k == 0 || k == kSteps ? 1 : k % 2 ? 4 : 2) * field.mean(knots[piece] + h * k);
    }
    EXPECT_LT((field.travel(end) - sum).norm(), 1e-7) << end;
  }
}

TEST(Turbulence, HasTheIntensityAskedForInEveryDirectionAlike) {
  for (const int octaves : {1, 3, 6}) {
    const auto field = WindField(turbulent(0.4, octaves), kFrames, Vec3::Zero()).at<double>(0.7);
    const Vec3 mean(field.mean[0], field.mean[1], field.mean[2]);
    EXPECT_EQ(mean, Vec3(4, 1, 0));
    Vec3 sum = Vec3::Zero(), square = Vec3::Zero();
    const auto points = random_points(20000, 40);
    for (const Vec3& p : points) {
      const Vec3 u = air_at(field, p) - mean;
      sum += u, square += u.cwiseAbs2();
    }
    const double rms = std::sqrt(square.sum() / points.size()), expected = 0.4 * mean.norm();
    EXPECT_NEAR(rms, expected, 0.02 * expected) << octaves;
    EXPECT_LT((sum / points.size()).norm(), 0.03 * expected) << octaves;
    const Vec3 share = square / square.sum();
    EXPECT_TRUE(share.minCoeff() > 0.2 && share.maxCoeff() < 0.5) << octaves << ": " << share.transpose();
  }
}

// Each wave runs across its own amplitude, and so has no divergence at any point.
TEST(Turbulence, EveryWaveIsDivergenceFreeToRounding) {
  const WindField wind(turbulent(0.5, 6), kFrames, Vec3(1, 2, 3));
  const auto check = [](const auto& field, double rounding) {
    EXPECT_EQ(field.modes, 48);
    for (int n = 0; n < field.modes; ++n) {
      const auto &k = field.wave[n], &a = field.amplitude[n];
      const Vec3 wave(k[0], k[1], k[2]), amplitude(a[0], a[1], a[2]);
      EXPECT_GT(wave.norm() * amplitude.norm(), 0);
      EXPECT_LT(std::abs(wave.dot(amplitude)), rounding * wave.norm() * amplitude.norm()) << n;
    }
  };
  check(wind.at<double>(0.2), 1e-15);
  check(wind.at<float>(0.2), 2e-7);
}

// Central differences leave a divergence of their own order, and no other.
TEST(Turbulence, IsDivergenceFreeToTheOrderOfTheDifference) {
  const auto field = WindField(turbulent(0.5), kFrames, Vec3(1, 2, 3)).at<double>(0.2);
  const auto points = random_points(200, 0.5);
  std::vector<double> rms;
  double gradient = 0;
  for (const double h : {0.02, 0.01, 0.005, 0.0025}) {
    double sum = 0;
    for (const Vec3& p : points) {
      double divergence = 0;
      for (int c = 0; c < 3; ++c) {
        const Vec3 step = h * Vec3::Unit(c);
        const Vec3 slope = (air_at(field, p + step) - air_at(field, p - step)) / (2 * h);
        divergence += slope[c];
        if (h == 0.0025) gradient += slope.squaredNorm();
      }
      sum += divergence * divergence;
    }
    rms.push_back(std::sqrt(sum / points.size()));
  }
  for (std::size_t k = 1; k < rms.size(); ++k) {
    const double order = std::log2(rms[k - 1] / rms[k]);
    EXPECT_NEAR(order, 2, 0.15) << rms[k];
  }
  EXPECT_LT(rms.back(), 2e-3 * std::sqrt(gradient / points.size()));
}

TEST(Turbulence, IsCarriedByTheMeanWind) {
  const WindField wind(turbulent(0.5), kFrames, Vec3(0.1, 0.2, 0.3));
  const auto then = wind.at<double>(0.25), now = wind.at<double>(3.5);
  const Vec3 way = wind.travel(3.5) - wind.travel(0.25);
  for (const Vec3& p : random_points(50, 2))
    EXPECT_LT((air_at(now, p + way) - air_at(then, p)).norm(), 1e-10);
}

TEST(Turbulence, DiffersByItsSeedAndHasItsSize) {
  const auto a = WindField(turbulent(0.5, 3, 0), kFrames, Vec3::Zero()).at<double>(0);
  const auto b = WindField(turbulent(0.5, 3, 1), kFrames, Vec3::Zero()).at<double>(0);
  EXPECT_GT((air_at(a, Vec3(0.1, 0, 0)) - air_at(b, Vec3(0.1, 0, 0))).norm(), 1e-3);
  // Along a line velocities of points an eddy apart (half a wave) are opposed on the whole.
  const auto one = WindField(turbulent(0.5, 1), kFrames, Vec3::Zero()).at<double>(0);
  for (int n = 0; n < one.modes; ++n) {
    const double wave = 1 / std::hypot(one.wave[n][0], one.wave[n][1], one.wave[n][2]);
    EXPECT_TRUE(wave >= 0.6 * std::exp2(-0.25) && wave <= 0.6 * std::exp2(0.25)) << wave;
  }
}

TEST(Turbulence, InFloatIsThatInDouble) {
  const WindField wind(turbulent(0.5), kFrames, Vec3(1e4, 0, 0));  // far from the world's origin
  const auto precise = wind.at<double>(100);
  const auto single = wind.at<float>(100);
  for (const Vec3& p : random_points(500, 1)) {
    const Vec3 x = Vec3(1e4, 0, 0) + p;
    EXPECT_LT((air_at(precise, x) - air_at(single, x)).norm(), 2e-4);
  }
}

// ---- Shelter

struct Ball {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;
};

Ball ball(const Vec3& centre, double radius) {
  constexpr int kRings = 48, kSegments = 96;
  Ball mesh;
  for (int r = 0; r <= kRings; ++r)
    for (int s = 0; s < kSegments; ++s) {
      const double theta = std::numbers::pi * r / kRings, phi = 2 * std::numbers::pi * s / kSegments;
      mesh.vertices.push_back(centre + radius * Vec3(std::sin(theta) * std::cos(phi), std::cos(theta),
                                                     std::sin(theta) * std::sin(phi)));
      const int next = (s + 1) % kSegments;
      if (r == kRings) continue;
      mesh.triangles.push_back({r * kSegments + s, r * kSegments + next, (r + 1) * kSegments + s});
      mesh.triangles.push_back({r * kSegments + next, (r + 1) * kSegments + next, (r + 1) * kSegments + s});
    }
  return mesh;
}

double exposure(const ShelterMap& map, const Vec3& x) {
  kernels::ShelterStep<float> step{};
  step.map = map.view(), step.strength = 0.8f, step.per_wake = 1 / 0.2f;
  const Vec3 p = x - Vec3(step.map.origin[0], step.map.origin[1], step.map.origin[2]);
  return kernels::exposure_at(step,
                              kernels::Vector3<float>{static_cast<float>(p.x()), static_cast<float>(p.y()),
                                                      static_cast<float>(p.z())});
}

TEST(Shelter, IsBehindTheHeadAndFadesWithTheWake) {
  const Vec3 centre(5, -2, 30);
  const Ball head = ball(centre, 0.1);
  for (const Vec3& wind : {Vec3(1, 0, 0), Vec3(0, 0, -3), Vec3(1, -2, 0.5)}) {
    ShelterMap map;
    map.draw(head.vertices, head.triangles, wind);
    const Vec3 along = wind.normalized(), aside = along.unitOrthogonal();
    EXPECT_EQ(exposure(map, centre - 0.11 * along), 1) << "before it";
    EXPECT_EQ(exposure(map, centre + 0.12 * aside), 1) << "beside it";
    EXPECT_EQ(exposure(map, centre + 0.12 * aside + 0.3 * along), 1) << "beside it, later";
    EXPECT_NEAR(exposure(map, centre), 0.2, 1e-6) << "inside it";
    for (const double behind : {0.001, 0.1, 0.2, 1.0})
      for (const double off : {0.0, 0.05, 0.08}) {
        const double rear = std::sqrt(0.01 - off * off);
        const Vec3 x = centre + off * aside + (rear + behind) * along;
        EXPECT_NEAR(exposure(map, x), 1 - 0.8 / (1 + behind / 0.2), 0.02) << behind << " " << off;
      }
  }
}

// Across the edge the wind comes back over a cell of the map, not at once.
TEST(Shelter, HasSoftEdges) {
  const Ball head = ball(Vec3::Zero(), 0.1);
  ShelterMap map;
  map.draw(head.vertices, head.triangles, Vec3(0, 0, 1));
  double before = exposure(map, Vec3(0, 0.01, 0.15)), steepest = 0;
  for (double off = 0; off < 0.12; off += 1e-5) {
    const double now = exposure(map, Vec3(off, 0.01, 0.15));
    steepest = std::max(steepest, std::abs(now - before));
    before = now;
  }
  EXPECT_EQ(before, 1);
  EXPECT_TRUE(steepest < 0.02) << steepest;  // of a step of 0.5
}

TEST(Shelter, MapHoldsWhatItReserves) {
  const Ball head = ball(Vec3(1, 2, 3), 0.1);
  ShelterMap map;
  map.reserve();
  const std::size_t bytes = map.bytes();
  EXPECT_EQ(bytes, 2u * 193 * 193 * sizeof(float));
  for (const Vec3& wind : {Vec3(1, 0, 0), Vec3(1, 1, 1), Vec3(-0.2, 5, 0.1)}) {
    map.draw(head.vertices, head.triangles, wind);
    EXPECT_EQ(map.bytes(), bytes);
  }
}

}  // namespace
}  // namespace ringlet::effects
