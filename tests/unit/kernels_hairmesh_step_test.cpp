// Steps of a hair mesh against closed forms, and what it recovers from.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "kernels_hairmesh_support.h"

namespace ringlet::kernels_testing {
namespace {

using Vec3 = Eigen::Vector3d;

template <class T>
struct HairMeshStep : testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(HairMeshStep, Reals);

// Semi-implicit Euler of a free fall: v_n = n g h, x_n = x_0 + g h^2 n (n + 1) / 2; no element has a say.
TYPED_TEST(HairMeshStep, FallsFreelyAsItsSchemeSays) {
  HairMeshParameters parameters;
  parameters.held_roots = false, parameters.drag = 0, parameters.tolerance = 0;
  MeshRun<TypeParam> run(hair_cap({5, 8}, 4, 0.05, 0.3), parameters);
  constexpr int kFrames = 24;
  const double h = 1.0 / 24, fallen = 9.81 * h * h * kFrames * (kFrames + 1) / 2;
  run.frames(kFrames);
  // A row of the matrix is a mass and what cancels: stiffness of up to 2,000 times that, rounded.
  const double bound = 2000 * double(std::numeric_limits<TypeParam>::epsilon()) * fallen;
  for (int v = 0; v < run.vertices(); ++v)
    EXPECT_LE((run.at(v) - run.mesh.at(v) + Vec3(0, fallen, 0)).norm(), bound) << v;
}

// Drag in still air: v_n = (v_{n-1} + h g) / (1 + h c), towards g / c.
TYPED_TEST(HairMeshStep, DragAndWindFollowTheirScheme) {
  HairMeshParameters parameters;
  parameters.held_roots = false, parameters.drag = 3, parameters.tolerance = 0;
  MeshRun<TypeParam> run(hair_cap({5, 8}, 3, 0.05, 0.3), parameters);
  std::vector<TypeParam> air(run.position.size(), TypeParam(0));
  for (std::size_t i = 2; i < air.size(); i += 3) air[i] = TypeParam(4);
  run.step.air = air.data();
  Vec3 v = Vec3::Zero(), x = Vec3::Zero();
  const double h = 1.0 / 24;
  for (int n = 0; n < 48; ++n) {
    v = (v + h * (Vec3(0, -9.81, 0) + 3 * Vec3(0, 0, 4))) / (1 + 3 * h);
    x += h * v;
  }
  run.frames(48);
  const double bound = 2000 * double(std::numeric_limits<TypeParam>::epsilon()) * x.norm();
  for (int i = 0; i < run.vertices(); ++i) EXPECT_LE((run.at(i) - run.mesh.at(i) - x).norm(), bound) << i;
}

// A prism that hangs from its roots: with the stretch alone an edge of the extrusion carries what is beneath
// it, and is longer by m g / k; k is modulus times the edge's share of the volume over the square of its
// length.
TEST(HairMeshHanging, StretchesByTheWeightItCarries) {
  for (const int corners : {3, 4}) {
    constexpr int kLayers = 6;
    constexpr double kHeight = 0.3, kModulus = 2e4, kDensity = 100;
    HairMeshParameters parameters;
    parameters.stretch = kModulus, parameters.density = kDensity, parameters.tolerance = 1e-10;
    parameters.shear = parameters.stretch_across = parameters.bend = parameters.bend_across = 0;
    parameters.horizontal = parameters.volume = 0;
    MeshRun<double> run(prism_column(corners, kLayers, 0.03, kHeight, true), parameters);
    run.frames(600);
    const double length = kHeight / (kLayers - 1);
    for (int c = 0; c < corners; ++c) {
      double y = 0;
      for (int l = 0; l + 1 < kLayers; ++l) {
        // Of all beneath the edge's upper end: whole layers, and half of one at the bottom.
        const double beneath = (kLayers - 2 - l) + 0.5,
                     strain = kDensity * 9.81 * beneath * length / kModulus;
        y -= length * (1 + strain);
        const Vec3 at = run.at(run.mesh.topology.vertex(c, l + 1));
        EXPECT_NEAR(at[1], y, 1e-9) << c << ' ' << l;
      }
    }
  }
}

double prism_volume(const MeshRun<double>& run) { return run.solver->volume(); }

// Corner volumes over their rest, the least of them.
template <class T>
double least_corner(const MeshRun<T>& run) {
  double least = 1e9;
  for (const auto& t : run.mesh.topology.corner_tetrahedra()) {
    Eigen::Matrix3d now, rest;
    for (int k = 0; k < 3; ++k) {
      now.col(k) = run.at(t.vertex[k + 1]) - run.at(t.vertex[0]);
      rest.col(k) = run.mesh.at(t.vertex[k + 1]) - run.mesh.at(t.vertex[0]);
    }
    least = std::min(least, now.determinant() / rest.determinant());
  }
  return least;
}

// The volume force alone, on a prism whose roots are held: flattened onto them but for a trace, and turned
// inside out.
TEST(HairMeshVolume, FlattenedAndInvertedPrismsRegainTheirVolume) {
  for (const int corners : {3, 4})
    for (const double height : {0.02, -0.3, -1.0}) {
      HairMeshParameters parameters;
      parameters.shear = parameters.stretch_across = parameters.bend = parameters.bend_across = 0;
      parameters.horizontal = parameters.stretch = 0, parameters.volume = 1000, parameters.damping = 0.02;
      MeshRun<double> run(prism_column(corners, 2, 0.03, 0.03), parameters);
      run.step.gravity[1] = 0;
      for (int c = 0; c < corners; ++c) {
        const int v = run.mesh.topology.vertex(c, 1);
        Vec3 at = run.mesh.at(v);
        at[1] *= height;
        run.put(v, at);
      }
      run.set();
      const double rest = 0.03 * 0.03 * 0.03 * (corners == 4 ? 1 : std::sqrt(0.75) / 2);
      EXPECT_LT(prism_volume(run), 0.021 * rest);
      run.frames(240);
      EXPECT_NEAR(prism_volume(run) / rest, 1, 0.01) << corners << ' ' << height;
      EXPECT_GT(least_corner(run), 0.5);
    }
}

TEST(HairMeshVolume, AnInvertedMeshUnfolds) {
  MeshRun<double> run(hair_cap({6, 12}, 4, 0.05, 0.5));
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> uniform(-0.06, 0.06);
  for (int v = 0; v < run.vertices(); ++v)
    if (run.mesh.topology.layer_of(v) > 0)
      run.put(v, run.mesh.at(v) + Vec3(uniform(engine), uniform(engine), uniform(engine)));
  ASSERT_LT(least_corner(run), -1);
  run.set();
  run.frames(240);
  EXPECT_GT(least_corner(run), 0.2);
}

// Largest distance of two states over the hair's longest column.
template <class T>
double distance(const MeshRun<T>& a, const MeshRun<T>& b) {
  double worst = 0, longest = 0;
  const HairMeshTopology& t = a.mesh.topology;
  for (int c = 0; c < t.columns; ++c) {
    double length = 0;
    for (int l = 0; l + 1 < t.layers; ++l)
      length += (a.mesh.at(t.vertex(c, l + 1)) - a.mesh.at(t.vertex(c, l))).norm();
    longest = std::max(longest, length);
  }
  for (int v = 0; v < t.vertices(); ++v) {
    const double apart = (a.at(v) - b.at(v)).norm();
    if (!(apart <= worst)) worst = apart;
  }
  return worst / longest;
}

constexpr int kFiveSeconds = 120;

TEST(HairMeshRecovery, ComesBackFromItsRoots) {
  for (const int vertices : {215, 361, 2305}) {
    MeshRun<float> calm(paper_mesh(vertices)), collapsed(paper_mesh(vertices));
    const HairMeshTopology& t = calm.mesh.topology;
    for (int v = 0; v < t.vertices(); ++v) collapsed.put(v, calm.mesh.at(t.vertex(v / t.layers, 0)));
    collapsed.set();
    calm.frames(kFiveSeconds), collapsed.frames(kFiveSeconds);
    EXPECT_LE(distance(calm, collapsed), 0.01) << vertices;
    EXPECT_NEAR(collapsed.solver->volume() / calm.solver->volume(), 1, 0.01) << vertices;
  }
}

// The same while the head stands turned, where rest directions have turned with it, and in double.
TEST(HairMeshRecovery, ComesBackFromItsRootsOnATurnedHead) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2, Vec3(1, 0.3, 0.2).normalized()).toRotationMatrix();
  MeshRun<double> calm(paper_mesh(215)), collapsed(paper_mesh(215));
  const HairMeshTopology& t = calm.mesh.topology;
  for (MeshRun<double>* run : {&calm, &collapsed}) {
    run->head(turn, Vec3(1, 2, 3));
    for (int v = 0; v < t.vertices(); ++v)
      run->put(v, turn * run->mesh.at(run == &calm ? v : t.vertex(v / t.layers, 0)) + Vec3(1, 2, 3));
    run->set(), run->frames(kFiveSeconds);
  }
  EXPECT_LE(distance(calm, collapsed), 0.01);
  EXPECT_NEAR(collapsed.solver->volume() / calm.solver->volume(), 1, 0.01);
}

