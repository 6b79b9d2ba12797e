// The scene's own keys: translation, rotation and scale of a whole asset about the scene's origin.
#pragma once
#include <span>

#include "core/geometry.h"
#include "scene/scene_desc.h"

namespace ringlet::solids {

// x = rotate * (scale * local) + translate. [m]
struct Similarity {
  Vec3 translate = Vec3::Zero();
  Quat rotate = Quat::Identity();
  double scale = 1;
};

// The keys at a (fractional) frame: held outside; between keys translation and scale follow Catmull-Rom
// (slopes by central differences in the keys' own times, one-sided at the ends) or straight lines, rotation
// slerps the shorter way. No keys: the identity.
Similarity sample_keys(std::span<const scene::Key> keys, scene::Interpolation interpolation, double frame);

// Where an animation's keys put an asset at `time` [s] after frame `first`: its own, then the scene's motion.
Similarity sample_animation(const scene::Animation& animation, const scene::Frames& frames, double time);

// Between two similarities: straight lines and slerp.
Similarity interpolate(const Similarity& a, const Similarity& b, double weight_of_b);

// 0 to 1 with no speed at either end: how preroll goes from the rest pose to the first pose.
double ease(double x);

}  // namespace ringlet::solids
