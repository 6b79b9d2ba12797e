// The grid's pressure as the program calls it, on the problem of known solution that studies measure its
// order by: in either precision, for every instruction set.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "grid_support.h"
#include "kernels/launch/pressure.h"
#include "study/manufactured_pressure.h"

namespace ringlet::kernels_testing {
namespace {

using kernels::InstructionSet;

template <class T>
class KernelPressureOrder : public testing::Test {
 protected:
  std::vector<double> solve(InstructionSet set, const study::ManufacturedPressure<T>& manufactured) {
    std::vector<double> pressure(manufactured.cells());
    const auto told = kernels::solve_pressure(set, {chunks_shuffled, &generator_}, manufactured.problem(),
                                              1e-10, 200, pressure.data());
    EXPECT_TRUE(told.compressed);
    EXPECT_LE(told.residual, 1e-10);
    return pressure;
  }
  std::mt19937 generator_{3};
};
using Precisions = testing::Types<double, float>;
TYPED_TEST_SUITE(KernelPressureOrder, Precisions);

TYPED_TEST(KernelPressureOrder, IsTwoForEveryInstructionSet) {
  for (const InstructionSet set :
       {InstructionSet::kGeneric, InstructionSet::kAvx2, InstructionSet::kAvx512}) {
    if (set > kernels::best_instruction_set()) continue;
    double before = 0;
    for (const int edge : {8, 16, 32}) {
      const study::ManufacturedPressure<TypeParam> manufactured(edge);
      const std::vector<double> pressure = this->solve(set, manufactured);
      double error = 0;
      for (std::size_t i = 0; i < pressure.size(); ++i)
        error = std::max(error, std::abs(pressure[i] - manufactured.exact()[i]));
      if (before > 0) {
        EXPECT_NEAR(std::log2(before / error), 2, 0.1) << kernels::name_of(set) << ", " << edge << " cells";
      }
      before = error;
    }
  }
}

}  // namespace
}  // namespace ringlet::kernels_testing
