// The same bits whatever the machine, the neighbours in a batch, and the way the batches are shared out.
#include <gtest/gtest.h>

#include "kernels_support.h"
#include "level_set_support.h"
#include "oracle/random_strand.h"

namespace ringlet::kernels_testing {
namespace {

// Strands of 1 to 24 particles, in no order, all moving, some against a sphere.
struct Crowd {
  std::vector<oracle::Strand> strands;
  std::vector<oracle::State> states;
  std::vector<RootPose> before, after;

  Crowd() {
    std::mt19937 generator(8);
    for (int k = 0; k < 41; ++k) {
      const oracle::RandomStrand random = oracle::random_strand(generator, 1 + k * 7 % 24, 1);
      strands.push_back(random.strand), states.push_back(random.state);
      before.push_back(random.step.before), after.push_back(random.step.after);
    }
  }
  RootPose pose(std::size_t strand, int step) const { return step % 2 ? after[strand] : before[strand]; }
};

struct Model {
  Springs springs;
  bool lengths_in_step;
};

template <class Machine>
class KernelBits : public OnMachine<Machine> {
 protected:
  static constexpr int kSteps = 12;

  static const std::vector<kernels::SolidView>& sphere() {
    static const MeshSolid solid(icosphere(0.08, 2), 0.006);
    static const std::vector<kernels::SolidView> views = {solid.view()};
    return views;
  }
  // The strands listed, run together; their final states.
  template <class On>
  static std::vector<oracle::State> run(const Model& model, const std::vector<std::size_t>& which,
                                        int at_a_time = 0) {
    static const Crowd crowd;
    std::vector<oracle::Strand> strands;
    std::vector<RootPose> poses;
    for (const std::size_t k : which) strands.push_back(crowd.strands[k]), poses.push_back(crowd.before[k]);
    strands[0].drag = 1, strands[0].damping = 1.0 / 60;  // for all
    StrandRun<On> run(strands, poses, true, model.springs);
    run.parameters.length_iterations = 3, run.parameters.lengths_in_step = model.lengths_in_step;
    run.soften({1, 0.01, 0.2, {0.01}, {{0.01, 1, -2, 0}}}, true);
    run.blow({3, 1, -2}, {nullptr, {40, 9}, {20, 1}});
    for (std::size_t k = 0; k < which.size(); ++k) run.set(k, crowd.states[which[k]]);
    for (int step = 1; step <= kSteps; ++step) {
      for (std::size_t k = 0; k < which.size(); ++k) poses[k] = crowd.pose(which[k], step);
      run.step(poses, 1.0 / 240, at_a_time);
      run.collide(sphere(), at_a_time);
    }
    std::vector<oracle::State> states;
    for (std::size_t k = 0; k < which.size(); ++k) states.push_back(run.get(k));
    return states;
  }
  static std::vector<std::size_t> all() {
    std::vector<std::size_t> which(41);
    for (std::size_t k = 0; k < which.size(); ++k) which[k] = k;
    return which;
  }
  static void expect_same(const std::vector<oracle::State>& a, const std::vector<oracle::State>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t k = 0; k < a.size(); ++k)
      EXPECT_TRUE(a[k].position == b[k].position && a[k].velocity == b[k].velocity) << "strand " << k;
  }
};
TYPED_TEST_SUITE(KernelBits, Machines, MachineNames);

constexpr Model kModels[] = {{Springs::kAms, false},
                             {Springs::kAms, true},
                             {Springs::kMassSpring, false},
                             {Springs::kMassSpring, true}};

TYPED_TEST(KernelBits, DoNotDependOnTheBatchsOtherStrands) {
  for (const Model& model : kModels) {
    const auto together = this->template run<TypeParam>(model, this->all());
    for (std::size_t k = 0; k < together.size(); k += 3)
      this->expect_same(this->template run<TypeParam>(model, {k}), {together[k]});
  }
}

TYPED_TEST(KernelBits, DoNotDependOnHowBatchesAreShared) {
  for (const Model& model : kModels) {
    const auto together = this->template run<TypeParam>(model, this->all());
    for (const int at_a_time : {1, 2})
      this->expect_same(this->template run<TypeParam>(model, this->all(), at_a_time), together);
  }
}

TYPED_TEST(KernelBits, AreThoseOfTheScalarKernels) {
  if (!TypeParam::kFused) GTEST_SKIP() << TypeParam::name() << " has no fused multiply-add";
  for (const Model& model : kModels)
    this->expect_same(this->template run<TypeParam>(model, this->all()),
                      this->template run<ScalarMachine<typename TypeParam::T>>(model, this->all()));
}

}  // namespace
}  // namespace ringlet::kernels_testing
