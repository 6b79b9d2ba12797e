// Reference implementation of the plain mass-spring strand (Selle et al. 2008; physics.md section 7): one
// strand, double precision, dense matrices, written from the equations alone.
//
// The chain's nodes are columns: 2i the hair's particle i, 2i + 1 the companion of its segment i.
#pragma once
#include <array>

#include "oracle/ams_reference.h"

namespace ringlet::oracle {

struct MassSpringChain {
  Points rest;  // [m] nodes at rest in the root's frame, relative to the root
  std::vector<double> edge, bend,
      twist;  // [1/s^2] of the springs that begin at each particle or its companion
  Vec3 gravity{0, -9.81, 0};
  double drag = 0, damping = 0;  // [1/s], [s]
  int clamped = 1;               // nodes that follow the root's frame
  bool geometric_stiffness = true;

  int nodes() const { return static_cast<int>(rest.cols()); }
};

// One of the seven altitudes of four nodes: which, its signed length, and the gradient of that length to
// each.
struct ReferenceAltitude {
  int which;
  double length;
  std::array<Vec3, 4> gradient;
};
ReferenceAltitude altitude(const Points& four,
                           int which);  // which: 0 to 3 point to face, 4 to 6 edge to edge
ReferenceAltitude shortest_altitude(const Points& four);

// Energy [J per unit mass] of all springs, the altitude of each tetrahedron being `chosen`; and minus its
// gradient.
std::vector<int> chosen_altitudes(const Points& x);
double energy(const MassSpringChain& chain, const Points& x, const std::vector<int>& chosen);
Points force(const MassSpringChain& chain, const Points& x, const std::vector<int>& chosen);

// One implicit step for the nodes that are not clamped, as AMS's `assemble`.
LinearSystem assemble(const MassSpringChain& chain, const State& state, const Step& step);

}  // namespace ringlet::oracle
