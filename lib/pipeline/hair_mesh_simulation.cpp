#include "pipeline/hair_mesh_simulation.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/log.h"
#include "core/timer.h"
#include "core/trace.h"
#include "effects/instruction_set.h"
#include "effects/wind/wind_field.h"
#include "hairmesh/body.h"
#include "pipeline/frames.h"
#include "pipeline/substep_control.h"
#include "pipeline/world.h"
#include "solids/keyframes.h"

namespace ringlet::pipeline {
namespace {

// One groom: its mesh, the strands through it, and where its roots go.
template <class T>
struct Part {
  const groom::HairMeshStrands& strands;
  Roots roots;  // of the mesh's columns
  std::vector<Pose> poses;
  std::vector<Vec3> air;                              // [vertices] [m/s]; empty: still
  std::vector<kernels::MeshEllipsoid<T>> ellipsoids;  // as they move in the substep
  hairmesh::Body<T> body;
  std::int64_t first_strand, first_particle;  // in the cache
};

template <class T>
Part<T> make_part(const scene::Scene& scene, const World& world, std::size_t index,
                  kernels::InstructionSet set) {
  const scene::Groom& desc = scene.grooms[index];
  const auto& [mesh, strands] = world.hair_meshes[index];
  groom::Strands columns = hairmesh::columns_of(mesh);
  std::vector<Vec3> rest(mesh.layer(0).begin(), mesh.layer(0).end());
  Roots roots(world.head.get(), scene.frames);
  if (desc.attach == scene::Attach::kFixed)
    roots.add_fixed(desc.animation, std::move(rest));
  else
    roots.add_attached(groom::Attachment::to_head(columns, scalp_of(*world.head), desc), std::move(rest));
  std::vector<Pose> poses(mesh.vertices());
  roots.pose(first_time(scene.frames), poses);
  hairmesh::Body<T> body(mesh, *scene.model.hair_mesh, poses, set);
  log_info(fmt::format("groom \"{}\": hair mesh of {} faces, {} layers, {} vertices, {} prisms", desc.name,
                       mesh.faces.size(), mesh.layers, mesh.positions.size(), mesh.prisms()));
  return {strands, std::move(roots), std::move(poses), {}, {}, std::move(body), 0, 0};
}

template <class T>
class HairMeshSimulation : public Simulation {
 public:
  HairMeshSimulation(const scene::Scene& scene, const Options& options)
      : scene_(scene),
        set_(effects::choose_instruction_set(options.instruction_set)),
        world_(build_world(scene_)) {
    std::int64_t strands = 0, particles = 0;
    for (std::size_t k = 0; k < scene_.grooms.size(); ++k) {
      Part<T>& part = parts_.emplace_back(make_part<T>(scene_, world_, k, set_));
      part.first_strand = strands, part.first_particle = particles;
      strands += static_cast<std::int64_t>(part.strands.size());
      particles += static_cast<std::int64_t>(part.strands.size()) * part.strands.points();
    }
    points_.resize(static_cast<std::size_t>(particles));
    if (asks_for(scene_, "velocity")) speeds_.resize(points_.size());
    if (scene_.effects.wind) {
      wind_.emplace(*scene_.effects.wind, scene_.frames, parts_[0].body.origin());
      for (Part<T>& part : parts_) part.air.resize(part.body.positions().size());
    }
    if (scene_.model.substep_choice) control_.emplace(scene_, mean_length(world_));
    make_plan(strands, particles);
  }

  const Plan& plan() const override { return plan_; }

  state::RunHeader header(const FrameRange& range) const override {
    state::RunHeader header = make_header(scene_, world_);
    header.program_version = RINGLET_VERSION;
    header.backend = "cpu";
    header.instruction_set = kernels::name_of(set_);
    header.precision = sizeof(T) == 8 ? "double" : "float";
    header.first_frame = range.first, header.last_frame = range.last;
    return header;
  }

  bool run(const FrameRange& range, state::FrameSink& sink, const RunControl& control) override;

