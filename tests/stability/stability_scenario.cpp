#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <optional>

#include "effects/executor.h"
#include "groom/groom.h"
#include "oracle/ams_reference.h"
#include "oracle/mass_spring_reference.h"
#include "scene/scene.h"
#include "stability/scenario.h"
#include "state/strand_model.h"

namespace ringlet::stability {
namespace {

using oracle::Points;

class Folder {
 public:
  Folder() { std::filesystem::create_directories(path_); }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::filesystem::path file(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_ =
      std::filesystem::temp_directory_path() / fmt::format("ringlet_stability_{}", ::getpid());
};

void write_hair(const std::filesystem::path& file, const std::vector<Strand>& hair) {
  groom::Strands strands;
  for (const Strand& strand : hair) {
    strands.points.insert(strands.points.end(), strand.begin(), strand.end());
    strands.offsets.push_back(static_cast<std::int64_t>(strands.points.size()));
  }
  strands.groups.assign(hair.size(), 0), strands.group_names = {"hair"};
  groom::write(file, strands, scene::Axis::kY);
}

constexpr const char* kScene = R"({
  "name": "case",
  "frames": {"first": 0, "last": 1},
  "groom": {"file": "hair.h5", "attach": "fixed", "width": 8e-5},
  "model": {"substeps": 8},
  "effects": {"gravity": [0, -9.81, 0], "inextensible": {}},
  "limits": {"edge_strain": 1e3, "speed": 1e6}
})";

// Simulated strands out of a snapshot, and back.
class Arrays {
 public:
  Arrays(const std::vector<Strand>& hair, bool in_double) : double_(in_double), layout_(counts(hair)) {}

  Points get(const state::Snapshot& snapshot, const char* name, std::size_t strand) const {
    Points values(3, layout_.count(strand));
    for (int i = 0; i < values.cols(); ++i)
      for (int c = 0; c < 3; ++c) values(c, i) = value(snapshot.arrays.at(name), layout_.at(strand, i, 3, c));
    return values;
  }
  void put(state::Snapshot& snapshot, const char* name, std::size_t strand,
           std::span<const Vec3> values) const {
    for (std::size_t i = 0; i < values.size(); ++i)
      for (int c = 0; c < 3; ++c)
        set(snapshot.arrays.at(name), layout_.at(strand, static_cast<int>(i), 3, c), values[i][c]);
  }

 private:
  static std::vector<std::int32_t> counts(const std::vector<Strand>& hair) {
    std::vector<std::int32_t> counts;
    for (const Strand& strand : hair) counts.push_back(static_cast<std::int32_t>(strand.size()));
    return counts;
  }
  double value(const std::vector<std::byte>& bytes, std::size_t at) const {
    if (double_) return read<double>(bytes, at);
    return read<float>(bytes, at);
  }
  void set(std::vector<std::byte>& bytes, std::size_t at, double x) const {
    const auto single = static_cast<float>(x);
    if (double_)
      std::memcpy(bytes.data() + at * sizeof x, &x, sizeof x);
    else
      std::memcpy(bytes.data() + at * sizeof single, &single, sizeof single);
  }
  template <class T>
  static double read(const std::vector<std::byte>& bytes, std::size_t at) {
    T x;
    std::memcpy(&x, bytes.data() + at * sizeof x, sizeof x);
    return x;
  }

  bool double_;
  state::StrandLayout layout_;
};

// Energies by unit mass of strands whose roots stay where they are, unturned.
class Energies {
 public:
  Energies(const Scenario& scenario, const scene::Scene& scene)
      : gravity_(scene.effects.gravity.value_or(Vec3::Zero())), still_(scenario.driven == 0) {
    const scene::Stiffness& k = scene.model.stiffness;
    for (const Strand& hair : scenario.hair) {
      Points rest(3, static_cast<int>(hair.size()));
      for (std::size_t i = 0; i < hair.size(); ++i) rest.col(static_cast<int>(i)) = hair[i] - hair[0];
      if (scenario.model == Model::kAms) {
        oracle::Strand strand = oracle::make_strand(rest, {k.edge, k.bend, k.twist, k.integrity, k.angular});
        strand.gravity = gravity_;
        if (scene.model.preload && k.integrity > 0) oracle::preload_gravity(strand);
        strands_.push_back(std::move(strand));
        at_rest_.push_back(potential(strands_.back(), rest));
      } else {
        oracle::MassSpringChain chain;
        const std::vector<Vec3> companions = state::rest_companions(hair);
        chain.rest.resize(3, 2 * rest.cols() - 1);
        for (int n = 0; n < chain.rest.cols(); ++n)
          chain.rest.col(n) = n % 2 ? companions[n / 2] : Vec3(rest.col(n / 2));
        chain.edge.assign(hair.size(), k.edge), chain.bend.assign(hair.size(), k.bend);
        chain.twist.assign(hair.size(), k.twist), chain.gravity = gravity_;
        chains_.push_back(std::move(chain));
        at_rest_.push_back(potential(chains_.back(), chains_.back().rest));
      }
    }
  }

