#include "pipeline/simulation.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/log.h"
#include "core/timer.h"
#include "effects/contacts/contacts_stage.h"
#include "effects/grid/grid_stage.h"
#include "effects/grooming/grooming.h"
#include "effects/solids/contact_stage.h"
#include "effects/strands/strand_stage.h"
#include "effects/wind/wind_stage.h"
#include "pipeline/checkpoint.h"
#include "pipeline/frames.h"
#include "pipeline/hair_mesh_simulation.h"
#include "pipeline/precision.h"
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

// The radius of the hair at each particle [m], where contacts or the shelter of hair ask for it. Throws
// Error{kInput} where all hair is without width.
std::vector<float> radii(const scene::Scene& scene, const groom::Strands& strands) {
  const auto& hair_hair = scene.effects.hair_hair;
  if (!hair_hair || !(hair_hair->contacts || hair_hair->grid->shelter)) return {};
  if (hair_hair->contacts && hair_hair->contacts->radius)
    return std::vector<float>(strands.points.size(), static_cast<float>(*hair_hair->contacts->radius));
  std::vector<float> radii;
  for (const float width : strands.widths) radii.push_back(0.5f * width);
  if (*std::max_element(radii.begin(), radii.end()) > 0) return radii;
  throw Error(ErrorKind::kInput, "/effects/hair_hair",
              "the grooms' files give all hair the width 0, expected hair of some width",
              hair_hair->contacts ? "give contacts a radius, or the files widths"
                                  : "give the files widths, or leave out the shelter");
}

template <class T>
state::StrandInput strand_input(const scene::Scene& scene, const World& world) {
  if constexpr (sizeof(T) == sizeof(float)) refuse_stiff_in_float(scene, world.stiffness);
  state::StrandInput input;
  const groom::Strands& strands = world.simulated.strands;
  for (std::size_t s = 0; s < strands.size(); ++s) input.counts.push_back(strands.count(s));
  input.living = world.living;
  input.rest = strands.points;
  input.stiffness = world.stiffness;
  input.radius = radii(scene, strands);
  input.elongation = scene.effects.non_hookean.has_value();
  input.companions = scene.model.type == scene::ModelType::kMassSpring;
  if (scene.model.preload && scene.effects.gravity) {
    std::vector<Pose> poses(strands.size());
    world.simulated.roots->pose(first_time(scene.frames), poses);
    for (const Pose& pose : poses) input.first_rotation.push_back(pose.rotation);
    input.preload = scene.effects.gravity;
  }
  return input;
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
        options_(options),
        world_(build_world(scene_)),
        roots_(*world_.simulated.roots),
        model_(strand_input<T>(scene_, world_)),
        state_(model_),
        executor_(make_executor(model_, options_)),
        before_(roots_.strands()),
        now_(roots_.strands()) {
    if (scene_.effects.wind)
      stages_.push_back(
          effects::make_wind_stage<T>(scene_, world_.head.get(), roots_.centre(), model_, state_));
    stages_.push_back(effects::make_strand_stage<T>(scene_, model_, state_));
    if (scene_.effects.hair_hair) add_hair_stages(*scene_.effects.hair_hair);
    if (!world_.solids.empty())
      stages_.push_back(effects::make_contact_stage<T>(scene_, world_.solids, world_.skin, model_, state_));
    if (!scene_.effects.grooming.empty())
      grooming_.emplace(scene_, world_.simulated.groom_of_strand, model_, state_);
    if (grooming_ && scene_.frames.preroll == 0) rehearse_first_frame();
    if (scene_.effects.hair_hair) start(), tell_rest();  // stages take their memory at rest
    make_plan();
  }

  const Plan& plan() const override { return plan_; }
  state::RunHeader header(const FrameRange& range) const override;
  bool run(const FrameRange& range, state::FrameSink& sink, const RunControl& control) override;

 private:
  void add_hair_stages(const scene::HairHair& hair_hair);
  void make_plan();
  void start();
  void tell_rest();
  void rehearse_first_frame();
  void resume(const state::Snapshot& snapshot);
  void groom(int frame);
  void renew_executor();
  void step_frame(int frame, effects::FrameReport& report, StageSeconds& seconds);
  void move_roots(double time);
  void check(const effects::Stage<T>& stage, int frame);
  state::Frame frame_now(int frame) const {
    return make_frame(scene_, world_, model_, state_, frame, time_of(frame, 0));
  }

  double time_of(int frame, int substep) const { return pipeline::time_of(scene_, frame, substep); }

  scene::Scene scene_;
  Options options_;
  World world_;
  const Roots& roots_;  // of the simulated strands
  state::StrandModel<T> model_;
  state::StrandState<T> state_;
  std::unique_ptr<effects::Executor<T>> executor_;
  std::vector<std::unique_ptr<effects::Stage<T>>> stages_;
  std::optional<effects::Grooming<T>> grooming_;
  std::vector<Pose> before_, now_;  // root poses at the substep's start and end
  Plan plan_;
};

