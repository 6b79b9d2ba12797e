// The contacts stage: when it looks, from where on, what it tells, and that lengths are held after it.
#include <gtest/gtest.h>

#include "core/error.h"
#include "effects/contacts/contacts_stage.h"
#include "scene/scene_desc.h"
#include "state/strand_model.h"

namespace ringlet::effects {
namespace {

constexpr double kStep = 1.0 / (24 * 8);

// Two strands that cross, 1 mm apart: one along x, one along z above it that is moved down.
class ContactsStage : public testing::Test {
 protected:
  using T = float;
  static constexpr int kParticles = 6;

  ContactsStage() {
    scene_.model.substeps = 8, scene_.model.clamped_particles = 1;
    scene_.limits = {10, 1000};
    scene_.effects.inextensible =
        scene::Inextensible{1e-4, 8, scene::LengthMetric::kMass, scene::Cadence::kSubstep};
    scene_.effects.hair_hair.emplace();
    scene_.effects.hair_hair->contacts = scene::HairContacts{0.3, 4, scene::Cadence::kFrame, std::nullopt};
    state::StrandInput input;
    for (int s = 0; s < 2; ++s) {
      input.counts.push_back(kParticles);
      const Vec3 along = s == 0 ? Vec3::UnitX() : Vec3::UnitZ();
      roots_.push_back({Mat3::Identity(), Vec3(0, 0.001 * s, 0) - 0.025 * along});
      for (int i = 0; i < kParticles; ++i) {
        input.rest.push_back(roots_.back().position + 0.01 * i * along);
        input.radius.push_back(4e-5f);
      }
    }
    model_ = std::make_unique<state::StrandModel<T>>(input);
    state_ = std::make_unique<state::StrandState<T>>(*model_);
    state::pose_at_rest<T>(*state_, *model_, roots_);
    executor_ = make_cpu_executor(*model_, "");
    report_.strain.assign(2, 0), report_.moved.assign(2, 0);
  }

  void make() {
    stage_ = make_contacts_stage<T>(scene_, *model_, *state_, *executor_);
    stage_->at_rest(*executor_, *state_);
  }
  Substep substep(int k) const { return {2, k * kStep, (k + 1) * kStep, kStep, k == 0, k == 7, 8}; }

  // The upper strand's particles but its root go down by `by` [m], at the speed of that way.
  void lower(double by) {
    for (int i = 1; i < kParticles; ++i) {
      state_->position[model_->layout.at(1, i, 3, 1)] -= T(by);
      state_->velocity[model_->layout.at(1, i, 3, 1)] = T(-by / kStep);
    }
  }
  // Of the upper strand over the lower, in the middle.
  double above() const {
    const auto y = [&](std::size_t s) {
      return state_->root_points[model_->layout.at_strand(s, 3, 1)] +
             0.5 * (state_->position[model_->layout.at(s, 2, 3, 1)] +
                    state_->position[model_->layout.at(s, 3, 3, 1)]);
    };
    return y(1) - y(0);
  }

  scene::Scene scene_{};
  std::vector<Pose> roots_;
  std::unique_ptr<state::StrandModel<T>> model_;
  std::unique_ptr<state::StrandState<T>> state_;
  std::unique_ptr<Executor<T>> executor_;
  std::unique_ptr<Stage<T>> stage_;
  FrameReport report_;
};

TEST_F(ContactsStage, OnceAFrameSeesWhatCrossedInAnySubstep) {
  make();
  EXPECT_EQ(stage_->name(), "contacts");
  for (int k = 0; k < 8; ++k) {
    stage_->begin(*executor_, substep(k));
    if (k == 2) lower(0.004);
    const auto position = state_->position, velocity = state_->velocity;
    stage_->run(*executor_, substep(k), report_);
    if (k < 7) {
      EXPECT_TRUE(state_->position == position && state_->velocity == velocity) << k;
      EXPECT_EQ(report_.contact_pairs, 0);
    }
  }
  EXPECT_GE(report_.contact_pairs, 1);
  EXPECT_EQ(report_.contacts, 1);
  EXPECT_EQ(report_.crossings, 0);  // held
  EXPECT_GT(above(), 8e-5 * (1 - 1e-2));
  for (const float strain : report_.strain) EXPECT_LE(strain, 1e-4f);
}

TEST_F(ContactsStage, EachSubstepSeesItsOwn) {
  scene_.effects.hair_hair->contacts->cadence = scene::Cadence::kSubstep;
  make();
  for (int k = 0; k < 4; ++k) {
    stage_->begin(*executor_, substep(k));
    if (k == 2) lower(0.004);
    stage_->run(*executor_, substep(k), report_);
    EXPECT_EQ(report_.contacts > 0, k >= 2) << k;
    if (k >= 2) {
      EXPECT_GT(above(), 8e-5 * (1 - 1e-2)) << k;
    }
  }
}

TEST_F(ContactsStage, WhatCrossedBeforeTheFrameStaysCrossed) {
  make();
  lower(0.004);
  stage_->begin(*executor_, substep(0));
  const auto position = state_->position;
  for (int k = 0; k < 8; ++k) stage_->run(*executor_, substep(k), report_);
  EXPECT_EQ(report_.contacts, 0);
  EXPECT_LT(above(), 0);
}

// A solid takes the upper strand through the lower after the frame's passes.
TEST_F(ContactsStage, ACheckpointHoldsWhatIsThrough) {
  make();
  stage_->begin(*executor_, substep(0));
  lower(0.0008);  // near, not yet touching
  stage_->run(*executor_, substep(7), report_);
  lower(0.004);
  state::Snapshot snapshot;
  stage_->save(snapshot);
  ASSERT_EQ(snapshot.arrays.count("contacts"), 1u);

  make();
  stage_->restore(snapshot);
  stage_->begin(*executor_, substep(0));
  stage_->run(*executor_, substep(7), report_);
  EXPECT_EQ(report_.contacts, 1);
  EXPECT_GT(above(), 8e-5 * (1 - 1e-2));
}

TEST_F(ContactsStage, RefusesADamagedCheckpoint) {
  make();
  state::Snapshot snapshot;
  snapshot.arrays["contacts"].assign(8, std::byte{0xff});
  EXPECT_THROW(stage_->restore(snapshot), Error);
  snapshot.arrays["contacts"].assign(5, std::byte{0});
  EXPECT_THROW(stage_->restore(snapshot), Error);
}

TEST_F(ContactsStage, OwnsItsMemoryAndLaunchesForLengthsOnly) {
  make();
  const std::size_t before = stage_->bytes();
  EXPECT_GE(before, state_->position.size() * sizeof(T));
  EXPECT_EQ(stage_->launches(8).most, 4);
  stage_->begin(*executor_, substep(0));
  lower(0.004);
  stage_->run(*executor_, substep(7), report_);
  EXPECT_GT(stage_->bytes(), before);
}

}  // namespace
}  // namespace ringlet::effects