  double of(const state::Snapshot& snapshot, const Arrays& arrays) const {
    double sum = 0;
    for (std::size_t s = 0; s < at_rest_.size(); ++s) {
      const Points x = arrays.get(snapshot, "position", s), v = arrays.get(snapshot, "velocity", s);
      sum += 0.5 * v.squaredNorm();
      if (!still_) continue;
      sum -= at_rest_[s];
      if (!strands_.empty()) {
        sum += potential(strands_[s], x);
        continue;
      }
      const Points y = arrays.get(snapshot, "companion_position", s),
                   w = arrays.get(snapshot, "companion_velocity", s);
      Points nodes(3, 2 * x.cols() - 1);
      for (int n = 0; n < nodes.cols(); ++n) nodes.col(n) = n % 2 ? y.col(n / 2) : x.col(n / 2);
      sum += potential(chains_[s], nodes) + 0.5 * w.leftCols(x.cols() - 1).squaredNorm();
    }
    return sum;
  }

 private:
  double potential(const oracle::Strand& strand, const Points& x) const {
    return oracle::spring_energy(strand, x) + oracle::integrity_energy(strand, x, {}) -
           gravity_.dot(x.rowwise().sum());
  }
  double potential(const oracle::MassSpringChain& chain, const Points& x) const {
    return oracle::energy(chain, x, oracle::chosen_altitudes(x)) - gravity_.dot(x.rowwise().sum());
  }

  Vec3 gravity_;
  bool still_;
  std::vector<oracle::Strand> strands_;
  std::vector<oracle::MassSpringChain> chains_;
  std::vector<double> at_rest_;
};

class Watch : public state::FrameSink {
 public:
  Watch(const Scenario& scenario, const scene::Scene& scene)
      : scenario_(scenario),
        fps_(scene.frames.fps),
        at_rest_(at_rest(scenario, scene)),
        arrays_(scenario.hair, in_double(scenario.machine)),
        energies_(scenario, scene) {}

  void write(state::Frame frame, state::Snapshot snapshot, double) override {
    for (const float x : frame.position) outcome.finite = outcome.finite && std::isfinite(x);
    ++outcome.frames;
    start = snapshot;
    const double energy = energies_.of(snapshot, arrays_), speed = fastest(snapshot);
    if (outcome.frames == 1) outcome.energy_at_start = energy, outcome.speed_at_start = speed, look(snapshot);
    outcome.energy = oracle::larger(outcome.energy, energy);
    outcome.last_speed = speed;
    const double time = frame.number / fps_ - scenario_.calm;
    if (!(speed <= at_rest_)) outcome.rest = std::max(outcome.rest, time + 1 / fps_);
    for (const auto& [name, value] : frame.figures) {
      if (name == "speed_max") outcome.speed = oracle::larger(outcome.speed, value);
      if (name == "edge_strain_free") outcome.strain = oracle::larger(outcome.strain, value);
      if (name == "edge_strain_moved_p999")
        outcome.moved_strain = oracle::larger(outcome.moved_strain, value);
    }
    outcome.last.clear();
    for (std::size_t s = 0; s < scenario_.hair.size(); ++s) {
      const Points x = arrays_.get(snapshot, "position", s);
      for (int i = 0; i < x.cols(); ++i) outcome.last.emplace_back(x.col(i));
    }
    outcome.shown = std::move(frame.position);
  }
  void finish() override {}