 private:
  bool has_solids() const { return !world_.solids.empty() || !scene_.model.hair_mesh->ellipsoids.empty(); }
  double time_of(int frame, int substep = 0, int substeps = 1) const {
    return pipeline::time_of(scene_.frames, frame, substep, substeps);
  }

  void make_plan(std::int64_t strands, std::int64_t particles);
  std::size_t bytes_of_tries() const;
  void step_frame(int frame);
  // Not a number where one of them is none.
  double largest_residual() const {
    return taken_.minimise_residual <= taken_.residual   ? taken_.residual
           : taken_.residual <= taken_.minimise_residual ? taken_.minimise_residual
                                                         : std::nan("");
  }
  bool stopped_short() const;
  void warn_of_residual(int frame);
  void take_frame(int frame, int substeps);
  std::vector<double> vertices() const;
  void probe(int frame, int number);
  void substep(int frame, double before, double now, bool last);
  void blow(double time);
  void move_solids(double before, double now);
  Pose head_at(double time) const;
  Pose carrier(const scene::Ellipsoid& ellipsoid, const Pose& head, double time) const;
  void check(const char* stage, int frame);
  void check_residual(const char* stage, int frame);
  std::string precision_hint() const;
  [[noreturn]] void tell(const char* stage, int frame, std::size_t part,
                         const hairmesh::MeshDivergence& diverged);
  state::Frame frame_now(int frame);
  state::Figures figures() const;
  state::Snapshot snapshot(int frame) const;
  void resume(const state::Snapshot& snapshot);
  void set_state(const state::Snapshot& snapshot);

  std::int64_t launches() const;

  template <class Work>
  void timed(const char* name, const Work& work) {
    const Timer timer;
    trace::Span span(name, "stage");
    const std::int64_t before = launches();
    work();
    if (span.recorded()) {
      span.tell("launches", static_cast<double>(launches() - before));
      for (const PlannedStage& stage : plan_.stages)
        if (stage.name == name) span.tell("bytes", static_cast<double>(stage.bytes));
    }
    for (auto& [stage, spent] : seconds_)
      if (stage == name) spent += timer.seconds();
  }

