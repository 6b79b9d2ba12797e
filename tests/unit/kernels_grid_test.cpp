// The grid of hair against hair on every machine that it is built for: what passes through unchanged, what is
// kept, what is pushed and never pulled, and that neither order nor threads show.
#include <gtest/gtest.h>

#include <chrono>
#include <limits>

#include "grid_support.h"
#include "kernels/grid/lattice.h"
#include "kernels_support.h"
#include "level_set_support.h"

namespace ringlet::kernels_testing {
namespace {

template <class Real, kernels::InstructionSet kSet>
struct GridMachine {
  using T = Real;
  static constexpr kernels::InstructionSet kInstructions = kSet;
  static std::string name() { return kernels::name_of(kSet); }
  static bool available() { return kernels::best_instruction_set() >= kSet; }
};
using GridMachines = testing::Types<GridMachine<double, kernels::InstructionSet::kGeneric>,
                                    GridMachine<double, kernels::InstructionSet::kAvx2>,
                                    GridMachine<double, kernels::InstructionSet::kAvx512>,
                                    GridMachine<float, kernels::InstructionSet::kGeneric>,
                                    GridMachine<float, kernels::InstructionSet::kAvx2>,
                                    GridMachine<float, kernels::InstructionSet::kAvx512>>;

constexpr double kCell = 0.005, kSpacing = kCell / 3;  // [m]

template <class Machine>
class KernelGrid : public OnMachine<Machine> {
 protected:
  using T = typename Machine::T;
  using Hair = GridHair<T>;

