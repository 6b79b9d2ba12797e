#include "pipeline/simulation.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/log.h"
#include "core/timer.h"
#include "core/trace.h"
#include "effects/contacts/contacts_stage.h"
#include "effects/grid/grid_stage.h"
#include "effects/grooming/grooming.h"
#include "effects/solids/contact_stage.h"
#include "effects/strands/strand_stage.h"
#include "effects/wind/wind_stage.h"
#include "pipeline/checkpoint.h"
#include "pipeline/frames.h"
#include "pipeline/hair_mesh_simulation.h"
#include "pipeline/health.h"
#include "pipeline/precision.h"
#include "pipeline/report.h"
#include "pipeline/substep_control.h"
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

// The scene as the precision can hold it.
template <class T>
const scene::Scene& fitted(scene::Scene& scene, const World& world) {
  if constexpr (sizeof(T) == sizeof(float)) {
    refuse_stiff_in_float(scene, world.stiffness);
    std::int32_t most = 0;
    const groom::Strands& strands = world.simulated.strands;
    for (std::size_t s = 0; s < strands.size(); ++s) most = std::max(most, strands.count(s));
    hold_lengths_as_float_can(scene, most);
  }
  return scene;
}

state::StrandInput strand_input(const scene::Scene& scene, const World& world) {
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
        model_(strand_input(fitted<T>(scene_, world_), world_)),
        state_(model_),
        executor_(make_executor(model_, options_)),
        before_(roots_.strands()),
        now_(roots_.strands()) {
    if (scene_.model.substep_choice) control_.emplace(scene_, mean_length(world_));
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
    if (scene_.effects.hair_hair)
      start(), tell_rest(), rest_told_ = true;  // stages take their memory at rest
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
  void step_frame(int frame);
  void take_frame(int frame, int substeps);
  void take_chosen(int frame);
  void take_substep(const effects::Substep& substep, int number);
  void move_roots(double time);
  void probe(const char* stage, int frame, int substep);
  void check(const char* stage, int frame, std::int64_t diverged);
  void check_fetched(const char* stage, int frame);
  [[noreturn]] void tell_fault(const char* stage, int frame, const Fault& fault);
  [[noreturn]] void tell_limits(const char* stage, int frame, std::int64_t strand);
  state::Snapshot snapshot(int frame);
  std::int64_t launches() const { return launches_ + executor_->launches(); }
  void hand_on(int frame, state::Frame out, double spent, state::FrameSink& sink);
  // How many substeps the frame that was stepped last had.
  int substeps() const { return control_ ? std::max(control_->substeps(), 1) : scene_.model.substeps; }
  state::Frame frame_now(int frame) const {
    return make_frame(scene_, world_, model_, state_, frame, time_of(frame),
                      1 / (scene_.frames.fps * substeps()));
  }
  double time_of(int frame, int substep = 0, int substeps = 1) const {
    return pipeline::time_of(scene_.frames, frame, substep, substeps);
  }
  Arrays kept() const { return grooming_ ? Arrays::kStateAndModel : Arrays::kState; }
  // A device's state is not looked at but when it has been fetched.
  bool on_host() const { return executor_->backend() == "cpu"; }

  // Does a part of a frame that the plan names, and counts its time there.
  template <class Work>
  void timed(const char* name, const Work& work);

  scene::Scene scene_;
  Options options_;
  World world_;
  const Roots& roots_;      // of the simulated strands
  bool rest_told_ = false;  // the stages know the rest state that the next run begins with
  state::StrandModel<T> model_;
  state::StrandState<T> state_;
  std::unique_ptr<effects::Executor<T>> executor_;
  std::vector<std::unique_ptr<effects::Stage<T>>> stages_;
  std::optional<effects::Grooming<T>> grooming_;
  std::vector<Pose> before_, now_;         // root poses at the substep's start and end
  std::optional<SubstepControl> control_;  // where the scene leaves the substeps to it
  std::function<void(const std::string&, int, int, state::Snapshot&)> probe_;
  effects::FrameReport report_;  // of the frame that is stepped, and the seconds of its stages
  StageSeconds seconds_;
  std::int64_t launches_ = 0;  // that the roots were moved by, and those of executors that are no more
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
  const SubstepControl* control = control_ ? &*control_ : nullptr;
  plan_ = frames_planned(scene_, control);
  plan_.strands = static_cast<std::int64_t>(roots_.strands());
  plan_.particles = std::accumulate(world_.living.begin(), world_.living.end(), std::int64_t{0});
  const auto add = [&](const char* name, const char* what) {
    PlannedStage planned{name, what, false, 0, {0, 0}};
    for (const auto& stage : stages_) {
      if (std::string_view(stage->name()) != name) continue;
      const auto of_frame = [&](int substeps) { return stage->launches(substeps); };
      planned = {name, what, true, stage->bytes(), launches_of_run(plan_, control, of_frame)};
    }
    plan_.stages.push_back(planned);
  };
  const auto add_host = [&](const char* name, const char* what, bool runs, std::size_t bytes) {
    plan_.stages.push_back({name, what, runs, runs ? bytes : 0, {0, 0}});  // no kernels of the device
  };
  add_host(kTries, kTriesAre, control != nullptr,
           state_.bytes() + state_.air.size() * sizeof(T) + now_.size() * sizeof(Pose) +
               SubstepControl::bytes(state_.position.size()));
  const auto of_roots = [&](int substeps) {
    return roots_.still() ? effects::Launches{0, 0} : effects::Launches{substeps, substeps};
  };
  plan_.stages.push_back({"roots", "root frames carried by the head", true,
                          (before_.size() + now_.size()) * sizeof(Pose),
                          launches_of_run(plan_, control, of_roots)});
  add("wind", "mean wind, gusts, turbulence, shelter");
  add("strands", "the strand model: forces, implicit step, lengths");
  add("grid", "hair keeps its volume: density, pressure, friction");
  add("contacts", "hair against hair: segments touch, Coulomb friction");
  add("solids", "collision with level sets, friction");
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
  ++launches_;
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
template <class Work>
void TypedSimulation<T>::timed(const char* name, const Work& work) {
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

template <class T>
void TypedSimulation<T>::step_frame(int frame) {
  seconds_.clear();
  for (const PlannedStage& stage : plan_.stages)
    if (stage.runs) seconds_.emplace_back(stage.name, 0.0);
  if (control_)
    take_chosen(frame);
  else
    take_frame(frame, scene_.model.substeps);
}

// From the same start as often as it takes. What a stage remembers from frame to frame, it has in a
// checkpoint; the roots are where they were.
template <class T>
void TypedSimulation<T>::take_chosen(int frame) {
  std::optional<state::StrandState<T>> start;
  std::vector<Pose> roots;
  state::Snapshot remembered;
  timed(kTries, [&] {
    start.emplace(state_), roots = now_;
    for (const auto& stage : stages_) stage->save(remembered);
  });
  bool again = false;
  const double living = std::accumulate(model_.count.begin(), model_.count.end(), 0.0);
  control_->step(frame, living, [&](int substeps) {
    if (again)
      timed(kTries, [&] {
        state_ = *start, now_ = roots;
        executor_->submit(state_);
        executor_->submit_roots(state_);
        for (const auto& stage : stages_) stage->restore(remembered);
      });
    again = true;
    take_frame(frame, substeps);
    executor_->fetch(state_);
    return std::vector<double>(state_.position.begin(), state_.position.end());
  });
}

template <class T>
void TypedSimulation<T>::take_frame(int frame, int substeps) {
  report_ = empty_report(roots_.strands());
  const double step = 1.0 / (scene_.frames.fps * substeps);
  for (int s = 0; s < substeps; ++s)
    take_substep({frame, time_of(frame - 1, s, substeps), time_of(frame - 1, s + 1, substeps), step, s == 0,
                  s + 1 == substeps, substeps},
                 s);
}

template <class T>
void TypedSimulation<T>::take_substep(const effects::Substep& substep, int number) {
  trace::Span span("substep");
  span.tell("frame", substep.frame), span.tell("substep", number), span.tell("time", substep.time);
  for (const auto& stage : stages_) stage->begin(*executor_, substep);
  timed("roots", [&] {
    if (!roots_.still()) move_roots(substep.time);
  });
  if (!roots_.still()) probe("roots", substep.frame, number);
  if (!roots_.still() && !finite_roots(state_)) check_fetched("roots", substep.frame);
  for (const auto& stage : stages_) {
    timed(stage->name(), [&] { stage->run(*executor_, substep, report_); });
    probe(stage->name(), substep.frame, number);
    check(stage->name(), substep.frame, stage->diverged_strand());
  }
}

template <class T>
void TypedSimulation<T>::probe(const char* stage, int frame, int substep) {
  if (!probe_) return;
  executor_->fetch(state_);
  state::Snapshot arrays = save(frame, model_, state_, Arrays::kAll);
  probe_(stage, frame, substep, arrays);
  restore(arrays, model_, state_, Arrays::kAll);
  executor_->submit(state_);
  executor_->submit_roots(state_);
}

// After a stage: a value that is not finite in any array, or a strand that the stage found diverged.
template <class T>
void TypedSimulation<T>::check(const char* stage, int frame, std::int64_t diverged) {
  if (diverged < 0 && (!on_host() || finite(state_))) return;
  executor_->fetch(state_);
  check_fetched(stage, frame);
  if (diverged >= 0) tell_limits(stage, frame, diverged);
}

template <class T>
void TypedSimulation<T>::check_fetched(const char* stage, int frame) {
  if (const auto fault = find_fault(model_, state_)) tell_fault(stage, frame, *fault);
}

template <class T>
void TypedSimulation<T>::tell_fault(const char* stage, int frame, const Fault& fault) {
  const std::int64_t told = strand_in_cache(world_, fault.strand);
  throw Diverged(frame_now(frame), stage, told, fault.particle,
                 fmt::format("the simulation diverged in stage `{}`, strand {}, particle {}: a value is not "
                             "finite, of `{}`",
                             stage, told, fault.particle, fault.array));
}

// The particle: the fastest.
template <class T>
void TypedSimulation<T>::tell_limits(const char* stage, int frame, std::int64_t strand) {
  const state::StrandLayout& layout = model_.layout;
  std::int64_t particle = 0;
  double fastest = -1;
  for (int i = 0; i < layout.count(strand); ++i) {
    double speed2 = 0;
    for (int c = 0; c < 3; ++c) {
      const double v = state_.velocity[layout.at(strand, i, 3, c)];
      speed2 += v * v;
    }
    if (speed2 > fastest) fastest = speed2, particle = i;
  }
  const std::int64_t told = strand_in_cache(world_, strand);
  throw Diverged(
      frame_now(frame), stage, told, particle,
      fmt::format("the simulation diverged in stage `{}`, strand {}, particle {}: beyond the limits on "
                  "edge strain ({}) or speed ({} m/s); fastest particle {:.3g} m/s",
                  stage, told, particle, scene_.limits.edge_strain, scene_.limits.speed, std::sqrt(fastest)));
}

template <class T>
state::Snapshot TypedSimulation<T>::snapshot(int frame) {
  state::Snapshot snapshot = save(frame, model_, state_, kept());
  for (const auto& stage : stages_) stage->save(snapshot);
  if (control_) control_->save(snapshot);
  return snapshot;
}

template <class T>
void TypedSimulation<T>::resume(const state::Snapshot& snapshot) {
  restore(snapshot, model_, state_, kept());
  if (!std::all_of(state_.touches.begin(), state_.touches.end(), [](T a) { return std::isfinite(a); }))
    throw Error(ErrorKind::kInput, "state", "`touches` holds what is no number", "run without --resume");
  if (control_) control_->restore(snapshot);
  roots_.pose(time_of(snapshot.frame), now_);
  for (std::size_t s = 0; s < now_.size(); ++s) set_root_motion(state_, model_.layout, s, now_[s], now_[s]);
  if (grooming_) renew_executor();
  tell_rest();
  for (const auto& stage : stages_) stage->restore(snapshot);
  executor_->submit(state_);
  check_fetched("resume", snapshot.frame);
}

// The strands have changed under the executor. The old one goes first: a device need not hold both.
template <class T>
void TypedSimulation<T>::renew_executor() {
  launches_ += executor_->launches();
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
  check_fetched("grooming", frame);
}

template <class T>
void TypedSimulation<T>::hand_on(int frame, state::Frame out, double spent, state::FrameSink& sink) {
  const trace::Span span("hand on");
  state::Figures solver = figures_of(report_, plan_.strands * substeps(), scene_.effects.hair_hair);
  if (control_) {
    const state::Figures chosen = control_->figures();
    solver.insert(solver.end(), chosen.begin(), chosen.end());
  }
  out.figures.insert(out.figures.begin(), solver.begin(), solver.end());
  sink.write(std::move(out), snapshot(frame), spent);
}

template <class T>
bool TypedSimulation<T>::run(const FrameRange& range, state::FrameSink& sink, const RunControl& control) {
  int frame = scene_.frames.first - scene_.frames.preroll;
  report_ = empty_report(roots_.strands());
  probe_ = control.probe;
  start();
  const bool rest_told = std::exchange(rest_told_, false);
  if (control.resume) {
    frame = control.resume->frame;
    resume(*control.resume);
  } else {
    if (!rest_told) tell_rest();
    groom(frame);
    if (frame >= range.first) hand_on(frame, frame_now(frame), 0, sink);
  }
  if (roots_.still()) move_roots(first_time(scene_.frames));  // once: nothing turns, nothing moves
  bool swept = false;
  while (frame < range.last) {
    if (control.stop && *control.stop) return false;
    const Timer timer;
    trace::Span span("frame");
    ++frame;
    span.tell("frame", frame);
    step_frame(frame);
    executor_->fetch(state_);
    if (!on_host() && !finite(state_)) check_fetched("fetch", frame);
    if (grooming_) timed("grooming", [&] { groom(frame); });
    state::Frame out;
    if (frame >= range.first) {
      if (world_.interpolated)
        timed("interpolation", [&] { out = frame_now(frame); });
      else
        out = frame_now(frame);
    }
    const double spent = timer.seconds();
    span.tell("substeps", substeps());
    if (report_.swept > 0 && !swept)
      log_info(fmt::format(
          "frame {}: particles move farther in a substep than the level set's band is wide; their "
          "way is searched for solids (more substeps would resolve it better)",
          frame));
    swept = swept || report_.swept > 0;
    if (frame >= range.first) hand_on(frame, std::move(out), spent, sink);
    if (control.on_frame) control.on_frame(frame, spent, seconds_);
    trace::flush();
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