// A nod and a walk at ten times their speed for two seconds, then stillness.
template <class T>
void shake_and_come_back(int vertices) {
  MeshRun<T> calm(paper_mesh(vertices)), shaken(paper_mesh(vertices));
  double worst = 0;
  for (int frame = 1; frame <= 48; ++frame) {
    const double t = 10 * frame / 24.0;
    shaken.head(Eigen::AngleAxisd(0.9 * std::sin(2.5 * t), Vec3(0.4, 1, 0.3).normalized()).toRotationMatrix(),
                Vec3(0.6 * std::sin(1.3 * t), 0.1 * std::sin(5 * t), 0.4 * std::sin(0.9 * t)));
    shaken.frame(), shaken.get();
    for (const T x : shaken.position)
      if (!(std::abs(x) <= worst)) worst = std::abs(static_cast<double>(x));
  }
  EXPECT_LE(worst, 3) << "hair of 0.2 m on a head that moves 0.8 m";
  const Eigen::Matrix3d upright = Eigen::Matrix3d::Identity();
  shaken.head(upright, Vec3::Zero());
  calm.frames(kFiveSeconds), shaken.frames(kFiveSeconds);
  EXPECT_LE(distance(calm, shaken), 0.01) << vertices;
  EXPECT_NEAR(shaken.solver->volume() / calm.solver->volume(), 1, 0.01) << vertices;
}

