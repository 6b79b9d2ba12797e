#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "scene/scene_desc.h"
#include "stability/bounds.h"
#include "state/strand_model.h"

namespace ringlet::stability {
namespace {

constexpr double kShortestHeld = 1e-6;  // kernels/strand/length_projection.h [m]
constexpr double kHeldStrain = 1e-3;    // that the projection of lengths may leave where nothing touches
constexpr double kMovedStrain = 1e-2;   // and where a solid does, at the 99.9th percentile

double length_of(const Strand& strand) {
  double length = 0;
  for (std::size_t i = 1; i < strand.size(); ++i) length += (strand[i] - strand[i - 1]).norm();
  return length;
}

// Hair and companions of a mass-spring strand in turn.
Strand chain_of(const Strand& strand) {
  const std::vector<Vec3> companions = state::rest_companions(strand);
  Strand chain;
  for (std::size_t i = 0; i < strand.size(); ++i) {
    chain.push_back(strand[i]);
    if (i < companions.size()) chain.push_back(strand[0] + companions[i]);
  }
  return chain;
}

// The most that still hair is dragged by a wind of this speed [m/s^2].
double drag_of(const scene::Scene& scene, double speed) {
  if (!scene.effects.wind) return 0;
  const scene::DragCoefficients& drag = scene.effects.wind->normal;
  return (drag.linear + drag.quadratic * speed) * speed /
         (scene.effects.wind->linear_density * scene.model.particle_mass);
}

// What the bounds are made of.
struct Motion {
  double step, drag, damping;  // h [s], d [1/s], h + beta [s]
  double weight;               // |g| [m/s^2]
  double edge;                 // stiffness of edges [1/s^2]
  double held;                 // stiffness that holds every particle to its ghost [1/s^2]; 0: nothing does
  bool preloaded;              // the weight is carried
  double epsilon;              // of the precision
  double length = 0;           // of the longest strand, stretched by its weight where lengths are free [m]
  double shortest = 1e9;       // segment that is held to its length [m]
  double nodes = 0;            // that carry mass
  double loaded = 0;           // energy of springs that bear weight and wind [m^2/s^2]
  double folded = 0;           // energy of springs whose two ends lie in one point [m^2/s^2]

  Motion(const Scenario& scenario, const scene::Scene& scene)
      : step(1 / (scene.frames.fps * scene.model.substeps)),
        drag(scene.model.drag),
        damping(step + scene.model.material_damping),
        weight(scene.effects.gravity.value_or(Vec3::Zero()).norm()),
        edge(scene.model.stiffness.edge),
        held(scenario.model == Model::kAms && !scene.effects.non_hookean ? scene.model.stiffness.integrity
                                                                         : 0),
        preloaded(held > 0 && scene.model.preload),
        epsilon(in_double(scenario.machine) ? 0x1p-52 : 0x1p-23) {
    const scene::Stiffness& k = scene.model.stiffness;
    for (const Strand& strand : scenario.hair) {
      const double n = static_cast<double>(strand.size());
      const double stretch = scene.effects.inextensible || preloaded ? 0 : weight * n * n / (2 * edge);
      length = std::max(length, length_of(strand) + stretch);
      nodes += scenario.model == Model::kAms ? n : 2 * n - 1;
      for (std::size_t i = 1; i < strand.size(); ++i)
        if (const double l = (strand[i] - strand[i - 1]).norm(); l > kShortestHeld)
          shortest = std::min(shortest, l);
      const Strand chain = scenario.model == Model::kAms ? strand : chain_of(strand);
      const double count = static_cast<double>(chain.size());
      // A load on every node hangs on the springs of those before it: stretched by f n / kappa, four abreast.
      const double load = (preloaded ? 0 : weight) + drag_of(scene, scenario.air);
      loaded += 4 * load * load * count * count * count / (6 * edge);
      for (std::size_t span = 1; span <= 3; ++span)
        for (std::size_t i = span; i < chain.size(); ++i)
          folded += std::max({k.edge, k.bend, k.twist}) * (chain[i] - chain[i - span]).squaredNorm();
    }
  }

  // Frequency of the slowest mode [1/s]: the ghosts' where they hold every particle, else that of a hanging
  // chain, 1.2 sqrt(g / L), and of the angular couplings alone where nothing hangs.
  double lowest() const { return held > 0 ? std::sqrt(held) : 1.2 * std::sqrt(weight / length); }

  // Rate at which a mode of the springs decays [1/s]. With w its frequency a step is
  //   (1 + h d + h (h + beta) w^2) v' = v - h w^2 x,  x' = x + h v'
  double decay(double w) const {
    const double m = 1 + step * drag + step * damping * w * w, c = step * step * w * w;
    const std::complex<double> half = (1 + m - c) / (2 * m), root = std::sqrt(half * half - 1 / m);
    return -std::log(std::max(std::abs(half + root), std::abs(half - root))) / step;
  }
  // What drags on motion that no spring resists [1/s]: a weight that swings.
  double drag_on_all() const { return drag + damping * held; }
  double slowest_decay() const {
    double least = weight > 0 ? 0.5 * drag_on_all() : 1e9;
    for (double w = std::max(lowest(), 1.0); w < 1e7; w *= 1.05) least = std::min(least, decay(w));
    return least;
  }
  // Greatest answer of a mode to roots that move at a speed of 1, at resonance.
  double gain() const { return std::max(lowest(), 1.0) / std::max(drag_on_all(), 1e-9); }

