// The CUDA backend against the same source run on the host in float, and its bookkeeping. Skipped without a
// GPU.
#include <gtest/gtest.h>

#include <cstring>

#include "kernels/launch/cuda_kernels.h"
#include "kernels/launch/launch.h"
#include "parity/cuda_sphere.h"
#include "parity/cuda_support.h"

namespace ringlet::cuda_testing {
namespace {

using namespace kernels;

// Bits, so that NaN equals itself and zeros keep their sign.
int differing(std::span<const float> a, std::span<const float> b) {
  int count = a.size() == b.size() ? 0 : 1;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k)
    count += std::memcmp(&a[k], &b[k], sizeof(float)) != 0;
  return count;
}

// Largest difference; infinite where one is not finite.
double apart(std::span<const float> a, std::span<const float> b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const double difference = std::abs(double{a[k]} - b[k]);
    most = difference <= most ? most : std::isfinite(difference) ? difference : INFINITY;
  }
  return most;
}

class Cuda : public testing::Test {
 protected:
  void SetUp() override {
    std::string why_not;
    if (!find_cuda_device(&why_not)) GTEST_SKIP() << why_not;
  }
};

// The device's copy of a groom.
struct DeviceGroom {
  std::unique_ptr<CudaStrands> strands;
  std::vector<float> position, velocity, strand_figures, contact_figures;

  explicit DeviceGroom(const HostGroom& host, CudaTiming timing = CudaTiming::kOff)
      : strands(make_cuda_strands(host.model.view(), timing)),
        position(host.state.position.size()),
        velocity(host.state.velocity.size()),
        strand_figures(host.strand_figures.size()),
        contact_figures(host.contact_figures.size()) {
    strands->upload_state({host.state.position, host.state.velocity});
  }
  void move_roots(const HostGroom& host) {
    strands->upload_roots(host.state.root_motion, host.state.root_points);
  }
  void fetch() {
    strands->download_state({position, velocity});
    strands->download_figures(strand_figures, contact_figures);
  }
};

void expect_same_steps(HostGroom host, const StrandParameters<float>& parameters, int substeps) {
  DeviceGroom device(host);
  for (int k = 0; k < substeps; ++k) {
    host.move_roots(parameters.step);
    device.move_roots(host);
    host.step(parameters);
    device.strands->strand_step(host.strand_step(parameters));
  }
  device.fetch();
  EXPECT_EQ(differing(device.position, host.state.position), 0);
  EXPECT_EQ(differing(device.velocity, host.state.velocity), 0);
  EXPECT_EQ(differing(device.strand_figures, host.strand_figures), 0);
  for (const float x : host.state.position) ASSERT_TRUE(std::isfinite(x));
}

TEST_F(Cuda, HelicesStepBitForBit) { expect_same_steps(HostGroom(helices(100)), default_parameters(), 240); }

TEST_F(Cuda, MixedLengthsStepBitForBit) {
  expect_same_steps(HostGroom(mixed_strands(300, 2)), default_parameters(), 240);
}

TEST_F(Cuda, OptionsStepBitForBit) {
  StrandParameters<float> parameters = default_parameters();
  parameters.geometric_stiffness = 0;
  parameters.consistent_angular = parameters.exact_integrity = false;
  parameters.clamped = 2, parameters.length_iterations = 0;
  expect_same_steps(HostGroom(mixed_strands(50, 3)), parameters, 60);
}

TEST_F(Cuda, OneStrandAndNoneStep) {
  expect_same_steps(HostGroom(helices(1)), default_parameters(), 3);
  expect_same_steps(HostGroom(mixed_strands(0, 1)), default_parameters(), 3);
}