  // The start that the scenario asks for, of the snapshot at rest.
  state::Snapshot moved() const {
    state::Snapshot snapshot = start;
    for (std::size_t s = 0; s < scenario_.hair.size(); ++s) {
      std::vector<Vec3> x = columns(arrays_.get(snapshot, "position", s)), v(x.size(), Vec3::Zero());
      scenario_.start(s, x, v);
      arrays_.put(snapshot, "position", s, x), arrays_.put(snapshot, "velocity", s, v);
      if (scenario_.model == Model::kAms) continue;
      const std::vector<Vec3> companions = state::rest_companions(x);
      std::vector<Vec3> half;
      for (std::size_t i = 0; i < companions.size(); ++i) half.push_back(0.5 * (v[i] + v[i + 1]));
      arrays_.put(snapshot, "companion_position", s, companions);
      arrays_.put(snapshot, "companion_velocity", s, half);
    }
    return snapshot;
  }

  Outcome outcome;
  state::Snapshot start;  // the last one seen

 private:
  static std::vector<Vec3> columns(const Points& points) {
    std::vector<Vec3> out;
    for (int i = 0; i < points.cols(); ++i) out.emplace_back(points.col(i));
    return out;
  }
  void look(const state::Snapshot& snapshot) {
    for (std::size_t s = 0; s < scenario_.hair.size(); ++s) {
      const Points x = arrays_.get(snapshot, "position", s);
      outcome.reach_at_start = std::max(outcome.reach_at_start, x.colwise().norm().maxCoeff());
      for (int i = 0; i + 1 < x.cols(); ++i) {
        const double rest = (scenario_.hair[s][i + 1] - scenario_.hair[s][i]).norm();
        if (rest > 0)
          outcome.strain_at_start =
              std::max(outcome.strain_at_start, std::abs((x.col(i + 1) - x.col(i)).norm() / rest - 1));
      }
    }
  }
  double fastest(const state::Snapshot& snapshot) const {
    double most = 0;
    for (std::size_t s = 0; s < scenario_.hair.size(); ++s)
      most = oracle::larger(most, arrays_.get(snapshot, "velocity", s).colwise().norm().maxCoeff());
    return most;
  }

  const Scenario& scenario_;
  double fps_, at_rest_;
  Arrays arrays_;
  Energies energies_;
};

}  // namespace

std::string name_of(Model model) { return model == Model::kAms ? "ams" : "mass_spring"; }
std::string name_of(Machine machine) {
  constexpr const char* kNames[] = {"double", "float", "float_generic", "float_cuda"};
  return kNames[static_cast<int>(machine)];
}
bool in_double(Machine machine) { return machine == Machine::kDouble; }

pipeline::Options options_of(Machine machine) {
  pipeline::Options options;
  options.backend = machine == Machine::kCuda ? pipeline::Backend::kCuda : pipeline::Backend::kCpu;
  options.precision = in_double(machine) ? pipeline::Precision::kDouble : pipeline::Precision::kFloat;
  if (machine == Machine::kGeneric) options.instruction_set = "generic";
  return options;
}

std::string why_not(Machine machine) {
  if (machine != Machine::kCuda) return {};
  try {
    effects::cuda_device_name();
    return {};
  } catch (const Error& error) {
    return error.what();
  }
}

Strand straight(const Vec3& root, const Vec3& direction, int particles, double length) {
  Strand strand;
  for (int i = 0; i < particles; ++i)
    strand.push_back(root + length * i / std::max(particles - 1, 1) * direction.normalized());
  return strand;
}

Strand helix(const Vec3& root, const Vec3& direction, int particles, double length) {
  const Vec3 along = direction.normalized(), side = along.unitOrthogonal(), up = along.cross(side);
  const double pitch = 0.7, turns = 2,
               radius = std::sqrt(1 - pitch * pitch) * length / (2 * std::numbers::pi * turns);
  Strand strand;
  for (int i = 0; i < particles; ++i) {
    const double t = static_cast<double>(i) / std::max(particles - 1, 1),
                 a = 2 * std::numbers::pi * turns * t;
    strand.push_back(root + pitch * length * t * along +
                     radius * ((std::cos(a) - 1) * side + std::sin(a) * up));
  }
  return strand;
}