  scene::Scene scene_;
  kernels::InstructionSet set_;
  World world_;
  std::vector<Part<T>> parts_;
  std::optional<effects::WindField> wind_;
  std::vector<Vec3> points_, speeds_;      // [particles] of the cache
  std::vector<kernels::SolidView> views_;  // of the solids, as they move in the substep
  hairmesh::FrameFigures taken_;
  bool warned_ = false;  // of a residual
  StageSeconds seconds_;
  std::int64_t launches_ = 0;              // beside those of the bodies
  std::optional<SubstepControl> control_;  // where the scene leaves the substeps to it
  std::function<void(const std::string&, int, int, state::Snapshot&)> probe_;
  Plan plan_;
};

// A launch is a kernel of the solver, or a pass over a groom's columns, vertices or strands.
template <class T>
std::int64_t HairMeshSimulation<T>::launches() const {
  std::int64_t sum = launches_;
  for (const Part<T>& part : parts_) sum += part.body.launches();
  return sum;
}

template <class T>
void HairMeshSimulation<T>::make_plan(std::int64_t strands, std::int64_t particles) {
  const SubstepControl* control = control_ ? &*control_ : nullptr;
  plan_ = frames_planned(scene_, control);
  plan_.strands = strands, plan_.particles = particles;
  std::size_t bodies = 0, roots = 0, air = 0, generators = (points_.size() + speeds_.size()) * sizeof(Vec3),
              solids = 0;
  for (const Part<T>& part : parts_) {
    bodies += part.body.bytes(), roots += part.poses.size() * sizeof(Pose),
        air += part.air.size() * sizeof(Vec3);
    generators += part.strands.bytes();
  }
  for (const solids::Solid& solid : world_.solids) solids += solid.bytes();
  const auto add = [&](const char* name, const char* what, bool runs, std::size_t bytes,
                       effects::Launches launches) {
    plan_.stages.push_back({name, what, runs, runs ? bytes : 0, runs ? launches : effects::Launches{0, 0}});
    if (runs) seconds_.emplace_back(name, 0.0);
  };
  const auto grooms = static_cast<std::int64_t>(parts_.size());
  // Of a frame: so many for each groom and substep, or once.
  const auto of_substeps = [&](std::int64_t each) {
    return launches_of_run(plan_, control, [&](int substeps) {
      return effects::Launches{grooms * each * substeps, grooms * each * substeps};
    });
  };
  const effects::Launches each = of_substeps(1);
  const effects::Launches once = launches_of_run(plan_, control, [&](int) {
    return effects::Launches{grooms, grooms};
  });
  const std::int64_t shown =
      grooms * (speeds_.empty() ? 1 : 2) * (scene_.frames.last - scene_.frames.first + 1);
  add(kTries, kTriesAre, control != nullptr, bytes_of_tries(), {0, 0});
  add("roots", "the scalp's vertices carried by the head", true, roots, each);
  add("wind", "mean wind, gusts, turbulence", wind_.has_value(), air, each);
  add("forces", "stretch, shear, bend and volume of the hair mesh; the system", true, bodies, each);
  add("solve", "implicit step by filtered conjugate gradients", true, 0, each);
  add("solids", "outer vertices moved out of level sets and ellipsoids, friction", has_solids(), solids,
      of_substeps(static_cast<std::int64_t>(world_.solids.size()) +
                  (scene_.model.hair_mesh->ellipsoids.empty() ? 0 : 1)));
  add("minimisation", "the rest of the mesh taken along",
      has_solids() && scene_.model.hair_mesh->deformation_minimisation, 0, once);
  add("strands", "strands through the layers, once a frame", true, generators, {shown, shown});
}

// A checkpoint of the frame's start, contacts of all vertices where there may be some, and what tries led to.
template <class T>
std::size_t HairMeshSimulation<T>::bytes_of_tries() const {
  std::size_t bytes = 0, vertices = 0;
  for (const Part<T>& part : parts_) {
    vertices += part.body.positions().size();
    bytes += part.body.checkpoint_bytes(has_solids());
  }
  return bytes + SubstepControl::bytes(3 * vertices);
}

template <class T>
void HairMeshSimulation<T>::blow(double time) {
  const kernels::WindField<double> field = wind_->at<double>(time);
  for (Part<T>& part : parts_) {
    ++launches_;
    tbb::parallel_for(std::size_t{0}, part.air.size(), [&](std::size_t v) {
      const Vec3& x = part.body.positions()[v];
      const kernels::Vector3<double> air = kernels::air_velocity(
          field, kernels::Vector3<double>{x.x() - field.origin[0], x.y() - field.origin[1],
                                          x.z() - field.origin[2]});
      part.air[v] = {air.x, air.y, air.z};
    });
  }
}

// How the head as a whole has been carried from rest.
template <class T>
Pose HairMeshSimulation<T>::head_at(double time) const {
  if (!world_.head) return {};
  if (world_.head->motion() != solids::AnimatedMesh::Motion::kDeforming) return world_.head->pose(time);
  std::vector<Vec3> vertices(world_.head->vertex_count());
  world_.head->sample(time, vertices);
  return world_.head->nearest_pose(vertices);
}

template <class T>
Pose HairMeshSimulation<T>::carrier(const scene::Ellipsoid& ellipsoid, const Pose& head, double time) const {
  if (ellipsoid.follows_head && world_.head) return head;
  const solids::Similarity moved = solids::sample_animation(ellipsoid.motion, scene_.frames, time);
  return {moved.rotate.toRotationMatrix(), moved.translate};
}

template <class T>
void HairMeshSimulation<T>::move_solids(double before, double now) {
  views_.clear();
  for (solids::Solid& solid : world_.solids) views_.push_back(solid.at(before, now));
  const auto& ellipsoids = scene_.model.hair_mesh->ellipsoids;
  const Pose head_before = ellipsoids.empty() ? Pose{} : head_at(before),
             head_now = ellipsoids.empty() ? Pose{} : head_at(now);
  for (Part<T>& part : parts_) {
    part.ellipsoids.clear();
    for (const scene::Ellipsoid& ellipsoid : ellipsoids)
      part.ellipsoids.push_back(
          hairmesh::moving_ellipsoid<T>(ellipsoid, carrier(ellipsoid, head_before, before),
                                        carrier(ellipsoid, head_now, now), part.body.origin(), now - before));
    part.body.carry(views_, part.ellipsoids, now - before);
  }
}

template <class T>
void HairMeshSimulation<T>::substep(int frame, double before, double now, bool last) {
  timed("roots", [&] {
    for (Part<T>& part : parts_) ++launches_, part.roots.pose(now, part.poses);
  });
  if (wind_) timed("wind", [&] { blow(now); });
  if (has_solids()) timed("solids", [&] { move_solids(before, now); });
  const Vec3 gravity = scene_.effects.gravity.value_or(Vec3::Zero());
  timed("forces", [&] {
    for (Part<T>& part : parts_) part.body.assemble(now - before, part.poses, gravity, part.air);
  });
  timed("solve", [&] {
    for (Part<T>& part : parts_) part.body.solve(taken_);
  });
  check("solve", frame);
  if (!has_solids()) return;
  timed("solids", [&] {
    for (Part<T>& part : parts_) part.body.collide(views_, part.ellipsoids, taken_);
  });
  check("solids", frame);
  if (!last || !scene_.model.hair_mesh->deformation_minimisation) return;
  timed("minimisation", [&] {
    for (Part<T>& part : parts_) part.body.minimise(taken_);
  });
  check("minimisation", frame);
}

template <class T>
void HairMeshSimulation<T>::step_frame(int frame) {
  for (auto& [stage, spent] : seconds_) spent = 0;
  if (!control_) return take_frame(frame, scene_.model.substeps);
  state::Snapshot start;
  timed(kTries, [&] { start = snapshot(frame - 1); });
  double count = 0;
  for (const Part<T>& part : parts_) count += static_cast<double>(part.body.positions().size());
  bool again = false;
  control_->step(frame, count, [&](int substeps) {
    if (again) timed(kTries, [&] { set_state(start); });
    again = true;
    take_frame(frame, substeps);
    return vertices();
  });
}

template <class T>
void HairMeshSimulation<T>::take_frame(int frame, int substeps) {
  taken_ = {};
  for (int s = 0; s < substeps; ++s) {
    trace::Span span("substep");
    span.tell("frame", frame), span.tell("substep", s);
    probe(frame, s);
    substep(frame, time_of(frame - 1, s, substeps), time_of(frame - 1, s + 1, substeps), s + 1 == substeps);
  }
}

template <class T>
std::vector<double> HairMeshSimulation<T>::vertices() const {
  std::vector<double> all;
  std::size_t values = 0;
  for (const Part<T>& part : parts_) values += 3 * part.body.positions().size();
  all.reserve(values);
  for (const Part<T>& part : parts_)
    for (const Vec3& x : part.body.positions()) all.insert(all.end(), x.begin(), x.end());
  return all;
}

template <class T>
void HairMeshSimulation<T>::probe(int frame, int number) {
  if (!probe_) return;
  state::Snapshot arrays = snapshot(frame);
  probe_("start", frame, number, arrays);
  set_state(arrays);
  check("start", frame);
}

template <class T>
void HairMeshSimulation<T>::check(const char* stage, int frame) {
  for (std::size_t k = 0; k < parts_.size(); ++k) {
    if (const auto diverged = parts_[k].body.diverged(scene_.limits)) tell(stage, frame, k, *diverged);
    if (const auto contact = parts_[k].body.bad_contact()) tell(stage, frame, k, *contact);
  }
  check_residual(stage, frame);
}

// One that has stopped no nearer than it began has solved nothing.
template <class T>
void HairMeshSimulation<T>::check_residual(const char* stage, int frame) {
  const double left = largest_residual();
  const bool finite = std::isfinite(left),
             stalled = left >= 1 && taken_.iterations < scene_.model.hair_mesh->max_iterations;
  if (finite && !stalled) return;
  throw Diverged(frame_now(frame), stage, parts_[0].first_strand, -1,
                 "the simulation diverged: a hair mesh's solve has " +
                     (finite ? fmt::format("stopped at a relative residual of {:.2g}", left)
                             : std::string("no finite residual")) +
                     precision_hint());
}

// Where single precision has not told the system well enough.
template <class T>
std::string HairMeshSimulation<T>::precision_hint() const {
  return std::is_same_v<T, float> && (warned_ || stopped_short())
             ? "; double precision solves what single cannot"
             : "";
}

// The particle: that which moves most with the vertex at rest, if one does.
template <class T>
void HairMeshSimulation<T>::tell(const char* stage, int frame, std::size_t k,
                                 const hairmesh::MeshDivergence& diverged) {
  const groom::HairMeshStrands& strands = parts_[k].strands;
  const groom::HairMesh& mesh = world_.hair_meshes[k].mesh;
  std::vector<Vec3> vertices = mesh.positions, rest(strands.size() * strands.points()), moved(rest.size());
  strands.place(vertices, rest);
  vertices[diverged.layer * mesh.vertices() + diverged.column].z() += 1e-6;
  strands.place(vertices, moved);
  double most = 0;
  std::int64_t at = -1;
  for (std::size_t i = 0; i < rest.size(); ++i)
    if (const double way = (moved[i] - rest[i]).norm(); way > most)
      most = way, at = static_cast<std::int64_t>(i);
  const std::int64_t strand = parts_[k].first_strand + std::max<std::int64_t>(at, 0) / strands.points(),
                     particle = at < 0 ? -1 : at % strands.points();
  const std::string hair = at < 0 ? "" : fmt::format(", strand {}, particle {}", strand, particle);
  throw Diverged(
      frame_now(frame), stage, strand, particle,
      fmt::format("the simulation diverged in stage `{}`: groom `{}`, vertex {} of layer {} of its "
                  "hair mesh{}: {}{}",
                  stage, scene_.grooms[k].name, diverged.column, diverged.layer, hair, diverged.what,
                  precision_hint()));
}

template <class T>
state::Frame HairMeshSimulation<T>::frame_now(int frame) {
  for (const Part<T>& part : parts_) {
    const auto first = static_cast<std::size_t>(part.first_particle),
               count = part.strands.size() * static_cast<std::size_t>(part.strands.points());
    const auto place = [&](std::span<const Vec3> vertices, std::vector<Vec3>& points) {
      ++launches_;
      part.strands.place(vertices, std::span(points).subspan(first, count));
    };
    place(part.body.positions(), points_);
    if (!speeds_.empty()) place(part.body.velocities(), speeds_);
  }
  return make_frame(scene_, world_, points_, speeds_, frame, time_of(frame));
}

template <class T>
state::Figures HairMeshSimulation<T>::figures() const {
  double volume = 0, rest = 0, strain = 0, speed = 0;
  kernels::MeshEnergies energy;
  for (const Part<T>& part : parts_) {
    volume += part.body.volume(), rest += part.body.rest_volume();
    strain = std::max(strain, part.body.strain()), speed = std::max(speed, part.body.speed());
    const kernels::MeshEnergies one = part.body.energies();
    energy.stretch += one.stretch, energy.horizontal += one.horizontal, energy.sheets += one.sheets;
    energy.bend += one.bend, energy.volume += one.volume, energy.kinetic += one.kinetic;
  }
  state::Figures figures = {{"mesh_solves", taken_.solves},
                            {"mesh_iterations", taken_.iterations},
                            {"mesh_residual", taken_.residual},
                            {"mesh_volume", volume / rest},
                            {"mesh_strain", strain},
                            {"mesh_speed", speed},
                            {"energy_stretch", energy.stretch},
                            {"energy_horizontal", energy.horizontal},
                            {"energy_sheets", energy.sheets},
                            {"energy_bend", energy.bend},
                            {"energy_volume", energy.volume},
                            {"energy_kinetic", energy.kinetic}};
  if (has_solids())
    figures.insert(figures.end(), {{"mesh_touched", taken_.touched},
                                   {"mesh_corrected", taken_.corrected},
                                   {"mesh_depth", taken_.depth},
                                   {"minimisations", taken_.minimisations},
                                   {"minimisation_iterations", taken_.minimise_iterations},
                                   {"minimisation_residual", taken_.minimise_residual}});
  return figures;
}

template <class T>
state::Snapshot HairMeshSimulation<T>::snapshot(int frame) const {
  state::Snapshot snapshot;
  snapshot.frame = frame;
  for (std::size_t k = 0; k < parts_.size(); ++k)
    parts_[k].body.save(snapshot, k == 0 ? "" : fmt::format("_{}", k));
  if (control_) control_->save(snapshot);
  return snapshot;
}

template <class T>
void HairMeshSimulation<T>::resume(const state::Snapshot& snapshot) {
  if (control_) control_->restore(snapshot);
  set_state(snapshot);
  check("resume", snapshot.frame);
}

template <class T>
void HairMeshSimulation<T>::set_state(const state::Snapshot& snapshot) {
  for (std::size_t k = 0; k < parts_.size(); ++k)
    parts_[k].body.restore(snapshot, k == 0 ? "" : fmt::format("_{}", k));
}

// By more than rounding.
template <class T>
bool HairMeshSimulation<T>::stopped_short() const {
  return !(largest_residual() <= 2 * scene_.model.hair_mesh->residual);
}

// Once: the figures tell of every frame.
template <class T>
void HairMeshSimulation<T>::warn_of_residual(int frame) {
  if (warned_ || !stopped_short()) return;
  warned_ = true;
  log_warning(fmt::format(
      "frame {}: a hair mesh's solve stopped at a relative residual of {:.2g}, {:g} was asked for "
      "(more max_iterations, softer springs, or double precision)",
      frame, largest_residual(), scene_.model.hair_mesh->residual));
}

template <class T>
bool HairMeshSimulation<T>::run(const FrameRange& range, state::FrameSink& sink, const RunControl& control) {
  int frame = scene_.frames.first - scene_.frames.preroll;
  probe_ = control.probe;
  const auto hand_on = [&](double spent) {
    state::Frame out;
    timed("strands", [&] { out = frame_now(frame); });
    out.figures = figures();
    if (control_) {
      const state::Figures chosen = control_->figures();
      out.figures.insert(out.figures.end(), chosen.begin(), chosen.end());
    }
    sink.write(std::move(out), snapshot(frame), spent);
  };
  for (Part<T>& part : parts_) {
    part.roots.pose(first_time(scene_.frames), part.poses);
    part.body.start(part.poses);
  }
  if (control.resume) {
    frame = control.resume->frame;
    resume(*control.resume);
  } else if (frame >= range.first) {
    hand_on(0);
  }
  while (frame < range.last) {
    if (control.stop && *control.stop) return false;
    const Timer timer;
    trace::Span span("frame");
    ++frame;
    span.tell("frame", frame);
    step_frame(frame);
    warn_of_residual(frame);
    if (frame >= range.first) hand_on(timer.seconds());
    if (control.on_frame) control.on_frame(frame, timer.seconds(), seconds_);
    trace::flush();
  }
  sink.finish();
  return true;
}

}  // namespace

std::unique_ptr<Simulation> make_hair_mesh_simulation(const scene::Scene& scene, const Options& options) {
  if (options.backend == Backend::kCuda)
    throw Error(ErrorKind::kDevice, "--backend cuda", "the model hair_mesh steps on the CPU",
                "use --backend cpu or auto");
  if (options.precision == Precision::kDouble)
    return std::make_unique<HairMeshSimulation<double>>(scene, options);
  return std::make_unique<HairMeshSimulation<float>>(scene, options);
}

}  // namespace ringlet::pipeline