template <class T>
void TypedSimulation<T>::add_hair_stages(const scene::HairHair& hair_hair) {
  if (hair_hair.grid)
    stages_.push_back(effects::make_grid_stage<T>(scene_, world_.solids, model_, state_, *executor_));
  if (hair_hair.contacts)
    stages_.push_back(effects::make_contacts_stage<T>(scene_, model_, state_, *executor_));
}

template <class T>
void TypedSimulation<T>::make_plan() {
  plan_.strands = static_cast<std::int64_t>(roots_.strands());
  plan_.particles = std::accumulate(world_.living.begin(), world_.living.end(), std::int64_t{0});
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
                          (before_.size() + now_.size()) * sizeof(Pose), roots_.still() ? 0 : substeps});
  add("wind", "mean wind, gusts, turbulence, shelter");
  add("strands", "the strand model: forces, implicit step, lengths");
  add("grid", "hair keeps its volume: density, pressure, friction");
  add("contacts", "hair against hair: segments touch, Coulomb friction");
  add("solids", "collision with level sets, friction");
  const auto add_host = [&](const char* name, const char* what, bool runs, std::size_t bytes) {
    plan_.stages.push_back({name, what, runs, runs ? bytes : 0, 0});  // no kernels of the device
  };
  add_host("grooming", "trim, lengthen, comb, rest at their frames", grooming_.has_value(),
           grooming_ ? grooming_->bytes() : 0);
  add_host("interpolation", "strands that follow guides, once a frame", world_.interpolated != nullptr,
           world_.interpolated ? world_.interpolation().bytes() : 0);
}

template <class T>
state::RunHeader TypedSimulation<T>::header(const FrameRange& range) const {
  state::RunHeader header = make_header(scene_, world_);
  header.program_version = RINGLET_VERSION;
  header.backend = executor_->backend();
  header.instruction_set = executor_->instruction_set();
  header.precision = sizeof(T) == 8 ? "double" : "float";
  header.first_frame = range.first, header.last_frame = range.last;
  return header;
}

template <class T>
void TypedSimulation<T>::move_roots(double time) {
  before_.swap(now_);
  roots_.pose(time, now_);
  tbb::parallel_for(std::size_t{0}, now_.size(), [&](std::size_t strand) {
    state::set_root_motion(state_, model_.layout, strand, before_[strand], now_[strand]);
  });
  executor_->submit_roots(state_);
}

template <class T>
void TypedSimulation<T>::start() {
  roots_.pose(first_time(scene_.frames), now_);
  state::pose_at_rest<T>(state_, model_, now_);
  executor_->submit(state_);
}

// Shows the stages of hair against hair the strands as they are made to be. The executor then holds that
// state.
template <class T>
void TypedSimulation<T>::tell_rest() {
  if (!scene_.effects.hair_hair) return;
  std::vector<Pose> first(roots_.strands());
  roots_.pose(first_time(scene_.frames), first);
  state::StrandState<T> rest = state_;
  state::pose_at_rest<T>(rest, model_, first);
  for (std::size_t s = 0; s < first.size(); ++s) set_root_motion(rest, model_.layout, s, first[s], first[s]);
  executor_->submit(rest);
  executor_->submit_roots(rest);
  for (const auto& stage : stages_) stage->at_rest(*executor_, rest);
}

// What the first frame's grooming cannot do is bad input, told before a cache is written or replaced.
template <class T>
void TypedSimulation<T>::rehearse_first_frame() {
  start();
  const state::StrandModel<T> model = model_;
  grooming_->apply(scene_.frames.first, now_);
  model_ = model;  // the run poses its state anew
}

