#include "effects/contacts/contacts_stage.h"

#include <algorithm>
#include <cstring>

#include "core/error.h"
#include "effects/lengths.h"
#include "kernels/contact/hair_contacts.h"
#include "state/strand_order.h"

namespace ringlet::effects {
namespace {

template <class T>
class ContactsStage : public Stage<T> {
 public:
  ContactsStage(const scene::Scene& scene, const state::StrandModel<T>& model, state::StrandState<T>& state,
                Executor<T>& executor)
      : scene_(scene),
        options_(*scene.effects.hair_hair->contacts),
        model_(model),
        state_(state),
        contacts_(executor.make_hair_contacts()),
        start_(state.position.size()),
        start_root_points_(state.root_points.size()),
        lengths_(scene, model, state) {}

  const char* name() const override { return "contacts"; }
  std::size_t bytes() const override {
    return contacts_->bytes() + lengths_.bytes() + start_.size() * sizeof(T) +
           start_root_points_.size() * sizeof(double);
  }
  // Of the lengths, which are looked at after every pass that found contacts.
  Launches launches(int substeps) const override {
    return {0, static_cast<std::int64_t>(options_.passes) * (each_substep() ? substeps : 1)};
  }
  std::int64_t diverged_strand() const override { return lengths_.diverged_strand(); }

  // Takes the memory that hair at rest asks for.
  void at_rest(Executor<T>& executor, const state::StrandState<T>& rest) override {
    contacts_ = executor.make_hair_contacts();  // the executor may be another than before
    order_ = state::strands_by_root(model_, rest);
    start_ = rest.position, start_root_points_ = rest.root_points;
    kernels::HairContactStep<T> step = contact_step();
    step.state = {start_.data(), start_.data()};  // not changed, and velocities do not matter
    step.root_points = start_root_points_.data();
    contacts_->begin(step);
    contacts_->keep(nullptr, 0);  // nothing is through anything
  }

  // Contacts are found over all the way since here: since the frame began, or the substep.
  void begin(Executor<T>& executor, const Substep& substep) override {
    if (!substep.first_of_frame && !each_substep()) return;
    if (!substep.first_of_frame) executor.fetch(state_);  // at the frame's start the host has the state
    contacts_->settle(contact_step());
    std::copy(state_.position.begin(), state_.position.end(), start_.begin());
    std::copy(state_.root_points.begin(), state_.root_points.end(), start_root_points_.begin());
  }

  void run(Executor<T>& executor, const Substep& substep, FrameReport& report) override {
    if (!substep.last_of_frame && !each_substep()) return;
    executor.fetch(state_);
    kernels::HairContactStep<T> step = contact_step();
    step.step = static_cast<T>(substep.step);
    kernels::HairContactFigures figures = contacts_->begin(step);
    const double seconds = substep.step * (each_substep() ? 1 : substep.substeps);
    std::int64_t contacts = 0;
    for (int pass = 0; pass < options_.passes; ++pass) {
      const std::int64_t found = contacts_->pass(step);
      if (pass == 0) contacts = found;
      if (found == 0) break;
      executor.submit(state_);
      lengths_.hold(executor, substep, seconds, report);
      executor.fetch(state_);
    }
    if (contacts > 0) contacts_->count_crossings(step, figures);
    report.contact_pairs += static_cast<double>(figures.pairs);
    report.contacts += static_cast<double>(contacts);
    report.crossings += static_cast<double>(figures.crossings);
    report.contact_depth = std::max(report.contact_depth, figures.depth);
  }

  // What is through one another stays known.
  void save(state::Snapshot& snapshot) override {
    contacts_->settle(contact_step());
    if (contacts_->kept() == 0) return;
    std::vector<std::uint64_t> kept(contacts_->kept());
    contacts_->copy_kept(kept.data());
    std::vector<std::byte>& bytes = snapshot.arrays[kKept];
    bytes.resize(kept.size() * sizeof kept[0]);
    std::memcpy(bytes.data(), kept.data(), bytes.size());
  }
  void restore(const state::Snapshot& snapshot) override {
    const auto found = snapshot.arrays.find(kKept);
    if (found == snapshot.arrays.end()) return static_cast<void>(contacts_->keep(nullptr, 0));
    std::vector<std::uint64_t> kept(found->second.size() / sizeof(std::uint64_t));
    std::memcpy(kept.data(), found->second.data(), kept.size() * sizeof kept[0]);
    if (found->second.size() % sizeof kept[0] != 0 ||
        !contacts_->keep(kept.data(), static_cast<std::int32_t>(kept.size())))
      throw Error(ErrorKind::kInput, "state", "`contacts` names segments that are not there",
                  "run without --resume");
  }

 private:
  static constexpr const char* kKept = "contacts";

  bool each_substep() const { return options_.cadence == scene::Cadence::kSubstep; }

  kernels::HairContactStep<T> contact_step() {
    kernels::HairContactStep<T> step{};
    step.batches = model_.view();
    step.order = order_.data(), step.strands = static_cast<std::int32_t>(order_.size());
    step.state = state_.view();
    step.start = start_.data();
    step.start_root_points = start_root_points_.data();
    step.root_points = state_.root_points.data();
    step.radius = model_.radius.data();
    step.clamped = scene_.model.clamped_particles;
    step.friction = static_cast<T>(options_.friction);
    step.touches = state_.touches.empty() ? nullptr : state_.touches.data();
    return step;
  }

  const scene::Scene& scene_;
  const scene::HairContacts& options_;
  const state::StrandModel<T>& model_;
  state::StrandState<T>& state_;
  std::unique_ptr<kernels::HairContacts<T>> contacts_;
  std::vector<std::int32_t> order_;  // of the strands
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
