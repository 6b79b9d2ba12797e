#include "effects/contacts/contacts_stage.h"

#include <algorithm>

#include "effects/host_threads.h"
#include "effects/lengths.h"
#include "kernels/launch/contacts.h"

namespace ringlet::effects {
namespace {

// The kernels' memory.
template <class T>
class Contacts {
 public:
  explicit Contacts(kernels::InstructionSet set)
      : table_(kernels::cpu_hair_contacts<T>(set)), memory_(table_.make(host_threads())) {}
  ~Contacts() { table_.destroy(memory_); }
  Contacts(const Contacts&) = delete;
  Contacts& operator=(const Contacts&) = delete;

  kernels::HairContactFigures begin(const kernels::HairContactStep<T>& step) {
    return table_.begin(memory_, step);
  }
  void pass(const kernels::HairContactStep<T>& step, kernels::HairContactFigures& figures) {
    table_.pass(memory_, step, figures);
  }
  std::size_t bytes() const { return table_.bytes(memory_); }

 private:
  const kernels::HairContactTable<T>& table_;
  kernels::HairContactMemory* memory_;
};

template <class T>
class ContactsStage : public Stage<T> {
 public:
  ContactsStage(const scene::Scene& scene, const state::StrandModel<T>& model, state::StrandState<T>& state,
                const Executor<T>& executor)
      : scene_(scene),
        options_(*scene.effects.hair_hair->contacts),
        model_(model),
        state_(state),
        contacts_(kernels::instruction_set_named(executor.instruction_set().c_str())),
        start_(state.position.size()),
        start_root_points_(state.root_points.size()),
        lengths_(scene, model, state) {}

  std::string name() const override { return "contacts"; }
  std::size_t bytes() const override {
    return contacts_.bytes() + lengths_.bytes() + start_.size() * sizeof(T) +
           start_root_points_.size() * sizeof(double);
  }
  // Of the device, which only holds the lengths.
  std::int64_t launches() const override {
    if (!scene_.effects.inextensible) return 0;
    return static_cast<std::int64_t>(options_.passes) * (each_substep() ? scene_.model.substeps : 1);
  }
  std::int64_t diverged_strand() const override { return lengths_.diverged_strand(); }

  // Takes the memory that hair at rest asks for.
  void at_rest(Executor<T>&, const state::StrandState<T>& rest) override {
    start_ = rest.position, start_root_points_ = rest.root_points;
    kernels::HairContactStep<T> step = contact_step();
    step.state = {start_.data(), start_.data()};  // not changed, and velocities do not matter
    step.root_points = start_root_points_.data();
    contacts_.begin(step);
  }

  // Contacts are found over all the way since here: since the frame began, or the substep.
  void begin(Executor<T>& executor, const Substep& substep) override {
    if (!substep.first_of_frame && !each_substep()) return;
    if (!substep.first_of_frame) executor.fetch(state_);  // at the frame's start the host has the state
    std::copy(state_.position.begin(), state_.position.end(), start_.begin());
    std::copy(state_.root_points.begin(), state_.root_points.end(), start_root_points_.begin());
  }

  void run(Executor<T>& executor, const Substep& substep, FrameReport& report) override {
    if (!substep.last_of_frame && !each_substep()) return;
    executor.fetch(state_);
    const kernels::HairContactStep<T> step = contact_step();
    kernels::HairContactFigures found = contacts_.begin(step);
    report.contact_pairs += static_cast<double>(found.pairs);
    const double seconds = substep.step * (each_substep() ? 1 : scene_.model.substeps);
    for (int pass = 0; pass < options_.passes; ++pass) {
      if (pass > 0) executor.fetch(state_);
      contacts_.pass(step, found);
      if (pass == 0) report.contacts += static_cast<double>(found.contacts);
      if (found.contacts == 0) break;
      executor.submit(state_);
      lengths_.hold(executor, substep, seconds, report);
    }
    report.crossings += static_cast<double>(found.crossings);
    report.contact_depth = std::max(report.contact_depth, found.depth);
  }

 private:
  bool each_substep() const { return options_.cadence == scene::Cadence::kSubstep; }

  kernels::HairContactStep<T> contact_step() {
    kernels::HairContactStep<T> step{};
    step.batches = model_.view();
    step.row_count = static_cast<std::int32_t>(model_.layout.rows());
    step.state = state_.view();
    step.start = start_.data();
    step.start_root_points = start_root_points_.data();
    step.root_points = state_.root_points.data();
    step.radius = model_.radius.data();
    step.clamped = scene_.model.clamped_particles;
    step.friction = static_cast<T>(options_.friction);
    return step;
  }

  const scene::Scene& scene_;
  const scene::HairContacts& options_;
  const state::StrandModel<T>& model_;
  state::StrandState<T>& state_;
  Contacts<T> contacts_;
  state::AlignedVector<T> start_;
  state::AlignedVector<double> start_root_points_;
  Lengths<T> lengths_;
};

}  // namespace

template <class T>
std::unique_ptr<Stage<T>> make_contacts_stage(const scene::Scene& scene, const state::StrandModel<T>& model,
                                              state::StrandState<T>& state, Executor<T>& executor) {
  return std::make_unique<ContactsStage<T>>(scene, model, state, executor);
}

template std::unique_ptr<Stage<float>> make_contacts_stage(const scene::Scene&,
                                                           const state::StrandModel<float>&,
                                                           state::StrandState<float>&, Executor<float>&);
template std::unique_ptr<Stage<double>> make_contacts_stage(const scene::Scene&,
                                                            const state::StrandModel<double>&,
                                                            state::StrandState<double>&, Executor<double>&);

}  // namespace ringlet::effects
