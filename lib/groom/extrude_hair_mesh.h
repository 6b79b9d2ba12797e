// Extrudes a hair mesh from a patch on the scalp.
//
// Layers are carried outward by the streamlines of a steady flow about the head. Streamlines of one flow
// never cross, and a patch that they leave on one side keeps its sides: the finer the patch, the less layers
// can pass through each other, however hair falls. What its finite faces still turn inside out is opened by
// moving vertices a little. In coordinates where the head is the unit sphere, y, with r = |y| and n = y / r,
// the flow is
//
//   F = gravity (T + (k/2) (T - (T.n) n) - k (T.n) n) + q n / r^2,   k = 1 / r^3,
//   T = g + c / (1 + (|S (y - a)| / 1.5)^4) S (y - a) / |S (y - a)|
//
// T pulls down along the unit vector g and away from a place a before the front of the patch, which combs
// hair back; S = diag(0.1, 1, 1) takes most of the way to the sides off it, so that hair on top stays
// together. The terms with k bend T round the sphere, as a dipole bends potential flow; q = (1 + l)^2 - 1 /
// (1 + l) lets hair on top of the head lie at the height l = lift / radius, where it and the pull down
// balance. Near the head itself, which is no sphere, directions are turned until they rise from it.
#pragma once
#include <optional>

#include "core/error.h"
#include "groom/edit.h"
#include "groom/scalp_patch.h"

namespace ringlet::groom {

struct HairExtrusion {
  int layers = 5;               // the scalp's included
  double length = 0;            // [m] of the hair
  double lift = 0;              // [m] how far hair stands off before it lies down
  double gravity = 1;           // [-] 0: straight out of the head; the greater, the sharper it bends
  double comb = 3;              // [-] c: how strongly it is combed back
  double curl_radius = 0;       // [m] of the helix that layers go about their streamlines, at the tip
  double curl_turns = 0;        // of it from root to tip; a third of a turn from layer to layer at most
  std::optional<double> level;  // [m] along the up axis: hair that comes this low is cut there
};

// What is out of its range, `where` being the name of the number; empty: nothing.
std::optional<Problem> out_of_range(const HairExtrusion& extrusion);

// `head`: how far outside the head a point is [m]; safe from several threads. Vertices whose prisms would be
// inverted are moved off their streamlines as little as opens them; where that does not suffice the lift
// grows in steps and the log says so. The result passed check(). Throws Error{kInput} where a number is out
// of its range or all lifts fail.
HairMesh extrude_hair_mesh(const HairExtrusion& extrusion, const ScalpPatch& patch,
                           const SignedDistance& head);

// ---- The paper's hair styles (Wu and Yuksel 2016, section 4, Figures 1 and 6)
// ------------------------------

enum class HairStyle { kShort, kShoulder, kLong };
enum class HairResolution { kLow, kMedium, kHigh };

// Vertices of the scalp and layers. Their products are the paper's where it tells them: 215 for short hair at
// low resolution, 361 for the other two styles at low, 2,305 for long hair at high resolution.
struct HairMeshSize {
  int scalp_vertices, layers;
};
HairMeshSize size_of(HairStyle style, HairResolution resolution);

// The extrusion of a style on this head, in proportion to its radius.
HairExtrusion extrusion_of(HairStyle style, HairResolution resolution, const ScalpPatch& patch);

}  // namespace ringlet::groom
