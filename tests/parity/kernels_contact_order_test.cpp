// Contacts do not depend on threads, on the order of strands, nor on the instruction set where it has FMA.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "contact_support.h"

namespace ringlet::kernels_testing {
namespace {

// Strands of several lengths and radii' worth of overlaps that fly through one another.
std::vector<HairStrand> tangle() {
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&](double size) {
    return Vec3(size * uniform(engine), size * uniform(engine), size * uniform(engine));
  };
  std::vector<HairStrand> strands;
  for (int s = 0; s < 400; ++s)
    strands.push_back(straight_strand(vector(0.02), 0.04 * vector(1).normalized(), 4 + s % 5, vector(0.3)));
  return strands;
}

// The state after two frames, strand after strand as `order` lists them.
template <class T>
struct Result {
  std::vector<T> values;
  kernels::HairContactFigures figures;
};
template <class T>
Result<T> result_of(const std::vector<int>& order, InstructionSet set = kernels::best_instruction_set()) {
  const std::vector<HairStrand> strands = tangle();
  std::vector<HairStrand> ordered;
  for (const int s : order) ordered.push_back(strands[s]);
  HairRun<T> run(ordered, 4e-5, 1, set);
  Result<T> result;
  for (int frame = 0; frame < 2; ++frame) result.figures = run.frame();
  std::vector<std::size_t> place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = k;
  for (const std::size_t s : place)
    for (int i = 0; i < run.count(s); ++i)
      for (int c = 0; c < 3; ++c) {
        result.values.push_back(run.state.position[run.model.layout.at(s, i, 3, c)]);
        result.values.push_back(run.state.velocity[run.model.layout.at(s, i, 3, c)]);
      }
  return result;
}

std::vector<int> in_order() {
  std::vector<int> order(tangle().size());
  std::iota(order.begin(), order.end(), 0);
  return order;
}

template <class T>
void expect_same(const Result<T>& one, const Result<T>& other) {
  EXPECT_TRUE(one.values == other.values);
  EXPECT_EQ(one.figures.pairs, other.figures.pairs);
  EXPECT_EQ(one.figures.contacts, other.figures.contacts);
  EXPECT_EQ(one.figures.crossings, other.figures.crossings);
  EXPECT_EQ(one.figures.depth, other.figures.depth);
}

template <class T>
class ContactOrder : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(ContactOrder, Precisions);

TYPED_TEST(ContactOrder, ThreadsChangeNoBit) {
  const tbb::global_control most(tbb::global_control::max_allowed_parallelism, 4);
  const auto many = result_of<TypeParam>(in_order());
  EXPECT_GT(many.figures.contacts, 100);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  expect_same(many, result_of<TypeParam>(in_order()));
}

TYPED_TEST(ContactOrder, OrderOfStrandsChangesNoBit) {
  const auto first = result_of<TypeParam>(in_order());
  std::vector<int> backwards = in_order();
  std::reverse(backwards.begin(), backwards.end());
  expect_same(first, result_of<TypeParam>(backwards));
  std::vector<int> shuffled = in_order();
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(9));
  expect_same(first, result_of<TypeParam>(shuffled));
}

TYPED_TEST(ContactOrder, InstructionSetsWithFmaAgree) {
  if (kernels::best_instruction_set() < InstructionSet::kAvx512)
    GTEST_SKIP() << "this processor has no AVX-512";
  expect_same(result_of<TypeParam>(in_order(), InstructionSet::kAvx512),
              result_of<TypeParam>(in_order(), InstructionSet::kAvx2));
}

TYPED_TEST(ContactOrder, AProcessorWithoutFmaIsNear) {
  const auto fused = result_of<TypeParam>(in_order()),
             plain = result_of<TypeParam>(in_order(), InstructionSet::kGeneric);
  // Chaotic from pair to pair: the counts are alike, not the places.
  EXPECT_NEAR(plain.figures.pairs, fused.figures.pairs, 0.05 * fused.figures.pairs);
}

}  // namespace
}  // namespace ringlet::kernels_testing