TEST(HairMeshRecovery, ComesBackFromTenTimesTheSpeed) {
  for (const int vertices : {215, 361, 2305}) shake_and_come_back<float>(vertices);
  shake_and_come_back<double>(215);
}

// Curls that hang in no gravity stay as they are: nothing at rest has a force.
TYPED_TEST(HairMeshStep, CurlsAtRestStayAtRest) {
  MeshRun<TypeParam> run(hair_cap({6, 12}, 12, 0.06, 0.4, 0.015));
  run.step.gravity[1] = 0;
  run.frames(48);
  for (int v = 0; v < run.vertices(); ++v)
    EXPECT_LE((run.at(v) - run.mesh.at(v)).norm(), sizeof(TypeParam) == 4 ? 1e-6 : 1e-14) << v;
}

// Frames of every instruction set of this processor, byte for byte; a state that is taken out and put back
// goes on alike.
TYPED_TEST(HairMeshStep, IsTheSameOnEveryInstructionSetAndAfterAPause) {
  std::vector<std::vector<TypeParam>> results;
  for (const InstructionSet set : {InstructionSet::kGeneric, InstructionSet::kAvx2, InstructionSet::kAvx512})
    for (const bool pause : {false, true}) {
      if (set > kernels::best_instruction_set()) continue;
      MeshRun<TypeParam> run(paper_mesh(215), {}, set);
      std::unique_ptr<MeshRun<TypeParam>> other;
      MeshRun<TypeParam>* now = &run;
      for (int frame = 1; frame <= 24; ++frame) {
        const Vec3 at(0.05 * std::sin(frame), 0, 0);
        if (pause && frame == 13) {
          other = std::make_unique<MeshRun<TypeParam>>(paper_mesh(215), HairMeshParameters{}, set);
          std::vector<kernels::MeshContact<TypeParam>> contacts(static_cast<std::size_t>(run.vertices()));
          const int count = run.solver->get_contacts(contacts.data());
          EXPECT_GT(count, 0);
          run.get();
          other->position = run.position, other->velocity = run.velocity, other->set();
          other->solver->set_contacts(contacts.data(), count);
          now = other.get();
        }
        now->head(Eigen::Matrix3d::Identity(), at);
        kernels::MeshEllipsoid<TypeParam> ball{};
        for (int k = 0; k < 3; ++k) ball.axis[k][k] = 1, ball.radius[k] = TypeParam(0.13);
        ball.centre[0] = TypeParam(0.05 * std::sin(frame)), ball.centre[1] = TypeParam(-0.05);
        ball.friction = TypeParam(0.3);
        now->frame(), now->solver->collide(&ball, 1), now->solver->minimise();
      }
      now->get();
      results.push_back(now->position);
    }
  for (const auto& result : results) EXPECT_EQ(result, results.front());
}

}  // namespace
}  // namespace ringlet::kernels_testing
