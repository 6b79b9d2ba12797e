#include "pipeline/simulation.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/log.h"
#include "core/timer.h"
#include "effects/solids/contact_stage.h"
#include "effects/strands/strand_stage.h"
#include "effects/wind/wind_stage.h"
#include "pipeline/report.h"
#include "pipeline/world.h"

namespace ringlet::pipeline {

Diverged::Diverged(state::Frame frame_, std::string stage_, std::int64_t strand_, std::int64_t particle_,
                   std::string what)
    : Error(ErrorKind::kDiverged, fmt::format("frame {}", frame_.number), std::move(what),
            "more substeps, softer springs, or wider limits if the motion is meant"),
      frame(std::move(frame_)),
      stage(std::move(stage_)),
      strand(strand_),
      particle(particle_) {}

namespace {

template <class T>
state::StrandInput strand_input(const scene::Scene& scene, const World& world) {
  state::StrandInput input;
  for (std::size_t s = 0; s < world.strands.size(); ++s) input.counts.push_back(world.strands.count(s));
  input.rest = world.strands.points;
  input.stiffness = world.stiffness;
  input.elongation = scene.effects.non_hookean.has_value();
  input.companions = scene.model.type == scene::ModelType::kMassSpring;
  if (scene.model.preload && scene.effects.gravity) {
    std::vector<Pose> poses(world.strands.size());
    world.roots->pose(first_time(scene.frames), poses);
    for (const Pose& pose : poses) input.first_rotation.push_back(pose.rotation);
    input.preload = scene.effects.gravity;
  }
  return input;
}

std::vector<std::byte> bytes_of(const void* data, std::size_t size) {
  std::vector<std::byte> bytes(size);
  std::memcpy(bytes.data(), data, size);
  return bytes;
}

template <class Vector>
void restore(const state::Snapshot& snapshot, const std::string& name, Vector& out) {
  const auto found = snapshot.arrays.find(name);
  const std::size_t size = out.size() * sizeof(out[0]);
  if (found == snapshot.arrays.end() || found->second.size() != size)
    throw Error(ErrorKind::kInput, "state", fmt::format("`{}` is missing or of another size", name),
                "run without --resume");
  std::memcpy(out.data(), found->second.data(), size);
}

const char* axis_name(scene::Axis axis) {
  return axis == scene::Axis::kX ? "x" : axis == scene::Axis::kY ? "y" : "z";
}

// Left to itself the program steps in float on the GPU where there is one, unless an instruction set of the
// CPU was asked for. Throws Error{kDevice} for a GPU that is asked for and not there.
Backend choose_backend(const Options& options) {
  const bool cpu_only = options.precision == Precision::kDouble || !options.instruction_set.empty();
  if (options.backend == Backend::kCpu || (options.backend == Backend::kAuto && cpu_only))
    return Backend::kCpu;
  try {
    log_info(fmt::format("steps on {}", effects::cuda_device_name()));
    return Backend::kCuda;
  } catch (const Error& error) {
    if (options.backend == Backend::kCuda) throw;
    log_debug(fmt::format("steps on the CPU: {}", error.what()));
    return Backend::kCpu;
  }
}

std::unique_ptr<effects::Executor<float>> make_executor(const state::StrandModel<float>& model,
                                                        const Options& options) {
  if (options.backend == Backend::kCuda) return effects::make_cuda_executor(model);
  return effects::make_cpu_executor(model, options.instruction_set);
}

std::unique_ptr<effects::Executor<double>> make_executor(const state::StrandModel<double>& model,
                                                         const Options& options) {
  return effects::make_cpu_executor(model, options.instruction_set);
}

template <class T>
class TypedSimulation : public Simulation {
 public:
  TypedSimulation(const scene::Scene& scene, const Options& options)
      : scene_(scene),
        world_(build_world(scene_)),
        model_(strand_input<T>(scene_, world_)),
        state_(model_),
        executor_(make_executor(model_, options)),
        before_(world_.strands.size()),
        now_(world_.strands.size()) {
    if (scene_.effects.wind)
      stages_.push_back(
          effects::make_wind_stage<T>(scene_, world_.head.get(), world_.roots->centre(), model_, state_));
    stages_.push_back(effects::make_strand_stage<T>(scene_, model_, state_));
    if (!world_.solids.empty())
      stages_.push_back(effects::make_contact_stage<T>(scene_, world_.solids, world_.skin, model_, state_));
    make_plan();
  }

