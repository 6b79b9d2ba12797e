// The wind of a scene at any time.
#pragma once
#include <vector>

#include "kernels/wind/wind_step.h"
#include "scene/scene_desc.h"

namespace ringlet::effects {

// A pure function of time: a resumed run meets the very same air. Times are in seconds after frame `first`.
class WindField {
 public:
  // `origin`: a point near the hair [m], from which the waves of the turbulence are counted.
  WindField(const scene::Wind& wind, const scene::Frames& frames, const Vec3& origin);

  Vec3 mean(double time) const;  // gusts included [m/s]

  // How far the mean wind has carried the eddies since time 0 [m], the exact integral of `mean`.
  Vec3 travel(double time) const;

  // Everything a step is told, at this time.
  template <class T>
  kernels::WindField<T> at(double time) const;

 private:
  struct Sine {                     // of the gusts
    double amplitude, rate, phase;  // [-], [rad/s], [rad]
  };
  struct Mode {            // of the turbulence, for a root mean square speed of 1
    Vec3 wave, amplitude;  // [turns/m], [-]
    double phase;          // [turns]
  };
  struct Knot {
    double time;
    Vec3 velocity;
  };
  void make_gusts(const scene::Gusts& gusts);
  void make_modes(const scene::Turbulence& turbulence);
  Vec3 keyed(double time) const;
  Vec3 carried(const Knot& from, const Knot& to) const;  // over a piece on which the keyed wind is linear

  std::vector<Knot> knots_;
  std::vector<Sine> gusts_;
  std::vector<Mode> modes_;
  double intensity_ = 0;
  Vec3 origin_;
};

}  // namespace ringlet::effects
