// Grooms that no groomer meant to make: on roots that are shaken for a second.
#include "stability/suite.h"

namespace ringlet::stability {
namespace {

Scenario shaken(const char* name, std::vector<Strand> hair, std::vector<std::string> set = {},
                double seconds = 15) {
  set.push_back(shaken_roots(0.05, 3, 1));
  return {.name = name,
          .hair = std::move(hair),
          .set = std::move(set),
          .seconds = seconds,
          .driven = speed_of_shake(0.05, 3),
          .calm = 1};
}

std::vector<Strand> of(int particles, double length) { return few_strands(length, particles); }

// Every second segment without length.
Strand doubled(Strand strand) {
  Strand out;
  for (const Vec3& x : strand) out.insert(out.end(), {x, x});
  return out;
}
std::vector<Strand> with_zero_segments() {
  std::vector<Strand> hair;
  for (const Strand& strand : few_strands()) hair.push_back(doubled(strand));
  hair.push_back({Vec3::Zero(), Vec3::Zero(), 0.1 * Vec3::UnitX(), 0.2 * Vec3::UnitX()});
  hair.push_back({Vec3::Zero(), 0.1 * Vec3::UnitX(), 0.2 * Vec3::UnitX(), 0.2 * Vec3::UnitX()});
  return hair;
}
std::vector<Strand> without_length() {
  return {Strand(5, Vec3::Zero()), Strand(2, Vec3(0.1, 0, 0)), Strand(16, Vec3(0, 0.1, 0))};
}
// There and back over itself.
std::vector<Strand> folded_at_rest() {
  Strand strand;
  for (int i = 0; i < kParticles; ++i)
    strand.push_back(0.01 * std::min(i, kParticles - 1 - i) * Vec3::UnitX());
  return {strand};
}
std::vector<Strand> mixed() {
  std::vector<Strand> hair = few_strands();
  hair.push_back({Vec3::Zero()});
  hair.push_back(straight({0, 0, 0.1}, Vec3::UnitZ(), 2, 0.001));
  hair.push_back(straight({0, 0, 0.1}, Vec3(1, 1, 0), 3, 0.01));
  hair.push_back(helix({0, 0.1, 0}, Vec3::UnitX(), 100, 1));
  hair.push_back(helix({0, 0.1, 0}, -Vec3::UnitX(), 60, 5));
  hair.push_back(straight({0, 0.1, 0}, Vec3(1, 0, 1), 7, 5));
  return hair;
}

const std::vector<Scenario> kShapes = {
    shaken("one_particle", of(1, 0)),
    shaken("two_particles", of(2, kLength)),
    shaken("two_particles_clamped", of(2, kLength), {"/model/clamped_particles=2"}),
    shaken("three_particles", of(3, kLength)),
    shaken("500_particles_50_cm", of(500, 0.5), {}, 2.5),
    shaken("500_particles_5_m", of(500, 5), {}, 4),
    shaken("1_mm", of(kParticles, 0.001)),
    shaken("1_mm_two_particles", of(2, 0.001)),
    shaken("5_m", of(kParticles, 5)),
    shaken("mixed_1_mm_to_5_m", mixed()),
    shaken("segments_without_length", with_zero_segments()),
    shaken("strands_without_length", without_length()),
    shaken("folded_at_rest", folded_at_rest())};

INSTANTIATE_TEST_SUITE_P(Shapes, Stability, testing::ValuesIn(everywhere(kShapes)), case_name);

}  // namespace
}  // namespace ringlet::stability