std::vector<Strand> few_strands(double length, int particles) {
  return {straight({0, 0, 0}, Vec3::UnitX(), particles, length),
          straight({0.01, 0, 0}, -Vec3::UnitY(), particles, length),
          helix({0.02, 0, 0}, Vec3(1, -1, 0), particles, length),
          helix({0, 0.01, 0.01}, Vec3(0, 1, 1), particles, length)};
}

double at_rest(const Scenario& scenario, const scene::Scene& scene) {
  constexpr double kStill = 1e-3;
  const double step = 1 / (scene.frames.fps * scene.model.substeps);
  const double weight = scene.effects.gravity.value_or(Vec3::Zero()).norm();
  const bool ams = scenario.model == Model::kAms;
  const bool carried = ams && scene.model.preload && scene.model.stiffness.integrity > 0;
  double rest = kStill;
  for (const Strand& strand : scenario.hair) {
    const double count = static_cast<double>(strand.size());
    double length = 0;
    for (std::size_t i = 1; i < strand.size(); ++i) length += (strand[i] - strand[i - 1]).norm();
    // Mass springs that hang bent tremble for good: where another altitude of a tetrahedron becomes the
    // shortest, its force jumps, and what the weight has stretched, four springs abreast, is let go and taken
    // up within the damping's time.
    if (!ams)
      rest = std::max(
          rest, 8 * weight * count / scene.model.stiffness.edge / (step + scene.model.material_damping));
    if (carried || !scene.effects.inextensible || length == 0) continue;
    // Weight that lengths bear falls through the slack of their tolerance, and where a step is longer than
    // the tension's fastest mode can be followed (h w > 2, w^2 = 4 g n / l), by what a step gives it.
    const double slack = scene.effects.inextensible->tolerance * length;
    rest = std::max({rest, slack / step, std::sqrt(2 * weight * slack)});
    if (step * std::sqrt(weight * count * count / length) > 1) rest = std::max(rest, weight * step);
  }
  return rest;
}

void write_box(const std::filesystem::path& file, const Vec3& half) {
  std::ofstream out(file);
  out.precision(9);
  constexpr int kFaces[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1},
                                {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
  for (int corner = 0; corner < 8; ++corner)
    out << "v " << (corner & 4 ? 1 : -1) * half.x() << ' ' << (corner & 2 ? 1 : -1) * half.y() << ' '
        << (corner & 1 ? 1 : -1) * half.z() << '\n';
  for (const auto& f : kFaces)
    out << "f " << f[0] + 1 << ' ' << f[1] + 1 << ' ' << f[2] + 1 << "\nf " << f[0] + 1 << ' ' << f[2] + 1
        << ' ' << f[3] + 1 << '\n';
}

scene::Scene scene_of(const Scenario& scenario) {
  static const Folder folder;
  write_hair(folder.file("hair.h5"), scenario.hair);
  for (const auto& [name, half] : scenario.boxes) write_box(folder.file(name + ".obj"), half);
  std::ofstream(folder.file("scene.json")) << kScene;
  std::vector<std::string> set = {fmt::format("/model/type=\"{}\"", name_of(scenario.model))};
  set.insert(set.end(), scenario.set.begin(), scenario.set.end());
  scene::Scene scene = scene::load(folder.file("scene.json"), {set});
  scene.frames.last = std::max(1, static_cast<int>(std::lround(scenario.seconds * scene.frames.fps)));
  return scene;
}

Outcome run(const Scenario& scenario) {
  const scene::Scene scene = scene_of(scenario);
  const auto simulation = pipeline::Simulation::create(scene, options_of(scenario.machine));
  Watch watch(scenario, scene);
  pipeline::RunControl control;
  if (scenario.start) {
    simulation->run({0, 0}, watch, {});
    control.resume = watch.moved();
    watch.outcome = {};
    watch.write({0, 0, {}, {}, {}, {}, {}, {}, {}}, *control.resume, 0);
  }
  try {
    simulation->run({0, scene.frames.last}, watch, control);
  } catch (const pipeline::Diverged& diverged) {
    watch.outcome.diverged = diverged.what();
  }
  return watch.outcome;
}

}  // namespace ringlet::stability
