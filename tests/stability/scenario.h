// Hard cases, run in process: a scene made in code on one model and machine, and what it did.
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry.h"
#include "pipeline/simulation.h"

namespace ringlet::stability {

enum class Model { kAms, kMassSpring };
// Precision and where it runs: the widest instruction set of the CPU, but for kGeneric.
enum class Machine { kDouble, kFloat, kGeneric, kCuda };

std::string name_of(Model model);
std::string name_of(Machine machine);
bool in_double(Machine machine);
pipeline::Options options_of(Machine machine);
// Why the machine is not to be had here; empty where it is.
std::string why_not(Machine machine);

using Strand = std::vector<Vec3>;  // particles at rest, root first, in the world [m]

inline constexpr int kParticles = 16;
inline constexpr double kLength = 0.2;  // [m]

// Straight along `direction` from `root`.
Strand straight(const Vec3& root, const Vec3& direction, int particles = kParticles, double length = kLength);
// A helix of two turns about such a line, as long as that.
Strand helix(const Vec3& root, const Vec3& direction, int particles = kParticles, double length = kLength);
// One straight across, one straight down and two helices.
std::vector<Strand> few_strands(double length = kLength, int particles = kParticles);

// Positions relative to the root [m] and velocities [m/s] of a strand that starts elsewhere than at rest.
using Start = std::function<void(std::size_t strand, std::span<Vec3> x, std::span<Vec3> v)>;

struct Scenario {
  std::string name = {};
  Model model = Model::kAms;
  Machine machine = Machine::kDouble;
  std::vector<Strand> hair = few_strands();
  // On top of gravity, lengths held, fixed roots, 24 frames a second of 8 substeps: as `--set` takes them.
  std::vector<std::string> set = {};
  double seconds = 4;
  Start start = {};  // empty: at rest
  // Fastest that a point which moves rigidly with the roots goes, as a chord over a substep [m/s]; 0: roots
  // stay.
  double driven = 0;
  double air = 0;        // fastest wind [m/s]
  double solid = 0;      // fastest that a solid goes, over a substep [m/s]
  bool pressed = false;  // a solid presses the hair together
  double calm = 0;       // [s] from then on nothing from outside moves
  bool creeps = false;   // springs this stiff lock at steps this long: it never quite comes to rest
  std::map<std::string, Vec3> boxes = {};  // NAME.obj: a box of these half lengths about the origin [m]
};

// What a run did; energies are by unit mass, the sum over all particles: kinetic, springs, integrity, weight,
// above that of the rest shape. Where the roots move, the kinetic one alone.
struct Outcome {
  double energy_at_start = 0, energy = 0;  // the largest [m^2/s^2]
  double speed_at_start = 0;               // [m/s]
  double reach_at_start = 0;               // of any particle from its root [m]
  double strain_at_start = 0;              // of edges [-]
  double strain = 0;                       // largest edge strain of strands that no solid moved [-]
  double moved_strain = 0;                 // of those that one did, 99.9th percentile of a frame
  double speed = 0;                        // of any particle, over all substeps [m/s]
  double rest = 0;        // [s] from the calm until nothing was ever faster than at_rest() at a frame's end
  double last_speed = 0;  // at the end [m/s]
  int frames = 0;         // handed on, all of them finite
  bool finite = true;
  std::string diverged;      // what the run said if it did
  std::vector<Vec3> last;    // positions at the end, relative to the roots, strand after strand [m]
  std::vector<float> shown;  // positions of the last frame handed on
};

// Nothing faster than this is at rest [m/s].
double at_rest(const Scenario& scenario, const scene::Scene& scene);
// An OBJ of a box of these half lengths about the origin [m].
void write_box(const std::filesystem::path& file, const Vec3& half);
// The scene that a scenario runs, with the files that it names in a folder of this process.
scene::Scene scene_of(const Scenario& scenario);
// A run that diverges says so in the outcome; every other error is thrown.
Outcome run(const Scenario& scenario);

}  // namespace ringlet::stability