// What the device is compared with, R = float, is what the program runs on the CPU, packs of float.
TEST(CudaParity, ThePacksStepAsTheScalarsBitForBit) {
  const InstructionSet set = best_instruction_set();
  if (set == InstructionSet::kGeneric) GTEST_SKIP() << "no fused multiply-add on this processor";
  const StrandParameters<float> parameters = default_parameters();
  HostGroom scalars(mixed_strands(70, 5)), packs(mixed_strands(70, 5));
  const state::StrandLayout& layout = packs.model.layout;
  state::AlignedVector<float> scratch(scratch_reals(layout.longest()));
  for (int k = 0; k < 40; ++k) {
    scalars.move_roots(parameters.step), packs.move_roots(parameters.step);
    scalars.step(parameters);
    cpu_kernels<float>(set).strand_step(packs.strand_step(parameters), 0, layout.batches(), scratch.data());
  }
  EXPECT_EQ(differing(packs.state.position, scalars.state.position), 0);
  EXPECT_EQ(differing(packs.state.velocity, scalars.state.velocity), 0);
}

// A rigid sphere that travels and a deforming one, a frame interval every 5 substeps.
class Solids {
 public:
  std::span<const SolidView> at(int substep) {
    const int interval = interval_of(substep), within = substep % kSubsteps;
    SolidView rigid = rigid_.view(), deforming = shape(interval).view();
    rigid.translation_before[2] = 0.001 * substep, rigid.translation[2] = 0.001 * (substep + 1);
    deforming.level_set[1] = shape(interval + 1).view().level_set[0];
    deforming.blend = (within + 1.0f) / kSubsteps;
    before_ = blended(interval, static_cast<float>(within) / kSubsteps);
    now_ = blended(interval, deforming.blend);
    deforming.vertices_before = before_.data(), deforming.vertices = now_.data();
    for (double* translation : {deforming.translation_before, deforming.translation}) translation[0] = 0.2;
    views_ = {rigid, deforming};
    return views_;
  }
  static int interval_of(int substep) { return substep / kSubsteps; }

 private:
  static constexpr int kSubsteps = 5;

  const Sphere& shape(int frame) const { return frame % 2 ? wide_ : round_; }
  std::vector<float> blended(int interval, float weight) const {
    std::vector<float> vertices = shape(interval).vertices;
    for (std::size_t k = 0; k < vertices.size(); ++k)
      vertices[k] += weight * (shape(interval + 1).vertices[k] - vertices[k]);
    return vertices;
  }

  Sphere rigid_{0.06, 1, 0.006f}, round_{0.04, 1, 0.006f}, wide_{0.04, 1.3, 0.006f};
  std::vector<float> before_, now_;
  std::vector<SolidView> views_;
};

TEST_F(Cuda, ContactsAgree) {
  const StrandParameters<float> parameters = default_parameters();
  const ContactParameters contact{parameters.step, 1, 4, 3, 1e-4f, 10, 1000, 0, 0};
  HostGroom host(helices(100));
  host.skin[3] = kIgnoresHome;
  host.state.touches.assign(host.model.layout.rows() * kTouchReals * kLanes, 0.0f);
  DeviceGroom device(host);
  device.strands->upload_skin(host.skin);
  Solids solids;
  double touched = 0;
  for (int k = 0; k < 24; ++k) {
    host.move_roots(parameters.step);
    device.move_roots(host);
    host.step(parameters);
    device.strands->strand_step(host.strand_step(parameters));
    for (std::size_t s = 0; s < host.model.layout.strands(); ++s)  // as contacts leave them
      host.state.touches[host.model.layout.at(s, 20, kTouchReals, kTouchLoad)] = 0.02f * (s % 5);
    device.strands->upload_touches(host.state.touches);
    host.collide(solids.at(k), parameters.step);
    device.strands->upload_solids(solids.at(k), Solids::interval_of(k));
    device.strands->contact_step(contact);
    for (std::size_t batch = 0; batch < host.lanes() / kLanes; ++batch)
      for (int lane = 0; lane < kLanes; ++lane)
        touched += host.contact_figures[(batch * kContactFigures + kTouched) * kLanes + lane];
  }
  device.fetch();
  EXPECT_GT(touched, 100);
  const double position = apart(device.position, host.state.position);  // [m]
  const double velocity = apart(device.velocity, host.state.velocity);  // [m/s]
  EXPECT_TRUE(position <= 1e-5) << position;
  EXPECT_TRUE(velocity <= 1e-2) << velocity;
  RecordProperty("differing_values", differing(device.position, host.state.position));
  std::vector<float> touches(host.state.touches.size());
  device.strands->download_figures({}, {}, {}, touches);
  int held = 0, otherwise = 0;  // particles; those that all but touch may be either
  const state::StrandLayout& layout = host.model.layout;
  for (std::size_t s = 0; s < layout.strands(); ++s)
    for (int i = 0; i < layout.count(s); ++i) {
      Eigen::Vector<float, kTouchReals> there, here;
      for (int c = 0; c < kTouchReals; ++c) {
        const std::size_t at = layout.at(s, i, kTouchReals, c);
        there[c] = touches[at], here[c] = host.state.touches[at];
      }
      held += here.head<3>().norm() > 0.5f, otherwise += (there - here).norm() > 0.02f;
    }
  EXPECT_GT(held, 50);
  EXPECT_LT(otherwise, 0.05 * held);
}

