// Contacts of hair against hair: a wig of 7,905 curls of 21 particles, on the threads there are. `begin` is
// the search for pairs, `pass` one pass over them.
//
// Between its start and end each curl turns about its root by a random angle; the counters tell how many
// pairs and contacts that makes.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>
#include <random>

#include "contact_support.h"

namespace ringlet::kernels_testing {
namespace {

constexpr int kStrands = 7905, kParticles = 21;

// Helices of 0.2 m with their roots spread over a ball of 0.1 m, each pointing away from its centre.
std::vector<HairStrand> wig() {
  std::vector<HairStrand> strands;
  for (int s = 0; s < kStrands; ++s) {
    const double height = 1 - 2 * (s + 0.5) / kStrands, around = s * std::numbers::pi * (3 - std::sqrt(5.0));
    const double ring = std::sqrt(1 - height * height);
    const Vec3 out(ring * std::cos(around), height, ring * std::sin(around));
    const Mat3 turn = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), out).toRotationMatrix();
    HairStrand strand;
    for (int i = 0; i < kParticles; ++i) {
      const double t = i / double(kParticles - 1), a = 8 * std::numbers::pi * t;
      strand.points.push_back(0.1 * out + turn * Vec3(0.2 * t, 0.01 * (std::cos(a) - 1), 0.01 * std::sin(a)));
    }
    strands.push_back(strand);
  }
  return strands;
}

// The wig after its curls have turned by up to `degrees`.
HairRun<float>& turned(double degrees, InstructionSet set) {
  static std::unique_ptr<HairRun<float>> run;
  run = std::make_unique<HairRun<float>>(wig(), 4e-5, 1, set);
  std::mt19937 engine(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (std::size_t s = 0; s < run->strands(); ++s) {
    const Vec3 axis(uniform(engine), uniform(engine), uniform(engine));
    const Mat3 turn = Eigen::AngleAxisd(degrees / 180 * std::numbers::pi * uniform(engine), axis.normalized())
                          .toRotationMatrix();
    const Vec3 root = run->position(s, 0);
    for (int i = 1; i < kParticles; ++i) {
      const Vec3 from = run->position(s, i), to = root + turn * (from - root);
      run->set_position(s, i, to), run->set_velocity(s, i, (to - from) / HairRun<float>::kFrame);
    }
  }
  return *run;
}

void contacts(benchmark::State& state, InstructionSet set, double degrees, bool passes) {
  if (set > kernels::best_instruction_set()) return state.SkipWithError("not on this processor");
  HairRun<float>& run = turned(degrees, set);
  const double pairs = static_cast<double>(run.contacts->begin(run.contact_step()).pairs);
  const auto position = run.state.position, velocity = run.state.velocity;
  std::int64_t found = 0;
  for (auto _ : state) {
    if (passes) {
      found = run.contacts->pass(run.contact_step());
      state.PauseTiming();
      run.state.position = position, run.state.velocity = velocity;
      state.ResumeTiming();
    } else {
      run.contacts->begin(run.contact_step());
    }
  }
  state.counters["pairs"] = pairs, state.counters["contacts"] = static_cast<double>(found);
  state.counters["megabytes"] = static_cast<double>(run.contacts->bytes()) * 1e-6;
}

const bool kRegistered = [] {
  for (const InstructionSet set : {InstructionSet::kGeneric, InstructionSet::kAvx2, InstructionSet::kAvx512})
    for (const double degrees : {0.1, 1.0, 5.0})
      for (const bool passes : {false, true}) {
        const std::string name = std::string("contacts/") + (passes ? "pass" : "begin") + "/" +
                                 std::to_string(degrees).substr(0, 3) + "_degrees/" + kernels::name_of(set);
        benchmark::RegisterBenchmark(name.c_str(), contacts, set, degrees, passes)
            ->Unit(benchmark::kMillisecond)
            ->UseRealTime();
      }
  return true;
}();

}  // namespace
}  // namespace ringlet::kernels_testing