  static Hair hair_of(const HairPoints& rest, double cell = kCell,
                      kernels::HostThreads threads = {chunks_in_turn, nullptr}) {
    return Hair(rest, cell, Machine::kInstructions, threads);
  }
  // A block of 12 x 16 x 12 cells at the origin.
  static HairPoints block() { return hair_block({0, 0, 0}, {0.06, 0.08, 0.06}, kSpacing, 9); }
  Vec3 any(double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    const double x = uniform(generator_), y = uniform(generator_);
    return {x, y, uniform(generator_)};
  }
  std::mt19937 generator_{3};
};
TYPED_TEST_SUITE(KernelGrid, GridMachines, MachineNames);

// ---- What passes unchanged

TYPED_TEST(KernelGrid, FindsNothingToDoAtRest) {
  auto hair = this->hair_of(this->block());
  const kernels::GridFigures told = hair.run();
  EXPECT_EQ(told.iterations, 0);
  EXPECT_EQ(told.solves, 0);
  EXPECT_EQ(told.residual, 0);
  EXPECT_FALSE(told.moved);
  EXPECT_LE(told.density, 1 + this->either(1e-9, 1e-5));
  EXPECT_GT(told.density, 0.9) << "about the densest hair the target is its density";
  EXPECT_GE(told.cells, 12 * 16 * 12 * 0.8);
  EXPECT_LE(told.cells, 14 * 18 * 14);
  EXPECT_EQ(hair.momentum(), Vec3::Zero());
}

TYPED_TEST(KernelGrid, PassesAUniformVelocity) {
  const Vec3 wind(1.5, -0.4, 2);
  for (const double pic : {0.0, 0.05, 1.0})
    for (const int clamped : {0, 1, 2}) {
      auto hair = this->hair_of(this->block());
      hair.step.pic = static_cast<typename TypeParam::T>(pic), hair.step.clamped = clamped;
      hair.speed([&](const Vec3&) { return wind; });
      hair.run();
      hair.for_each([&](std::size_t s, int i) {
        EXPECT_LE((hair.velocity(s, i) - wind).norm(), 1e-4 * wind.norm())
            << s << " " << i << ", pic " << pic;
      });
    }
}

// Hair and grid turn as one body about any axis, the grid turned already.
TYPED_TEST(KernelGrid, PassesARigidRotationOfHairAndGrid) {
  const Vec3 turn(3, -5, 8), way(0.7, 0.2, -1), about(0.02, 0.05, -0.01);
  const Mat3 rotation = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  for (const double pic : {0.0, 0.05, 1.0}) {
    auto hair = this->hair_of(this->block());
    hair.step.pic = static_cast<typename TypeParam::T>(pic);
    Mat3 slope;
    slope << 0, -turn.z(), turn.y(), turn.z(), 0, -turn.x(), -turn.y(), turn.x(), 0;
    for (int k = 0; k < 9; ++k)
      hair.step.axes.rotation[k] = rotation(k / 3, k % 3), hair.step.axes.slope[k] = slope(k / 3, k % 3);
    for (int c = 0; c < 3; ++c) hair.step.axes.origin[c] = about[c], hair.step.axes.velocity[c] = way[c];
    // Hair that turned with its grid since it was at rest.
    hair.move([&](const Vec3& x) { return about + rotation * x; });
    const auto rigid = [&](const Vec3& x) { return way + slope * (x - about); };
    hair.speed(rigid);
    const kernels::GridFigures told = hair.run();
    EXPECT_FALSE(told.moved);
    double fastest = 0, most = 0;
    hair.for_each([&](std::size_t s, int i) {
      fastest = std::max(fastest, rigid(hair.position(s, i)).norm());
      most = std::max(most, (hair.velocity(s, i) - rigid(hair.position(s, i))).norm());
    });
    EXPECT_LE(most, 1e-4 * fastest) << "pic " << pic;
  }
}

// ---- What is kept

// Hair that flows together and is stirred besides: momentum is exchanged and none is made, whatever is left
// of the pressure's residual.
TYPED_TEST(KernelGrid, KeepsMomentum) {
  for (const double residual : {0.3, 1e-6})
    for (const double pic : {0.0, 0.2}) {
      auto hair = this->hair_of(this->block());
      hair.step.residual = residual, hair.step.pic = static_cast<typename TypeParam::T>(pic);
      hair.speed([&](const Vec3& x) { return Vec3(-20 * (x - Vec3(0.03, 0.04, 0.03)) + this->any(0.2)); });
      std::vector<Vec3> velocity;
      hair.for_each([&](std::size_t s, int i) { velocity.push_back(hair.velocity(s, i)); });
      const Vec3 momentum = hair.momentum();
      const kernels::GridFigures told = hair.run();
      EXPECT_GT(told.iterations, 0);
      EXPECT_LE(told.residual, residual);
      double exchanged = 0;
      std::size_t particle = 0;
      hair.for_each(
          [&](std::size_t s, int i) { exchanged += (hair.velocity(s, i) - velocity[particle++]).norm(); });
      EXPECT_GT(exchanged, 0.05 * static_cast<double>(velocity.size()));
      EXPECT_LE((hair.momentum() - momentum).norm(), 1e-4 * exchanged)
          << "residual " << residual << ", pic " << pic;
    }
}

// ---- Pushed, never pulled

HairPoints two_blocks(double gap) {
  HairPoints strands = hair_block({-0.03 - gap / 2, 0, 0}, {0.03, 0.06, 0.03}, kSpacing, 7, 1);
  const HairPoints other = hair_block({gap / 2, 0, 0}, {0.03, 0.06, 0.03}, kSpacing, 7, 2);
  strands.insert(strands.end(), other.begin(), other.end());
  return strands;
}

TYPED_TEST(KernelGrid, PullsNothingTogetherThatSeparates) {
  auto hair = this->hair_of(two_blocks(0)), before = this->hair_of(two_blocks(0));
  for (auto* h : {&hair, &before})
    h->speed(
        [](const Vec3& x) { return Vec3((x.x() < 0 ? -1 : 1) + 4 * x.x(), 1 + 2 * x.y(), 1 + 3 * x.z()); });
  const kernels::GridFigures told = hair.run();
  EXPECT_EQ(told.iterations, 0);
  EXPECT_EQ(hair.state.velocity, before.state.velocity) << "to the bit";
  EXPECT_EQ(hair.state.position, before.state.position);
}

// One body's pressure is no other's.
TYPED_TEST(KernelGrid, LeavesHairAloneThatTouchesNothing) {
  HairPoints strands = hair_block({0, 0, 0}, {0.03, 0.06, 0.03}, kSpacing, 7, 1);
  const std::size_t near = strands.size();
  const HairPoints other = hair_block({0.1, 0, 0}, {0.03, 0.06, 0.03}, kSpacing, 7, 2);
  strands.insert(strands.end(), other.begin(), other.end());
  auto hair = this->hair_of(strands), before = this->hair_of(strands);
  for (auto* h : {&hair, &before})
    h->speed([](const Vec3& x) { return Vec3(x.x() < 0.05 ? -20 * x.x() : 20 * (x.x() - 0.05), 1, 1); });
  EXPECT_GT(hair.run().iterations, 0);
  double pressed = 0;
  hair.for_each([&](std::size_t s, int i) {
    const double change = (hair.velocity(s, i) - before.velocity(s, i)).norm();
    if (s < near)
      pressed = std::max(pressed, change);
    else
      EXPECT_EQ(change, 0) << s;
  });
  EXPECT_GT(pressed, 0.1);
}

// Blocks that run into one another: what of it the lattice sees is gone, by a lattice of the test's own. A
// run takes what its nodes see; on its way to strands and back to nodes some of that is spread.
TYPED_TEST(KernelGrid, StopsBlocksThatRunIntoOneAnother) {
  for (const double speed : {0.2, 1.0}) {
    auto hair = this->hair_of(two_blocks(0));
    hair.step.residual = 1e-6;
    hair.speed([=](const Vec3& x) { return Vec3(x.x() < 0 ? speed : -speed, 0, 0); });
    const double most = HairOnLattice(hair, kCell).densest();
    const auto compressed = [&] { return HairOnLattice(hair, kCell).compressed(most, hair.kInterval); };
    const auto energy = [&] {
      double sum = 0;
      hair.for_each([&](std::size_t s, int i) { sum += hair.velocity(s, i).squaredNorm(); });
      return sum;
    };
    const double at_first = compressed();
    EXPECT_GT(at_first, 50);
    double before = at_first, energy_before = energy();
    for (int run = 0; run < 10; ++run) {
      hair.run();
      const double after = compressed(), energy_after = energy();
      EXPECT_LT(after, run == 0 ? 0.4 * at_first : before) << run;
      EXPECT_LE(energy_after, energy_before * (1 + 1e-5)) << run;
      before = after, energy_before = energy_after;
    }
    EXPECT_LT(before, 0.05 * at_first);
  }
}

TYPED_TEST(KernelGrid, GivesHairThatWasSqueezedItsVolumeBack) {
  auto hair = this->hair_of(this->block());
  const double rest = HairOnLattice(hair, kCell).densest();
  hair.move([](const Vec3& x) { return Vec3(0.03 + 0.6 * (x.x() - 0.03), x.y(), x.z()); });
  const Vec3 centre = hair.centre();
  const auto expect_no_denser_than = [&](double bound, int runs) {
    kernels::GridFigures told;
    for (int run = 0; run < runs; ++run) told = hair.run(), hair.hold_lengths();
    EXPECT_LE(told.density, bound) << "as the grid sees it";
    EXPECT_LE(HairOnLattice(hair, kCell).densest(), bound * rest) << "as the test sees it";
  };
  EXPECT_GT(HairOnLattice(hair, kCell).densest(), 1.5 * rest);
  EXPECT_NEAR(hair.run().density, 1 / 0.6, 0.1);
  EXPECT_EQ(hair.momentum(), Vec3::Zero()) << "moved, not set in motion";
  hair.hold_lengths();
  expect_no_denser_than(1.5, 2);
  expect_no_denser_than(1.1, 21);
  EXPECT_LT((hair.centre() - centre).norm(), this->either(1e-9, 1e-6));
}

// ---- Walls

// A block against a wall that lies anywhere in its cells, moving along x [m/s].
template <class T>
struct HairAtWall {
  HairAtWall(double wall_at, double wall_speed, kernels::InstructionSet set)
      : solid(box({-0.03, -0.03, -0.03}, {wall_at, 0.11, 0.09}, 4), 0.004),
        view(solid.view()),
        at(wall_at),
        hair(hair_block({wall_at, 0, 0}, {0.06, 0.08, 0.06}, kSpacing, 9), kCell, set) {
    hair.step.solids = &view, hair.step.solid_count = 1;
    view.translation_before[0] = -wall_speed * hair.step.substep;
  }
  // Of the hair within half a cell of the wall, along x.
  std::pair<double, double> least_and_mean() const {
    double least = 1e9, sum = 0, count = 0;
    hair.for_each([&](std::size_t s, int i) {
      if (hair.position(s, i).x() > at + kCell / 2) return;
      const double u = hair.velocity(s, i).x();
      least = std::min(least, u), sum += u, ++count;
    });
    return {least, sum / count};
  }