TEST_F(Cuda, RigidSolidsAreCopiedOnce) {
  HostGroom host(helices(20));
  DeviceGroom device(host, CudaTiming::kOn);
  const std::size_t without = device.strands->bytes();
  const Sphere sphere(0.06, 1, 0.006f);
  const std::vector<SolidView> solids{sphere.view()};
  device.strands->upload_solids(solids, 0);
  const std::size_t with = device.strands->bytes();
  EXPECT_GT(with, without + sphere.vertices.size() * sizeof(float));
  device.strands->upload_solids(solids, 1);
  EXPECT_EQ(device.strands->bytes(), with);
}

TEST_F(Cuda, LaunchesAreNamedAndTimed) {
  const StrandParameters<float> parameters = default_parameters();
  HostGroom host(helices(20));
  DeviceGroom device(host, CudaTiming::kOn);
  host.move_roots(parameters.step);
  device.move_roots(host);
  for (int k = 0; k < 300; ++k) device.strands->strand_step(host.strand_step(parameters));
  device.strands->contact_step({parameters.step, 1, 4, 3, 1e-4f, 10, 1000, 0, 0});
  const std::vector<CudaLaunches> launches = device.strands->launches();
  ASSERT_EQ(launches.size(), 2u);
  EXPECT_EQ(launches[0].name, "strand step");
  EXPECT_EQ(launches[0].count, 300);
  EXPECT_GT(launches[0].seconds, 0);
  EXPECT_EQ(launches[1].name, "contact step");
  EXPECT_EQ(launches[1].count, 1);
}

TEST_F(Cuda, MemoryIsGivenBack) {
  const HostGroom host(mixed_strands(2000, 4));
  const auto make_and_drop = [&] {
    const DeviceGroom device(host);
    return device.strands->bytes();
  };
  make_and_drop();  // the context and the kernels take theirs once
  const std::size_t before = find_cuda_device()->free_memory;
  std::size_t bytes = 0;
  for (int k = 0; k < 10; ++k) bytes = make_and_drop();
  EXPECT_GT(bytes, host.model.bytes() + 2 * host.state.position.size() * sizeof(float));
  EXPECT_LT(before, find_cuda_device()->free_memory + bytes);
}

TEST_F(Cuda, WrongSizesAreRefused) {
  const HostGroom host(helices(3));
  DeviceGroom device(host);
  const std::vector<float> few(5);
  EXPECT_THROW(device.strands->upload_state({few, host.state.velocity}), CudaError);
  EXPECT_THROW(device.strands->upload_skin(std::vector<std::int32_t>(5)), CudaError);
}

TEST(CudaAbsence, IsExplained) {
  std::string why_not;
  if (find_cuda_device(&why_not)) GTEST_SKIP() << "a device is here";
  EXPECT_FALSE(why_not.empty());
  EXPECT_EQ(why_not == "built without CUDA", !cuda_compiled());
  const HostGroom host(helices(3));
  EXPECT_THROW(make_cuda_strands(host.model.view(), CudaTiming::kOff), CudaError);
}

}  // namespace
}  // namespace ringlet::cuda_testing
