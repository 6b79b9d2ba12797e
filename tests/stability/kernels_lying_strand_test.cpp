// A strand laid over a sphere: lengths and contacts hold together, and it comes to rest.
#include <gtest/gtest.h>

#include "kernels_support.h"
#include "level_set_support.h"

namespace ringlet::kernels_testing {
namespace {

template <class Machine>
class KernelLyingStrand : public OnMachine<Machine> {};
TYPED_TEST_SUITE(KernelLyingStrand, Machines, MachineNames);

TYPED_TEST(KernelLyingStrand, ComesToRestOutsideAtItsLength) {
  using T = typename TypeParam::T;
  constexpr double kStep = 1.0 / 240, kRadius = 0.1;
  static const MeshSolid sphere(icosphere(kRadius, 4), 0.005);
  const oracle::MeshDistance mesh(sphere.surface.vertices, sphere.surface.triangles);
  oracle::Points rest = oracle::Points::Zero(3, 24);
  rest.row(0).setLinSpaced(0, 0.18);
  rest.row(2).setLinSpaced(0, 0.01);
  oracle::Strand strand = oracle::make_strand(rest, {1e6, 1e4, 1e4, 0, 0});
  strand.drag = 2;
  strand.damping = 1.0 / 60;
  const RootPose root{oracle::Mat3::Identity(), {0, kRadius + 1e-3, 0}};
  StrandRun<TypeParam> run({strand}, {root}, false);
  run.parameters.length_iterations = 8, run.parameters.length_tolerance = T(1e-4);
  double strain = 0, deepest = 0;
  for (int k = 0; k < 240; ++k) {
    run.step({root}, kStep);
    run.collide({sphere.view()});
    const oracle::Points x = run.get(0).position;
    strain = oracle::larger(strain, oracle::worst_edge_strain(strand, x));
    for (int i = 1; i < strand.size(); ++i)
      deepest = oracle::larger(deepest, -mesh.signed_distance(x.col(i)));
  }
  EXPECT_TRUE(strain <= 1e-3) << "strain " << strain;
  EXPECT_TRUE(deepest <= 1e-5) << "a particle went " << deepest << " m deep";
  const double speed = run.get(0).velocity.colwise().norm().maxCoeff();
  EXPECT_TRUE(speed <= 0.02) << "still moving at " << speed << " m/s";
  EXPECT_EQ(run.contact_figure(0, kernels::kTouched), 1);
}

}  // namespace
}  // namespace ringlet::kernels_testing
