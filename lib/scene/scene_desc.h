// A scene as plain structs: what scene::load makes of the JSON, and all that the rest of the program sees of
// it.
//
// Every value is filled in: defaults live in schemas/scene.schema.json and only there. Lengths of the scene
// itself (translations, step lengths, tolerances) are already in metres and in the scene's axes; files are
// read in the units and up axis given beside them. An effect that the scene does not name is an empty
// optional: it does not run.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/geometry.h"

namespace ringlet::scene {

enum class Axis { kX, kY, kZ };

struct Units {
  double metres_per_unit;  // [m] one unit of length
  Axis up;
};

// What an asset's block overrides; empty means: what the file declares, or else the scene's.
struct UnitsOverride {
  std::optional<double> metres_per_unit;
  std::optional<Axis> up;
};

struct Frames {
  int first, last;
  double fps;   // [1/s]
  int preroll;  // frames from the rest pose to the first pose, before `first`
};

// ---- Motion
// ------------------------------------------------------------------------------------------------------

enum class Interpolation { kSmooth, kLinear };  // Catmull-Rom and slerp, or linear and slerp

struct Key {
  double frame;
  Vec3 translate;  // [m]
  Quat rotate;
  double scale;
};

struct Animation {
  std::vector<Key> keys;  // sorted by frame; empty: none. Applied on top of the file's own motion.
  Interpolation interpolation;
  std::optional<std::string> clip;  // a clip of the file; "" is its first
  bool loop;                        // the clip repeats; otherwise it holds at its end
  // The scene's own `motion`, the same for all: it carries what the above has moved, and clip, keys and
  // sequence all run `speed` times as fast from frame `first` on.
  std::vector<Key> carrier = {};
  Interpolation carrier_interpolation = Interpolation::kSmooth;
  double speed = 1;

