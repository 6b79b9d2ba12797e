#include "solids/keyframes.h"

#include <algorithm>

namespace ringlet::solids {
namespace {

Similarity similarity(const scene::Key& key) { return {key.translate, key.rotate.normalized(), key.scale}; }

// d value / d frame at key `i`.
template <class Value>
auto slope(std::span<const scene::Key> keys, std::size_t i, Value value) {
  const scene::Key& before = keys[i == 0 ? 0 : i - 1];
  const scene::Key& after = keys[std::min(i + 1, keys.size() - 1)];
  using T = std::decay_t<decltype(value(before))>;
  return T((value(after) - value(before)) / (after.frame - before.frame));
}

// Cubic Hermite between keys `i` and `i + 1`, at s in [0, 1].
template <class Value>
auto hermite(std::span<const scene::Key> keys, std::size_t i, double s, Value value) {
  using T = std::decay_t<decltype(value(keys[i]))>;
  const double length = keys[i + 1].frame - keys[i].frame;
  const double s2 = s * s, s3 = s2 * s;
  return T((2 * s3 - 3 * s2 + 1) * value(keys[i]) + (3 * s2 - 2 * s3) * value(keys[i + 1]) +
           length * ((s3 - 2 * s2 + s) * slope(keys, i, value) + (s3 - s2) * slope(keys, i + 1, value)));
}

}  // namespace

Similarity interpolate(const Similarity& a, const Similarity& b, double weight_of_b) {
  return {a.translate + weight_of_b * (b.translate - a.translate), a.rotate.slerp(weight_of_b, b.rotate),
          a.scale + weight_of_b * (b.scale - a.scale)};
}

double ease(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

Similarity sample_keys(std::span<const scene::Key> keys, scene::Interpolation interpolation, double frame) {
  if (keys.empty()) return {};
  if (frame <= keys.front().frame) return similarity(keys.front());
  if (frame >= keys.back().frame) return similarity(keys.back());
  const auto after = std::upper_bound(keys.begin(), keys.end(), frame,
                                      [](double value, const scene::Key& key) { return value < key.frame; });
  const std::size_t i = static_cast<std::size_t>(after - keys.begin()) - 1;
  const double s = (frame - keys[i].frame) / (keys[i + 1].frame - keys[i].frame);
  Similarity result = interpolate(similarity(keys[i]), similarity(keys[i + 1]), s);
  if (interpolation == scene::Interpolation::kSmooth) {
    result.translate = hermite(keys, i, s, [](const scene::Key& key) { return key.translate; });
    result.scale = hermite(keys, i, s, [](const scene::Key& key) { return key.scale; });
  }
  return result;
}

Similarity sample_animation(const scene::Animation& animation, const scene::Frames& frames, double time) {
  const double frame = frames.first + time * animation.speed * frames.fps;
  const Similarity own = sample_keys(animation.keys, animation.interpolation, frame);
  if (animation.carrier.empty()) return own;
  const Similarity carrier = sample_keys(animation.carrier, animation.carrier_interpolation, frame);
  return {carrier.rotate * own.translate + carrier.translate, carrier.rotate * own.rotate, own.scale};
}

}  // namespace ringlet::solids