  const Plan& plan() const override { return plan_; }
  state::RunHeader header(const FrameRange& range) const override;
  bool run(const FrameRange& range, state::FrameSink& sink, const RunControl& control) override;

 private:
  void make_plan();
  void start();
  void step_frame(int frame, effects::FrameReport& report, StageSeconds& seconds);
  void move_roots(double time);
  void check(const effects::Stage<T>& stage, int frame);
  state::Frame frame_now(int frame) const;
  state::Snapshot snapshot(int frame) const;

  // Substep boundaries are quotients of integers: the same bits however a run got there.
  double time_of(int frame, int substep) const {
    const double n = static_cast<double>(frame - scene_.frames.first) * scene_.model.substeps + substep;
    return n / (scene_.frames.fps * scene_.model.substeps);
  }

  scene::Scene scene_;
  World world_;
  state::StrandModel<T> model_;
  state::StrandState<T> state_;
  std::unique_ptr<effects::Executor<T>> executor_;
  std::vector<std::unique_ptr<effects::Stage<T>>> stages_;
  std::vector<Pose> before_, now_;  // root poses at the substep's start and end
  Plan plan_;
};

template <class T>
void TypedSimulation<T>::make_plan() {
  plan_.strands = static_cast<std::int64_t>(world_.strands.size());
  plan_.particles = world_.strands.particles();
  plan_.substeps = scene_.model.substeps;
  plan_.frames = scene_.frames.last - scene_.frames.first + scene_.frames.preroll;
  const std::int64_t substeps = static_cast<std::int64_t>(plan_.frames) * plan_.substeps;
  const auto add = [&](const char* name, const char* what) {
    PlannedStage planned{name, what, false, 0, 0};
    for (const auto& stage : stages_) {
      if (stage->name() != name) continue;
      planned = {name, what, true, stage->bytes(), plan_.frames * stage->launches()};
    }
    plan_.stages.push_back(planned);
  };
  plan_.stages.push_back({"roots", "root frames carried by the head", true,
                          (before_.size() + now_.size()) * sizeof(Pose),
                          world_.roots->still() ? 0 : substeps});
  add("wind", "mean wind, gusts, turbulence, shelter");
  add("strands", "springs, ghosts, implicit step, lengths");
  add("solids", "collision with level sets, friction");
}

template <class T>
state::RunHeader TypedSimulation<T>::header(const FrameRange& range) const {
  const double unit = scene_.units.metres_per_unit;
  state::RunHeader header;
  header.name = scene_.name;
  header.scene_json = scene_.resolved;
  header.scene_hash = scene_.hash;
  header.program_version = RINGLET_VERSION;
  header.backend = executor_->backend();
  header.instruction_set = executor_->instruction_set();
  header.precision = sizeof(T) == 8 ? "double" : "float";
  header.metres_per_unit = unit;
  header.length_unit = unit == 1       ? "m"
                       : unit == 0.01  ? "cm"
                       : unit == 0.001 ? "mm"
                                       : fmt::format("{} m", unit);
  header.up = axis_name(scene_.units.up);
  header.fps = scene_.frames.fps;
  header.first_frame = range.first, header.last_frame = range.last;
  header.offsets = world_.strands.offsets;
  for (const groom::RootSite& site : world_.sites) {
    header.root_triangle.push_back(site.triangle);
    for (int c = 0; c < 3; ++c) header.root_barycentric.push_back(static_cast<float>(site.barycentric[c]));
  }
  for (const Vec3& p : world_.strands.points)
    for (int c = 0; c < 3; ++c) header.rest_position.push_back(static_cast<float>(p[c] / unit));
  for (const float width : world_.strands.widths) header.width.push_back(static_cast<float>(width / unit));
  header.groom_of_strand = world_.groom_of_strand;
  for (const scene::Groom& groom : scene_.grooms) header.groom_names.push_back(groom.name);
  const auto& fields = scene_.cache.fields;
  if (std::find(fields.begin(), fields.end(), "solids") == fields.end()) return header;
  for (std::size_t k = 0; k < world_.shown.size(); ++k) {
    state::Surface surface{world_.shown_names[k], {}};
    for (const Triangle& t : world_.shown[k]->triangles())
      surface.triangles.insert(surface.triangles.end(), t.begin(), t.end());
    header.surfaces.push_back(std::move(surface));
  }
  return header;
}

template <class T>
void TypedSimulation<T>::move_roots(double time) {
  before_.swap(now_);
  world_.roots->pose(time, now_);
  tbb::parallel_for(std::size_t{0}, now_.size(), [&](std::size_t strand) {
    state::set_root_motion(state_, model_.layout, strand, before_[strand], now_[strand]);
  });
  executor_->submit_roots(state_);
}

template <class T>
void TypedSimulation<T>::start() {
  world_.roots->pose(first_time(scene_.frames), now_);
  state::pose_at_rest<T>(state_, model_, now_);
  executor_->submit(state_);
}

template <class T>
void TypedSimulation<T>::step_frame(int frame, effects::FrameReport& report, StageSeconds& seconds) {
  const int substeps = scene_.model.substeps;
  const bool still = world_.roots->still();
  const double step = 1.0 / (scene_.frames.fps * substeps);
  seconds.assign(1, {"roots", 0.0});
  for (const auto& stage : stages_) seconds.emplace_back(stage->name(), 0.0);
  for (int s = 0; s < substeps; ++s) {
    const effects::Substep substep{frame,  time_of(frame - 1, s), time_of(frame - 1, s + 1), step,
                                   s == 0, s + 1 == substeps};
    Timer timer;
    if (!still) move_roots(substep.time);
    seconds[0].second += timer.seconds();
    for (std::size_t k = 0; k < stages_.size(); ++k) {
      const Timer stage_timer;
      stages_[k]->run(*executor_, substep, report);
      seconds[k + 1].second += stage_timer.seconds();
      check(*stages_[k], frame);
    }
  }
}

template <class T>
void TypedSimulation<T>::check(const effects::Stage<T>& stage, int frame) {
  const std::int64_t strand = stage.diverged_strand();
  if (strand < 0) return;
  executor_->fetch(state_);
  // The particle: the first that is not finite, else the fastest.
  const state::StrandLayout& layout = model_.layout;
  std::int64_t particle = 0;
  double fastest = -1;
  bool finite = true;
  for (int i = 0; i < layout.count(strand) && finite; ++i) {
    double speed2 = 0;
    for (int c = 0; c < 3; ++c) {
      const double v = state_.velocity[layout.at(strand, i, 3, c)];
      finite = finite && std::isfinite(v) && std::isfinite(state_.position[layout.at(strand, i, 3, c)]);
      speed2 += v * v;
    }
    if (!finite || speed2 > fastest) fastest = speed2, particle = i;
  }
  const std::string how =
      finite ? fmt::format(
                   "beyond the limits on edge strain ({}) or speed ({} m/s); fastest particle "
                   "{:.3g} m/s",
                   scene_.limits.edge_strain, scene_.limits.speed, std::sqrt(fastest))
             : std::string("a value is not finite");
  throw Diverged(frame_now(frame), stage.name(), strand, particle,
                 fmt::format("the simulation diverged in stage `{}`, strand {}, particle {}: {}",
                             stage.name(), strand, particle, how));
}

template <class T>
state::Frame TypedSimulation<T>::frame_now(int number) const {
  const double unit = scene_.units.metres_per_unit;
  const state::StrandLayout& layout = model_.layout;
  const auto& fields = scene_.cache.fields;
  const auto asked = [&](const char* field) {
    return std::find(fields.begin(), fields.end(), field) != fields.end();
  };
  state::Frame frame;
  frame.number = number;
  frame.time = time_of(number, 0);
  frame.position.resize(world_.strands.points.size() * 3);
  if (asked("velocity")) frame.velocity.resize(frame.position.size());
  if (asked("elongation")) frame.elongation.resize(world_.strands.points.size());
  tbb::parallel_for(std::size_t{0}, layout.strands(), [&](std::size_t s) {
    for (int i = 0; i < layout.count(s); ++i) {
      for (int c = 0; c < 3; ++c) {
        const std::size_t out = 3 * (world_.strands.offsets[s] + i) + c, in = layout.at(s, i, 3, c);
        const double x =
            state_.root_points[layout.at_strand(s, 3, c)] + static_cast<double>(state_.position[in]);
        frame.position[out] = static_cast<float>(x / unit);
        if (!frame.velocity.empty()) frame.velocity[out] = static_cast<float>(state_.velocity[in] / unit);
      }
      if (!frame.elongation.empty())
        frame.elongation[world_.strands.offsets[s] + i] =
            static_cast<float>(state_.elongation[layout.at(s, i, 1, 0)]);
    }
  });
  if (!asked("solids")) return frame;
  for (const solids::AnimatedMesh* mesh : world_.shown) {
    std::vector<Vec3> vertices(mesh->vertex_count());
    mesh->sample(frame.time, vertices);
    std::vector<float>& out = frame.surface_vertices.emplace_back();
    for (const Vec3& v : vertices)
      for (int c = 0; c < 3; ++c) out.push_back(static_cast<float>(v[c] / unit));
  }
  return frame;
}

template <class T>
state::Snapshot TypedSimulation<T>::snapshot(int frame) const {
  state::Snapshot snapshot;
  snapshot.frame = frame;
  snapshot.arrays["position"] = bytes_of(state_.position.data(), state_.position.size() * sizeof(T));
  snapshot.arrays["velocity"] = bytes_of(state_.velocity.data(), state_.velocity.size() * sizeof(T));
  const auto save_if_there = [&](const char* name, const state::AlignedVector<T>& array) {
    if (!array.empty()) snapshot.arrays[name] = bytes_of(array.data(), array.size() * sizeof(T));
  };
  save_if_there("elongation", state_.elongation);
  save_if_there("companion_position", state_.companion_position);
  save_if_there("companion_velocity", state_.companion_velocity);
  return snapshot;
}

template <class T>
bool TypedSimulation<T>::run(const FrameRange& range, state::FrameSink& sink, const RunControl& control) {
  start();
  int frame = scene_.frames.first - scene_.frames.preroll;
  effects::FrameReport report = empty_report(world_.strands.size());
  StageSeconds seconds;
  const std::int64_t strand_steps = plan_.strands * plan_.substeps;
  const auto hand_on = [&](double spent) {
    state::Frame out = frame_now(frame);
    out.figures = figures_of(report, strand_steps);
    sink.write(std::move(out), snapshot(frame), spent);
  };
  if (control.resume) {
    frame = control.resume->frame;
    restore(*control.resume, "position", state_.position);
    restore(*control.resume, "velocity", state_.velocity);
    const auto restore_if_there = [&](const char* name, state::AlignedVector<T>& array) {
      if (!array.empty()) restore(*control.resume, name, array);
    };
    restore_if_there("elongation", state_.elongation);
    restore_if_there("companion_position", state_.companion_position);
    restore_if_there("companion_velocity", state_.companion_velocity);
    world_.roots->pose(time_of(frame, 0), now_);
    for (std::size_t s = 0; s < now_.size(); ++s) set_root_motion(state_, model_.layout, s, now_[s], now_[s]);
    executor_->submit(state_);
  } else if (frame >= range.first) {
    hand_on(0);
  }
  if (world_.roots->still()) move_roots(first_time(scene_.frames));  // once: nothing turns, nothing moves
  bool swept = false;
  while (frame < range.last) {
    if (control.stop && *control.stop) return false;
    const Timer timer;
    ++frame;
    report = empty_report(world_.strands.size());
    step_frame(frame, report, seconds);
    executor_->fetch(state_);
    const double spent = timer.seconds();
    if (report.swept > 0 && !swept)
      log_info(fmt::format(
          "frame {}: particles move farther in a substep than the level set's band is wide; their "
          "way is searched for solids (more substeps would resolve it better)",
          frame));
    swept = swept || report.swept > 0;
    if (frame >= range.first) hand_on(spent);
    if (control.on_frame) control.on_frame(frame, spent, seconds);
  }
  sink.finish();
  return true;
}

}  // namespace

std::unique_ptr<Simulation> Simulation::create(const scene::Scene& scene, const Options& options) {
  if (options.precision == Precision::kDouble && options.backend == Backend::kCuda)
    throw Error(ErrorKind::kUsage, "--precision", "the CUDA backend steps in single precision only",
                "use --backend cpu for double");
  Options chosen = options;
  chosen.backend = choose_backend(options);
  if (options.precision == Precision::kDouble)
    return std::make_unique<TypedSimulation<double>>(scene, chosen);
  return std::make_unique<TypedSimulation<float>>(scene, chosen);
}

}  // namespace ringlet::pipeline