  MeshSolid solid;
  kernels::SolidView view;
  double at;
  GridHair<T> hair;
};
constexpr double kWallPlaces[] = {0, -kCell / 4, -kCell / 2, -0.55 * kCell, -0.75 * kCell};
// [m/s] Fast beside what hair has to give before it is as dense as at rest, a cell in the interval at most.
constexpr double kWallSpeed = 1;

TYPED_TEST(KernelGrid, PushesNoHairIntoAWall) {
  for (const double at : kWallPlaces) {
    HairAtWall<typename TypeParam::T> wall(at, kWallSpeed, TypeParam::kInstructions);
    EXPECT_GT(wall.hair.run().iterations, 0);
    EXPECT_GE(wall.least_and_mean().first, -0.05 * kWallSpeed) << "wall at " << at / kCell << " cells";
  }
}
TYPED_TEST(KernelGrid, KeepsHairAheadOfAWall) {
  for (const double at : kWallPlaces) {
    HairAtWall<typename TypeParam::T> wall(at, kWallSpeed, TypeParam::kInstructions);
    for (int run = 0; run < 8; ++run) wall.hair.run();
    EXPECT_GE(wall.least_and_mean().second, 0.9 * kWallSpeed) << "wall at " << at / kCell << " cells";
  }
}
TYPED_TEST(KernelGrid, StopsHairAtAWallThatStands) {
  for (const double at : kWallPlaces) {
    HairAtWall<typename TypeParam::T> wall(at, 0, TypeParam::kInstructions);
    wall.hair.speed([](const Vec3&) { return Vec3(-kWallSpeed, 0, 0); });
    for (int run = 0; run < 8; ++run) wall.hair.run();
    EXPECT_GE(wall.least_and_mean().second, -0.1 * kWallSpeed) << "wall at " << at / kCell << " cells";
  }
}
TYPED_TEST(KernelGrid, DrawsNoHairAfterAWallThatLeaves) {
  for (const double at : kWallPlaces) {
    HairAtWall<typename TypeParam::T> wall(at, -kWallSpeed, TypeParam::kInstructions);
    EXPECT_EQ(wall.hair.run().iterations, 0);
    EXPECT_EQ(wall.hair.momentum(), Vec3::Zero());
  }
}

// Hair, grid and wall turn as one body: by backward differences, 0.1 radians in a substep.
TYPED_TEST(KernelGrid, PassesARigidMotionOfHairGridAndWall) {
  using Rows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  HairAtWall<typename TypeParam::T> wall(0, 0, TypeParam::kInstructions);
  auto& hair = wall.hair;
  const Vec3 axis = Vec3(1, -2, 0.5).normalized(), shift(0.01, 0.003, -0.006);
  const Rows turn = Eigen::AngleAxisd(0.1, axis).toRotationMatrix();
  const Rows slope = (turn - Mat3::Identity()) * turn.transpose() / hair.step.substep;
  for (int k = 0; k < 9; ++k)
    wall.view.rotation[k] = hair.step.axes.rotation[k] = turn.data()[k],
    hair.step.axes.slope[k] = slope.data()[k];
  for (int c = 0; c < 3; ++c) {
    wall.view.translation[c] = hair.step.axes.origin[c] = shift[c];
    hair.step.axes.velocity[c] = shift[c] / hair.step.substep;
  }
  const auto rigid = [&](const Vec3& x) { return Vec3((slope * (x - shift) + shift / hair.step.substep)); };
  hair.move([&](const Vec3& x) { return Vec3(shift + turn * x); });
  hair.speed(rigid);
  hair.run();
  double fastest = 0, most = 0;
  hair.for_each([&](std::size_t s, int i) {
    fastest = std::max(fastest, rigid(hair.position(s, i)).norm());
    most = std::max(most, (hair.velocity(s, i) - rigid(hair.position(s, i))).norm());
  });
  EXPECT_LE(most, 1e-4 * fastest);
}

// ---- Order, threads, instruction sets

// Hair that is squeezed, stirred, and against a moving wall, two runs of it.
template <class T>
void stir(GridHair<T>& hair, const kernels::SolidView* wall) {
  hair.step.solids = wall, hair.step.solid_count = 1, hair.step.pic = T(0.05), hair.step.clamped = 1;
  hair.move([](const Vec3& x) { return Vec3(0.8 * x.x(), x.y() + 0.2 * x.x(), x.z()); });
  hair.speed([](const Vec3& x) {
    return Vec3(std::sin(300 * x.y()) - 10 * x.x(), std::cos(200 * x.z()),
                std::sin(250 * x.x()) - 10 * x.z());
  });
  for (int run = 0; run < 2; ++run) EXPECT_GT(hair.run().iterations, 0);
}

TYPED_TEST(KernelGrid, GivesTheSameBytesWithAnyThreads) {
  const MeshSolid wall(box({-0.03, -0.03, -0.03}, {0, 0.11, 0.09}, 4), 0.004);
  kernels::SolidView view = wall.view();
  view.translation_before[0] = -0.004;
  auto serial = this->hair_of(this->block());
  stir(serial, &view);
  for (const kernels::HostThreads threads : {kernels::HostThreads{chunks_on_two_threads, nullptr},
                                             kernels::HostThreads{chunks_shuffled, &this->generator_}}) {
    auto hair = this->hair_of(this->block(), kCell, threads);
    stir(hair, &view);
    EXPECT_EQ(hair.state.velocity, serial.state.velocity);
    EXPECT_EQ(hair.state.position, serial.state.position);
  }
}

TYPED_TEST(KernelGrid, GivesTheSameBytesInAnyOrderOfStrands) {
  const MeshSolid wall(box({-0.03, -0.03, -0.03}, {0, 0.11, 0.09}, 4), 0.004);
  kernels::SolidView view = wall.view();
  view.translation_before[0] = -0.004;
  HairPoints strands = this->block();
  for (std::size_t s = 0; s < strands.size(); ++s) strands[s].resize(3 + s % 7);  // of several lengths
  std::vector<std::size_t> order(strands.size());
  for (std::size_t s = 0; s < order.size(); ++s) order[s] = s;
  std::shuffle(order.begin(), order.end(), this->generator_);
  HairPoints permuted;
  for (const std::size_t s : order) permuted.push_back(strands[s]);
  auto hair = this->hair_of(strands), other = this->hair_of(permuted);
  stir(hair, &view), stir(other, &view);
  other.for_each([&](std::size_t s, int i) {
    EXPECT_EQ(other.velocity(s, i), hair.velocity(order[s], i));
    EXPECT_EQ(other.position(s, i), hair.position(order[s], i));
  });
}

TYPED_TEST(KernelGrid, GivesTheBytesOfEveryFusedInstructionSet) {
  if (TypeParam::kInstructions == kernels::InstructionSet::kGeneric)
    GTEST_SKIP() << "rounds products on their own";
  const MeshSolid wall(box({-0.03, -0.03, -0.03}, {0, 0.11, 0.09}, 4), 0.004);
  kernels::SolidView view = wall.view();
  view.translation_before[0] = -0.004;
  auto hair = this->hair_of(this->block());
  GridHair<typename TypeParam::T> other(this->block(), kCell, kernels::InstructionSet::kAvx2);
  stir(hair, &view), stir(other, &view);
  EXPECT_EQ(hair.state.velocity, other.state.velocity);
  EXPECT_EQ(hair.state.position, other.state.position);
}

// ---- Memory, and hair that is out of order

// Nine locks in the corners and the middle of a box: what the grid takes goes with hair, not with the box.
TYPED_TEST(KernelGrid, TakesNoMemoryForEmptySpace) {
  const auto bytes = [](double far, double cell) {
    HairPoints strands;
    for (int corner = 0; corner < 9; ++corner) {
      const Vec3 at = corner == 8
                          ? Vec3(0, 0, 0)
                          : far / 2 * Vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
      const HairPoints lock = hair_block(at, {0.006, 0.03, 0.006}, 0.002, 5);
      strands.insert(strands.end(), lock.begin(), lock.end());
    }
    auto hair = KernelGrid<TypeParam>::hair_of(strands, cell);
    hair.run();
    return static_cast<double>(hair.bytes());
  };
  // 64, 512 and 4096 cells across, the same hair of the same cells.
  const double near = bytes(64 * 0.006, 0.006);
  EXPECT_LE(bytes(512 * 0.006, 0.006), 1.5 * near);
  EXPECT_LE(bytes(4096 * 0.006, 0.006), 1.5 * near);
  EXPECT_LT(near, 16e6);
  EXPECT_LT(bytes(0.512, 0.001), 512.0 * 512 * 512 / 2) << "half a byte for each of 512^3 cells";
}

TYPED_TEST(KernelGrid, TakesHairThatIsOutOfOrder) {
  using T = typename TypeParam::T;
  HairPoints strands = this->block();
  const std::size_t block = strands.size();
  strands.push_back({{0.03, 0.04, 0.03}});                                // a root alone
  strands.push_back({{1, 0, 0}, {1, 0.01, 0}});                           // two particles
  strands.push_back({{2, 0, 0}, {2, 0, 0}, {2, 0.01, 0}, {2, 0.01, 0}});  // segments without length
  for (const double x : {3, 4, 5}) strands.push_back({{x, 0, 0}, {x, 0.01, 0}, {x, 0.02, 0}});
  auto hair = this->hair_of(strands), sound = this->hair_of(strands);
  const auto place = [&](std::size_t s, int i, const Vec3& at) {
    for (int c = 0; c < 3; ++c) hair.state.position[hair.model.layout.at(s, i, 3, c)] = static_cast<T>(at[c]);
  };
  for (int i = 0; i < 3; ++i) place(block + 3, i, {0, 0, 0});              // all in one place
  for (int i = 0; i < 3; ++i) place(block + 4, i, {1000, 0.01 * i, 500});  // a kilometre off
  place(block + 5, 2, {-3e6, 1e6, 2e5});                                   // torn
  for (auto* h : {&hair, &sound}) {
    h->step.residual = 1e-10;
    h->speed([](const Vec3& x) { return Vec3(std::abs(x.x()) < 0.5 ? -20 * x.x() : 0, 0, 1); });
  }
  sound.run();
  const auto before = std::chrono::steady_clock::now();
  hair.run();
  EXPECT_LT(std::chrono::steady_clock::now() - before, std::chrono::seconds(5));
  hair.for_each([&](std::size_t s, int i) {
    EXPECT_TRUE(hair.velocity(s, i).allFinite()) << s << " " << i;
    EXPECT_TRUE(hair.position(s, i).allFinite()) << s << " " << i;
    if (s >= block + 3) return;
    EXPECT_LE((hair.velocity(s, i) - sound.velocity(s, i)).norm(), this->either(1e-8, 5e-3)) << s << " " << i;
  });
}

// A run with what is no number ends, tells, and leaves hair elsewhere as it should be.
TYPED_TEST(KernelGrid, OutlivesWhatIsNoNumber) {
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinite = std::numeric_limits<double>::infinity();
  HairPoints strands = this->block();
  const std::size_t sound = strands.size();
  strands.push_back({{1, 0, 0}, {1, 0.01, 0}, {1, 0.02, 0}});
  for (const double bad : {nan, infinite, -infinite, 1e30})
    for (const bool place : {true, false}) {
      auto hair = this->hair_of(strands);
      hair.speed([](const Vec3& x) { return Vec3(x.x() < 0.5 ? -20 * x.x() : 0, 0, 0); });
      auto& values = place ? hair.state.position : hair.state.velocity;
      values[hair.model.layout.at(sound, 1, 3, 1)] = static_cast<typename TypeParam::T>(bad);
      const kernels::GridFigures told = hair.run();
      EXPECT_LE(told.iterations, 2 * hair.step.most_iterations);
      hair.for_each([&](std::size_t s, int i) {
        EXPECT_TRUE(s >= sound || hair.velocity(s, i).allFinite()) << s << " " << i << ", " << bad << place;
      });
    }
}

// ---- Shelter

// In hair that is the same everywhere the wind decays as exp(-strength 2 r n x), x the way through it.
TYPED_TEST(KernelGrid, LetsThroughOfTheWindWhatBeerAndLambertSay) {
  constexpr double kSize = 16 * kCell, kTile = 4 * kCell, kRadius = 5e-5, kStrength = 0.7;
  constexpr double kPerLength = kStrength * 2 * kRadius / (kSpacing * kSpacing);  // 1 / kSpacing^2 is n
  auto hair = this->hair_of(hair_block({0, 0, 0}, {kSize, kSize, kSize}, kSpacing, 17));
  hair.run();
  for (const Vec3& wind : {Vec3(3, 0, 0), Vec3(-3, 0, 0), Vec3(0, 2, 0), Vec3(0, -2, 0), Vec3(0, 0, 1),
                           Vec3(0, 0, -1), Vec3(2, 0, 2), Vec3(-2, 0, 2), Vec3(3, 1, 1), Vec3(-1, 4, -2)}) {
    const auto share = hair.shelter(wind, kStrength, kRadius);
    int looked_at = 0;
    hair.for_each([&](std::size_t s, int i) {
      if (i + 1 == hair.model.living(s)) return;
      const Vec3 x = 0.5 * (hair.position(s, i) + hair.position(s, i + 1));
      Vec3 ways = Vec3::Constant(1);  // to the sides that the wind comes in by
      for (int c = 0; c < 3; ++c)
        if (wind[c] != 0) ways[c] = (wind[c] > 0 ? x[c] : kSize - x[c]) * wind.norm() / std::abs(wind[c]);
      // Depths are blended between tiles, and hair spreads over its sides by a part of a cell: what is near
      // a side or where the wind comes in by two is left out.
      int nearest = 0;
      const double way = ways.minCoeff(&nearest);
      bool clear = std::min(x.minCoeff(), (Vec3::Constant(kSize) - x).minCoeff()) > kTile;
      for (int c = 0; c < 3; ++c)
        clear = clear &&
                (c == nearest || (ways[c] - way) * std::abs(wind[c]) / wind.norm() > kTile || wind[c] == 0);
      if (!clear) return;
      EXPECT_NEAR(-std::log(share[hair.model.layout.at(s, i, 1, 0)]), kPerLength * way,
                  0.15 * kPerLength * kTile)
          << "at " << x.transpose() << ", wind " << wind.transpose();
      ++looked_at;
    });
    EXPECT_GT(looked_at, 500) << wind.transpose();
  }
  for (const auto share : hair.shelter(Vec3::Zero(), kStrength, kRadius)) EXPECT_EQ(share, 1);
}

// Blocks of tiles that are scattered at the same time: with the nodes about them, which a tile between them
// keeps apart, they share none.
TEST(TileBlocks, OfOneColourAreNoNeighbours) {
  constexpr std::uint32_t kSide = 10;
  for (std::uint32_t one = 0; one < kSide * kSide * kSide; ++one)
    for (std::uint32_t other = 0; other < one; ++other) {
      std::uint32_t apart = 0;
      const auto at = [](std::uint32_t n, int c) {
        return (c == 0 ? n : c == 1 ? n / kSide : n / kSide / kSide) % kSide;
      };
      for (int c = 0; c < 3; ++c)
        apart = std::max(apart,
                         at(one, c) > at(other, c) ? at(one, c) - at(other, c) : at(other, c) - at(one, c));
      const auto key = [&](std::uint32_t n) { return kernels::key_of(at(n, 0), at(n, 1), at(n, 2)); };
      for (const int together : {0, 3}) {
        const std::uint64_t block = kernels::block_of(key(one), together),
                            beside = kernels::block_of(key(other), together);
        if (block != beside && kernels::colour_of(block) == kernels::colour_of(beside)) {
          ASSERT_GT(apart, 1) << one << " " << other;
        }
      }
    }
}

TYPED_TEST(KernelGrid, HasNothingToDoWithoutHair) {
  auto hair = this->hair_of({{{0, 0, 0}}, {{1, 0, 0}}});
  const kernels::GridFigures told = hair.run();
  EXPECT_EQ(told.cells, 0);
  EXPECT_EQ(told.density, 0);
  EXPECT_EQ(told.iterations, 0);
}

}  // namespace
}  // namespace ringlet::kernels_testing
