// Guides and the strands that follow them: linear hair skinning.
//
// A point x of a follower at rest hangs on each of its guides at the same distance from the root along the
// hair, or on the guide's tip where that is shorter. A guide's particle k carries it rigidly, by where it
// went and how the guide turned there since the rest pose:
//
//   follow_k(x) = p_k + R_k (x - P_k),   P_k, p_k the particle at rest and now, R_k rest to now
//
// Between two particles of a guide the two are blended linearly, and so are the guides, by the inverse
// squares of the roots' distances. Rigid motion of all guides passes on exactly. The follower is then moved
// as a whole so that its root is where the head holds it.
#pragma once
#include <span>
#include <vector>

#include "groom/strands.h"
#include "scene/scene_desc.h"

namespace ringlet::groom {

// [strands] 1 for those that are guides, as the scene chooses them. By number of guides: each next one is the
// strand whose root is farthest from all roots chosen, the first the one nearest to their centre. Throws
// Error{kInput} at the pointer of what names guides that do not exist.
std::vector<unsigned char> choose_guides(const Strands& strands, const scene::Interpolate& interpolate);

// The strands that are marked.
Strands select(const Strands& strands, std::span<const unsigned char> marks);

// Simulated strands as they are now.
struct GuidesNow {
  std::span<const Vec3> points;    // [particles] in the world [m]
  std::span<const Mat3> rotation;  // [strands] of the root frames, rest to now
};

// How all strands of a scene follow those that are simulated. Grooms whose strands are all simulated are part
// of it: each of their strands follows itself.
class Interpolation {
 public:
  // `neighbours`: the most guides that a strand of any groom follows.
  explicit Interpolation(int neighbours) : neighbours_(neighbours) {}

  // One more groom: all its strands and which are guides, at least one. A strand follows the `neighbours`
  // guides of nearest root, or all where there are fewer; weights go with the inverse square of the roots'
  // distances.
  void add(const Strands& strands, std::span<const unsigned char> is_guide, int neighbours);

  int neighbours() const { return neighbours_; }
  std::size_t strands() const { return offsets_.size() - 1; }
  std::span<const std::int32_t> guides() const { return guides_; }  // strand of each guide, ascending

  // [strands][neighbours]: index into guides, weight. Weights of a strand sum to 1; a strand with fewer
  // guides ends in guide -1 of weight 0. A guide follows itself alone.
  std::span<const std::int32_t> guide() const { return guide_; }
  std::span<const double> weight() const { return weight_; }

  // Where the particles of all strands are. `roots` [strands] is where their first particles are to be.
  // Guides are copied, bit for bit.
  void follow(const GuidesNow& now, std::span<const Vec3> roots, std::span<Vec3> out) const;

  // A value of each guide particle carried over by the same weights. `out` [particles].
  void blend(std::span<const float> of_guides, std::span<float> out) const;

  std::size_t bytes() const;

 private:
  // The guide particle below a point, and how far on to the next [0, 1].
  struct Place {
    std::int32_t particle;  // of all guide particles
    float share;
  };
  struct Rest {
    std::vector<std::int64_t> offsets = {0};
    std::vector<Vec3> points;
  };
  std::vector<Mat3> turns(const GuidesNow& now) const;
  void append(const Strands& strands, std::span<const unsigned char> is_guide);
  void follow_nearest(std::size_t first_strand, std::size_t first_guide, int neighbours);
  void find_places(std::size_t first_strand, std::size_t first_guide);
  // The first guide particle of a strand that is a guide itself; else -1.
  std::int64_t own_particles(std::size_t strand) const;
  // What guides carry to a particle: `at` gives it of a guide particle.
  template <class T, class At>
  T mix(std::size_t strand, std::size_t particle, T zero, const At& at) const;

  int neighbours_;
  std::vector<std::int64_t> offsets_ = {0};  // of all strands
  std::vector<Vec3> rest_;                   // all particles
  Rest guide_rest_;
  std::vector<std::int32_t> guides_, guide_;
  std::vector<double> weight_;
  std::vector<Place> places_;  // [particles][neighbours]
};

}  // namespace ringlet::groom
