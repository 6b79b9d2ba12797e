#include "effects/wind/wind_stage.h"

#include "effects/wind/shelter_map.h"
#include "effects/wind/wind_field.h"

namespace ringlet::effects {
namespace {

template <class T>
class WindStage : public Stage<T> {
 public:
  WindStage(const scene::Scene& scene, const solids::AnimatedMesh* head, const Vec3& origin,
            const state::StrandModel<T>& model, state::StrandState<T>& state)
      : field_(*scene.effects.wind, scene.frames, origin),
        shelter_(scene.effects.wind->shelter),
        head_(head),
        model_(model),
        state_(state) {
    state_.air.assign(state_.position.size(), T(0));
    if (!shelter_) return;
    exposure_.assign(state_.position.size() / 3, T(1));
    map_.reserve();
    head_vertices_.resize(head_->vertex_count());
  }

  const char* name() const override { return "wind"; }
  std::size_t bytes() const override {
    return (state_.air.size() + exposure_.size()) * sizeof(T) + map_.bytes() +
           head_vertices_.size() * sizeof(Vec3);
  }
  Launches launches(int substeps) const override { return {substeps, substeps + (shelter_ ? 1 : 0)}; }

  void run(Executor<T>& executor, const Substep& substep, FrameReport&) override {
    if (substep.first_of_frame) sheltered_ = false;
    if (shelter_ && !sheltered_) find_shelter(executor, substep.time);
    state_.wind = field_.mean(substep.time);
    executor.wind_step({model_.view(), state_.position.data(), state_.root_points.data(),
                        field_.at<T>(substep.time), sheltered_ ? exposure_.data() : nullptr,
                        state_.air.data(), state_.shelter.empty() ? nullptr : state_.shelter.data()});
  }

 private:
  // Once a frame, as soon as the wind blows in it: head and mean wind turn slowly beside the hair. What was
  // before the frame does not matter: a resumed run finds the same.
  void find_shelter(Executor<T>& executor, double time) {
    const Vec3 wind = field_.mean(time);
    if (wind == Vec3::Zero()) return;  // nothing to be sheltered from
    sheltered_ = true;
    head_->sample(time, head_vertices_);
    map_.draw(head_vertices_, head_->triangles(), wind);
    executor.shelter_step({model_.view(), state_.position.data(), state_.root_points.data(), map_.view(),
                           static_cast<float>(shelter_->strength), static_cast<float>(1 / shelter_->wake),
                           exposure_.data()});
  }

  WindField field_;
  std::optional<scene::Shelter> shelter_;
  const solids::AnimatedMesh* head_;
  const state::StrandModel<T>& model_;
  state::StrandState<T>& state_;
  state::AlignedVector<T> exposure_;  // [rows] or empty
  bool sheltered_ = false;            // `exposure_` holds for this frame
  ShelterMap map_;
  std::vector<Vec3> head_vertices_;
};

}  // namespace

template <class T>
std::unique_ptr<Stage<T>> make_wind_stage(const scene::Scene& scene, const solids::AnimatedMesh* head,
                                          const Vec3& origin, const state::StrandModel<T>& model,
                                          state::StrandState<T>& state) {
  return std::make_unique<WindStage<T>>(scene, head, origin, model, state);
}

template std::unique_ptr<Stage<float>> make_wind_stage(const scene::Scene&, const solids::AnimatedMesh*,
                                                       const Vec3&, const state::StrandModel<float>&,
                                                       state::StrandState<float>&);
template std::unique_ptr<Stage<double>> make_wind_stage(const scene::Scene&, const solids::AnimatedMesh*,
                                                        const Vec3&, const state::StrandModel<double>&,
                                                        state::StrandState<double>&);

}  // namespace ringlet::effects