template <class T>
void TypedSimulation<T>::step_frame(int frame, effects::FrameReport& report, StageSeconds& seconds) {
  const int substeps = scene_.model.substeps;
  const bool still = roots_.still();
  const double step = 1.0 / (scene_.frames.fps * substeps);
  seconds.assign(1, {"roots", 0.0});
  for (const auto& stage : stages_) seconds.emplace_back(stage->name(), 0.0);
  if (grooming_) seconds.emplace_back("grooming", 0.0);
  if (world_.interpolated) seconds.emplace_back("interpolation", 0.0);
  for (int s = 0; s < substeps; ++s) {
    const effects::Substep substep{frame,  time_of(frame - 1, s), time_of(frame - 1, s + 1), step,
                                   s == 0, s + 1 == substeps};
    for (const auto& stage : stages_) stage->begin(*executor_, substep);
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
  const std::int64_t told = strand_in_cache(world_, strand);
  throw Diverged(frame_now(frame), stage.name(), told, particle,
                 fmt::format("the simulation diverged in stage `{}`, strand {}, particle {}: {}",
                             stage.name(), told, particle, how));
}

template <class T>
void TypedSimulation<T>::resume(const state::Snapshot& snapshot) {
  restore(snapshot, model_, state_, grooming_.has_value());
  roots_.pose(time_of(snapshot.frame, 0), now_);
  for (std::size_t s = 0; s < now_.size(); ++s) set_root_motion(state_, model_.layout, s, now_[s], now_[s]);
  if (grooming_) renew_executor();
  tell_rest();
  for (const auto& stage : stages_) stage->restore(snapshot);
  executor_->submit(state_);
}

// The strands have changed under the executor. The old one goes first: a device need not hold both.
template <class T>
void TypedSimulation<T>::renew_executor() {
  executor_.reset();
  executor_ = make_executor(model_, options_);
}

template <class T>
void TypedSimulation<T>::groom(int frame) {
  if (!grooming_ || !grooming_->apply(frame, now_)) return;
  renew_executor();
  tell_rest();
  executor_->submit(state_);
  executor_->submit_roots(state_);
}

template <class T>
bool TypedSimulation<T>::run(const FrameRange& range, state::FrameSink& sink, const RunControl& control) {
  int frame = scene_.frames.first - scene_.frames.preroll;
  effects::FrameReport report = empty_report(roots_.strands());
  StageSeconds seconds;
  const std::int64_t strand_steps = plan_.strands * plan_.substeps;
  const auto hand_on = [&](state::Frame out, double spent) {
    const state::Figures solver = figures_of(report, strand_steps, scene_.effects.hair_hair);
    out.figures.insert(out.figures.begin(), solver.begin(), solver.end());
    state::Snapshot snapshot = save(frame, model_, state_, grooming_.has_value());
    for (const auto& stage : stages_) stage->save(snapshot);
    sink.write(std::move(out), std::move(snapshot), spent);
  };
  // Counted where the plan has such a stage.
  const auto timed = [&](const char* name, const auto& work) {
    const Timer timer;
    work();
    for (auto& [stage, spent] : seconds)
      if (stage == name) spent += timer.seconds();
  };
  start();
  if (control.resume) {
    frame = control.resume->frame;
    resume(*control.resume);
  } else {
    tell_rest();
    groom(frame);
    if (frame >= range.first) hand_on(frame_now(frame), 0);
  }
  if (roots_.still()) move_roots(first_time(scene_.frames));  // once: nothing turns, nothing moves
  bool swept = false;
  while (frame < range.last) {
    if (control.stop && *control.stop) return false;
    const Timer timer;
    ++frame;
    report = empty_report(roots_.strands());
    step_frame(frame, report, seconds);
    executor_->fetch(state_);
    timed("grooming", [&] { groom(frame); });
    state::Frame out;
    if (frame >= range.first) timed("interpolation", [&] { out = frame_now(frame); });
    const double spent = timer.seconds();
    if (report.swept > 0 && !swept)
      log_info(fmt::format(
          "frame {}: particles move farther in a substep than the level set's band is wide; their "
          "way is searched for solids (more substeps would resolve it better)",
          frame));
    swept = swept || report.swept > 0;
    if (frame >= range.first) hand_on(std::move(out), spent);
    if (control.on_frame) control.on_frame(frame, spent, seconds);
  }
  sink.finish();
  return true;
}

}  // namespace

std::unique_ptr<Simulation> Simulation::create(const scene::Scene& scene, const Options& options) {
  if (scene.model.type == scene::ModelType::kHairMesh) return make_hair_mesh_simulation(scene, options);
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
