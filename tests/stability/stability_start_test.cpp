// Hair that starts where no simulation would have put it, on roots that stay.
#include <random>

#include "stability/suite.h"

namespace ringlet::stability {
namespace {

using Points = std::span<Vec3>;

Scenario from(const char* name, Start start, std::vector<std::string> set = {}) {
  return {.name = name, .set = std::move(set), .seconds = 8, .start = std::move(start)};
}

void collapse(std::size_t, Points x, Points) {
  for (Vec3& p : x) p.setZero();
}
void fold(std::size_t, Points x, Points) {
  for (std::size_t i = x.size() / 2; i < x.size(); ++i) x[i] = x[x.size() - 1 - i];
}
void fold_every_segment(std::size_t, Points x, Points) {
  const Vec3 segment = x[1];
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<double>(i % 2) * segment;
}
void straighten(std::size_t, Points x, Points) {
  for (std::size_t i = 0; i < x.size(); ++i)
    x[i] = kLength * static_cast<double>(i) / (kParticles - 1) * Vec3::UnitZ();
}
void invert(std::size_t, Points x, Points) {
  for (Vec3& p : x) p = -p;
}
// The tip at the root and the root's neighbour at the tip.
void reverse_order(std::size_t, Points x, Points) { std::reverse(x.begin() + 1, x.end()); }
void stretch(std::size_t, Points x, Points) {
  for (Vec3& p : x) p *= 3;
}
void scramble(std::size_t strand, Points x, Points v, double reach, double speed) {
  std::mt19937 engine(static_cast<unsigned>(strand) + 3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto random = [&](double size) {
    return Vec3(size * uniform(engine), size * uniform(engine), size * uniform(engine));
  };
  for (std::size_t i = 1; i < x.size(); ++i) x[i] = random(reach), v[i] = random(speed);
}
void shoot(std::size_t, Points, Points v) {
  for (std::size_t i = 1; i < v.size(); ++i) v[i] = 100 * Vec3::UnitZ();
}

const std::vector<Scenario> kStarts = {
    from("collapsed", collapse),
    from("folded", fold),
    from("folded_at_every_segment", fold_every_segment),
    from("collinear", straighten),
    from("inverted", invert),
    from("reversed", reverse_order),
    from("stretched_threefold", stretch),
    from("scrambled", [](std::size_t s, Points x, Points v) { scramble(s, x, v, 0.1, 0); }),
    from("scrambled_and_fast", [](std::size_t s, Points x, Points v) { scramble(s, x, v, 0.1, 50); }),
    from("scrambled_far", [](std::size_t s, Points x, Points v) { scramble(s, x, v, 2, 0); }),
    from("shot", shoot)};

const std::vector<Scenario> kCoarse = {
    from("collapsed_one_substep", collapse, {"/model/substeps=1"}),
    from("scrambled_one_substep", [](std::size_t s, Points x, Points v) { scramble(s, x, v, 0.1, 0); },
         {"/model/substeps=1"}),
    from("inverted_one_substep", invert, {"/model/substeps=1"}),
    from("collapsed_lengths_free", collapse, {"/effects/inextensible=null"}),
    from("scrambled_lengths_free", [](std::size_t s, Points x, Points v) { scramble(s, x, v, 0.1, 0); },
         {"/effects/inextensible=null"})};

INSTANTIATE_TEST_SUITE_P(Starts, Stability, testing::ValuesIn(everywhere(kStarts)), case_name);
INSTANTIATE_TEST_SUITE_P(CoarseStarts, Stability, testing::ValuesIn(everywhere(kCoarse)), case_name);

}  // namespace
}  // namespace ringlet::stability