  bool keyed() const { return !keys.empty() || !carrier.empty(); }
};

// A mesh file. `#` characters in the file name stand for the digits of a numbered sequence (one file a
// frame).
struct MeshDesc {
  std::filesystem::path file;
  UnitsOverride units;
  Animation animation;
  std::string pointer;  // JSON pointer of the block, for messages
};

// ---- Groom
// -------------------------------------------------------------------------------------------------------

// A curve root (0) to tip (1): piecewise linear, points sorted by position, held outside. Multiplies a
// stiffness.
using Curve = std::vector<std::array<double, 2>>;

enum class Attach { kNearest, kStored, kFixed };
enum class RootOffset { kKeep, kSnap };
enum class Penetration { kPushOut, kKeep, kPrune };

// Selects scalp triangles of the head's rest pose: those whose centroid lies in the box (when given) and
// whose normal is within `max_angle` of `direction` (when given), and of the mesh named `mesh` (when given).
struct ScalpSelection {
  std::optional<std::string> mesh;         // a mesh or object name in the head file
  std::optional<std::array<Vec3, 2>> box;  // [m] lower and upper corner
  std::optional<Vec3> direction;
  double max_angle;  // [rad]
};

// Procedural growth: physics.md section 9, supplement D of the AMS paper. Names of the paper in brackets.
struct Grow {
  ScalpSelection scalp;
  int strands_per_triangle;  // [p_n]; 0: use `strands`
  int strands;               // total, spread over the selection by area, when strands_per_triangle is 0
  std::int64_t seed;
  int particles;             // per strand, root included
  double step;               // [p_tau] segment length [m]
  double length_variation;   // each strand's step is scaled by 1 + U(-1, 1) * this
  double direction_noise;    // strength of the U(-1, 1) noise on the first direction
  double gravity_influence;  // [p_gamma]
  double max_deviation;      // [p_Gamma]
  double helix_radius;       // [p_h]
  double helix_frequency;    // [p_freq]
  double helix_impact;       // [p_Omega]
  double width;              // [m] strand diameter
};

// Strands through the layers of a hair mesh (groom/hair_mesh_strands.h).
struct HairMeshStrands {
  std::filesystem::path file;
  int strands;     // 0: by `density`
  double density;  // [1/m^2]; 0: by `strands`
  int particles;   // of each, root included
  std::int64_t seed;
  double curl_radius;  // [m]
  double curl_turns;
  double noise;  // [m]
  double noise_waves;
};

struct StiffnessScale {  // multiplies the model's stiffness along the strand
  std::string group;     // "" : every group of this groom
  std::string coupling;  // edge, bend, twist, integrity, angular, or all
  Curve curve;
};

// Which strands of a groom are simulated as guides; the rest are skinned to them.
struct Interpolate {
  int count;                         // so many, spread over the roots; 0: not chosen by count
  std::optional<std::string> group;  // or the strands of this group of the file
  std::vector<int> strands;          // or these, by number
  int neighbours;                    // guides that a strand follows: those with the nearest roots
  std::string pointer;
};

struct Groom {
  std::string name;                           // for messages and the cache; unique in the scene
  std::optional<std::filesystem::path> file;  // either a file
  std::vector<std::filesystem::path> more;    // further files of the same kind, appended as groups
  std::optional<std::filesystem::path> skin;  // .tfxskin beside a .tfx; default: same name if it exists
  std::optional<Grow> grow;                   // or grown on the head
  std::optional<HairMeshStrands> hair_mesh;   // or through a hair mesh
  UnitsOverride units;
  Attach attach;
  double attach_distance;  // [m] roots farther than this from the head are an error
  RootOffset root_offset;
  Penetration penetration;
  Animation animation;  // attach fixed only
  std::vector<StiffnessScale> stiffness;
  std::optional<Interpolate> interpolate;
  std::optional<int> particles;  // of every strand, resampled; otherwise as it is made
  double width;                  // [m] strand diameter where no file gives it
  std::string pointer;
};

// ---- Model
// -------------------------------------------------------------------------------------------------------

enum class ModelType { kAms, kMassSpring, kHairMesh };
enum class Scheme { kProjected, kPaper };  // physics.md section 1
enum class AngularTangent { kConsistent, kPaper };
enum class IntegrityTangent { kExact, kPaper };

struct Stiffness {
  double edge, bend, twist, integrity, angular;
};  // per unit mass [1/s^2]

struct Ellipsoid {  // at rest
  Vec3 centre;      // [m]
  Vec3 radii;       // [m]
  Quat rotation;    // of its axes from the scene's
  bool follows_head;
  Animation motion;  // the scene's alone, for one that does not
  double friction;   // Coulomb mu [-]
};

enum class HairMeshStart { kRest, kCollapsed };

// physics.md section 8; kernels/hairmesh/hair_mesh_elements.h says what the stiffnesses are of.
struct HairMeshModel {
  double density;                                             // [kg/m^3]
  double stretch, stretch_across, shear, horizontal, volume;  // [Pa]
  double bend, bend_across;                                   // [Pa m^2]
  double damping;                                             // [s]
  double drag;                                                // [1/s]
  double residual;                                            // of the solves, relative [-]
  int max_iterations;
  bool deformation_minimisation;
  HairMeshStart start;
  std::vector<Ellipsoid> ellipsoids;
};

// How many substeps a frame takes where the run chooses them (pipeline/substep_control.h).
struct SubstepChoice {
  double tolerance;  // RMS error of position that a frame may add, over the strands' mean length [-]
  int min, max;      // substeps of a frame
};

struct Model {
  ModelType type;
  Scheme scheme;
  Stiffness stiffness;
  double particle_mass;  // [-] enters only forces that do not scale with mass
  int substeps;          // of a frame; the most of one where `substep_choice` is given
  std::optional<SubstepChoice> substep_choice;
  double drag;            // [1/s] diagonal drag G / m
  int clamped_particles;  // 1 hinged, 2 tangent clamped
  bool preload;
  bool geometric_stiffness;
  double material_damping;  // beta [s]
  AngularTangent angular_tangent;
  IntegrityTangent integrity_tangent;
  std::optional<HairMeshModel> hair_mesh;  // of this type alone
};

// ---- Effects
// -----------------------------------------------------------------------------------------------------

enum class Cadence { kSubstep, kFrame };

// What corrections of lengths are least in. kAuto: kStep where substeps are chosen by a tolerance, else
// kMass.
enum class LengthMetric { kAuto, kStep, kMass };

struct Inextensible {
  double tolerance;    // largest edge strain left by the projection [-]
  int max_iterations;  // Newton iterations; a strand that needs more takes more substeps
  LengthMetric metric;
  Cadence cadence;
};

enum class Memory { kPermanent, kReversible };

struct NonHookean {  // physics.md section 3
  Memory memory;
  Curve curve;  // [elongation, tension / (kappa_I L)]: end of the linear range first, breaking point last
};

struct DragCoefficients {
  double linear, quadratic;  // [N s/m^2], [N s^2/m^3]: force on a metre of hair
};

struct WindKey {
  double frame;
  Vec3 velocity;  // [m/s]
};

struct Gusts {
  double strength;  // [-] greatest relative change of the mean wind
  double period;    // [s]
  std::int64_t seed;
};

struct Turbulence {
  double strength;  // [-] root mean square speed of the eddies over the mean wind's
  double scale;     // [m] size of the largest
  int octaves;
  std::int64_t seed;
};

struct Shelter {
  double strength;  // [-] share of the wind that is missing right behind the head
  double wake;      // [m] where half of that is missing
};

struct Wind {
  std::vector<WindKey> keys;  // the mean wind, never empty; linear between keys, held outside
  std::optional<Gusts> gusts;
  std::optional<Turbulence> turbulence;
  std::optional<Shelter> shelter;
  DragCoefficients normal, tangential;
  double linear_density;  // [kg/m]
};

// ---- Hair against hair (physics.md section 5)

struct HairGrid {
  int resolution;   // cells on the longest axis of the strands' box at the first frame
  double pic;       // share of the grid's own velocity that hair takes [-]
  double residual;  // of the pressure, relative to the right hand side [-]
  int max_iterations;
  int passes;  // over positions, until no cell is denser than it may
  Cadence cadence;
  std::optional<double> shelter;  // the wind's loss in hair: factor of Beer and Lambert's exponent [-]
};

struct HairContacts {
  double friction;  // Coulomb mu [-]
  int passes;       // over all contacts
  Cadence cadence;
  std::optional<double> radius;  // [m] of every hair; otherwise half the strands' widths
};

struct HairHair {  // one of them at least
  std::optional<HairGrid> grid;
  std::optional<HairContacts> contacts;
};

// ---- Grooming: what is done to the strands of a groom file, or to those of a run at a frame. Places are in
// the world, at that time.

struct Plane {
  Vec3 point, normal;  // [m], unit length
};

struct Sphere {
  Vec3 centre;
  double radius;
};  // [m]

// Cuts every strand where it first enters what is cut away, counted from its root. One of these is set.
struct Trim {
  std::optional<Plane> plane;              // the half space behind it, which its normal points out of
  std::optional<std::array<Vec3, 2>> box;  // [m] lower and upper corner
  std::optional<Sphere> sphere;
  std::optional<MeshDesc> mesh;  // closed
  bool keep_inside;              // of plane, box, sphere or mesh; otherwise what is outside is kept
  std::optional<double> length;  // [m] from the root along the rest shape: the rest goes
};

enum class Lengthening { kExtend, kScale };  // new particles at the tip, or the whole shape grown

struct Lengthen {                // one of these is set
  std::optional<double> by, to;  // [m]; `to` leaves longer strands alone
  std::optional<double> factor;  // [-] at least 1
  Lengthening mode;
};

// Turns the segments within reach of a curve towards it and along it; lengths stay.
struct Comb {
  std::vector<Vec3> curve;  // [m] two points or more, in the comb's direction
  double radius;            // [m] reach
  double strength;          // [-] at the curve itself: 0 nothing, 1 onto it
};

struct Rest {};  // the present shape becomes the rest shape

struct GroomingOperation {
  int frame;          // of a run: done when this frame has been stepped, before it is written
  std::string groom;  // by name; empty: all
  std::variant<Trim, Lengthen, Comb, Rest> what;
  std::string pointer;  // of the operation, for messages: /effects/grooming/0/trim
};

struct Solid {
  bool is_head;                   // "source": "head"
  std::optional<MeshDesc> mesh;   // otherwise a mesh of its own
  std::optional<MeshDesc> proxy;  // collides in the mesh's place
  double friction;                // Coulomb mu [-]
  double offset;                  // [m] the collision surface lies this far outside the mesh
  std::optional<double> voxel;    // [m]; otherwise from `resolution`
  int resolution;                 // voxels on the longest axis of the mesh's bounds
  int half_width;                 // narrow band, voxels
  std::optional<std::filesystem::path> level_set_cache;  // directory of .vdb files keyed by content
  std::string name;
  std::string pointer;
};

struct Collision {  // alternation of contact and length projections, once a substep
  int iterations;   // cap
};

struct Effects {
  std::optional<Vec3> gravity;  // [m/s^2]
  std::optional<Inextensible> inextensible;
  std::optional<NonHookean> non_hookean;
  std::optional<Wind> wind;  // one that blows at some time
  std::optional<HairHair> hair_hair;
  std::vector<GroomingOperation> grooming;  // by frame, those of a frame in the scene's order
  std::vector<Solid> solids;
  Collision collision;
};

struct Limits {
  double edge_strain;
  double speed;
};  // [-], [m/s]: beyond them the run has diverged

enum class StoredStrands { kAll, kGuides, kBoth };  // where a groom interpolates

enum class Compression { kNone, kDefault, kQuantised };

struct Cache {
  std::vector<std::string> fields;  // position, velocity, elongation, solids
  StoredStrands strands;
  Compression compression;
  double error;  // [m] largest position error of `quantised`
};

struct Scene {
  std::string name;
  std::filesystem::path file;
  Frames frames;
  Units units;
  std::optional<MeshDesc> head;
  std::vector<Groom> grooms;
  Model model;
  Effects effects;
  Limits limits;
  Cache cache;
  std::string resolved;  // the scene as JSON with --set applied and every default filled in
  std::string hash;      // of `resolved`, hexadecimal
};

}  // namespace ringlet::scene