  // Energy of springs between positions that are rounded, and of the motion that a step makes of that: each
  // particle is off by the precision of its strand's length.
  double rounding() const {
    const double off = 4 * epsilon * length;
    return nodes * (3 * edge * off * off + 0.5 * off * off / (step * step));
  }
};

void hold(const char* what, double measured, double bound) {
  testing::Test::RecordProperty(what, fmt::format("{:.6g}", measured));
  testing::Test::RecordProperty(std::string(what) + "_bound", fmt::format("{:.6g}", bound));
  EXPECT_TRUE(measured <= bound) << what << " is " << measured << ", at most " << bound << " expected";
}

// What nothing but drag brings back creeps: w^2 / d x exp(-w^2 t / d) is nowhere above x / (e t).
bool only_dragged(const Motion& motion) { return !(motion.held > 0 || motion.weight > 0); }

// The time from the greatest speed to rest at the slowest mode's rate.
double time_to_rest(const Motion& motion, double rest, double speed, double reach) {
  const double decayed = std::log(std::max(speed / rest, 1.0)) / motion.slowest_decay();
  return only_dragged(motion) ? std::max(decayed, reach / (std::numbers::e * rest)) : decayed;
}
// What is left of the greatest speed after a time at that rate.
double speed_after(const Motion& motion, double speed, double reach, double seconds) {
  const double left = speed * std::exp(-motion.slowest_decay() * seconds);
  return only_dragged(motion) ? std::max(left, reach / (std::numbers::e * seconds)) : left;
}

}  // namespace

Bounds bounds_of(const Scenario& scenario, const Outcome& outcome) {
  const scene::Scene scene = scene_of(scenario);
  const Motion motion(scenario, scene);
  const double reach = (1 + kHeldStrain) * motion.length + outcome.reach_at_start;
  // Speed that roots, solids (taken along, and pulled back to its length) and the air give, and the weight
  // where nothing carries it or its ghosts turn.
  const double moved = scenario.driven * (1 + motion.gain());
  double given = moved + scenario.air + 2 * scenario.solid;
  if (!motion.preloaded) given += std::sqrt(2 * motion.weight * motion.length);
  if (motion.preloaded && scenario.driven > 0) given += 2 * motion.weight / motion.lowest();
  const bool lengths = scene.effects.inextensible.has_value();
  Bounds bounds{};
  bounds.energy =
      std::max(outcome.energy_at_start, 0.0) + 0.5 * motion.nodes * given * given + motion.rounding();
  // Lengths are held for the hair, not for companions beside it.
  if (!lengths || scenario.model == Model::kMassSpring) bounds.energy += motion.loaded;
  // Solids may press hair into any shape that keeps its lengths. So may a step that takes particles farther
  // than their segments are long: directions are those of its start.
  const double first_step =
      motion.step * motion.step * motion.held * reach +
      (motion.preloaded ? 0 : motion.step * std::sqrt(2 * motion.weight * motion.length));
  if (scenario.pressed || (scenario.start && first_step > motion.shortest))
    bounds.energy += motion.folded + 0.5 * motion.held * motion.nodes * 4 * motion.length * motion.length;
  // No implicit step takes a particle farther than its strand can reach.
  bounds.speed = std::min(std::sqrt(2 * bounds.energy),
                          outcome.speed_at_start + reach / motion.step + given + scenario.driven);
  const double energetic = std::sqrt(2 * bounds.energy / motion.edge) / motion.shortest;
  // A step turns no direction: a segment whose end moves across it is longer after that.
  const double turn = scenario.driven * motion.step / motion.shortest;
  const double turned = std::sqrt(1 + turn * turn) - 1;
  bounds.strain = lengths ? kHeldStrain : std::max({energetic, turned, outcome.strain_at_start});
  bounds.moved_strain = lengths ? kMovedStrain : bounds.strain;
  const double rest = at_rest(scenario, scene), seconds = scenario.seconds - scenario.calm;
  // What creeps ever slower, and by s in all, goes at s / t at most after a time t.
  bounds.last_speed =
      std::max(rest, scenario.creeps ? reach / seconds : speed_after(motion, bounds.speed, reach, seconds));
  bounds.rest = scenario.creeps ? 0 : time_to_rest(motion, rest, bounds.speed, reach);
  return bounds;
}

void hold(const Outcome& outcome, const Bounds& bounds, double seconds) {
  EXPECT_EQ(outcome.diverged, "");
  EXPECT_TRUE(outcome.finite);
  hold("energy", outcome.energy, bounds.energy);
  hold("strain", outcome.strain, bounds.strain);
  hold("moved_strain", outcome.moved_strain, bounds.moved_strain);
  hold("speed", outcome.speed, bounds.speed);
  hold("last_speed", outcome.last_speed, bounds.last_speed);
  if (bounds.rest > 0 && bounds.rest <= seconds) hold("rest", outcome.rest, bounds.rest);
}

void hold(const Scenario& scenario) {
  if (const std::string reason = why_not(scenario.machine); !reason.empty()) GTEST_SKIP() << reason;
  const Outcome outcome = run(scenario);
  hold(outcome, bounds_of(scenario, outcome), scenario.seconds - scenario.calm);
}

}  // namespace ringlet::stability
