// Grooming operations on single strands: trim, lengthen, comb, re-rest. The same code edits groom files and
// the strands of a run.
#pragma once
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/geometry.h"
#include "groom/strands.h"
#include "scene/scene_desc.h"

namespace ringlet::groom {

// A strand under the scissors, root first: its rest shape, and where it is now. Of a groom file both are the
// same and nothing moves. The three arrays are of one length, at least 1.
struct EditedStrand {
  std::vector<Vec3> rest;      // in the axes of the rest pose [m]
  std::vector<Vec3> position;  // in the world [m]
  std::vector<Vec3> velocity;  // [m/s]
  Mat3 rotation;               // of the root's frame, from the rest pose to now
  double spacing = 0;          // [m] least distance of particles that are added; of a run, that of its start
  std::size_t held = 1;        // particles at the root that are prescribed: a comb does not turn them
};

// The distance at which a strand of this rest shape would be continued [m]: its mean segment, a short last
// one aside. 0 for a strand without length.
double spacing(std::span<const Vec3> rest);

// How far outside a shape a point is [m], negative inside.
using SignedDistance = std::function<double(const Vec3&)>;

// Does `operation` to a strand; true where that changed it. `cutter`: the distance to the mesh of a trim by
// mesh. Prescribed particles (the root) stay. A strand whose root is cut away keeps its root alone.
//
// Trim: the tip comes to lie on the cut; where that would leave a last segment under a tenth of what it was,
// the strand ends a particle sooner, so much short. A mesh is followed to a micrometre; sheets of it thinner
// than ten may be missed.
//
// Lengthen, extend: the last segment first grows to the others' length, in its direction, so that a strand
// that was trimmed gets its old shape back. Then come new particles, with the curl of the strand's end
// (continuation.h): a helix goes on as that helix, an arc as that arc. What is left over is a shorter segment
// or, under a tenth of one, goes to the last. New particles have the tip's velocity. A strand of one particle
// has no direction and stays.
//
// Comb: what is combed is the present shape, and it becomes the rest shape, with the rest shape's lengths.
// Segment after segment turns towards the point of the curve that lies its own length ahead, and carries what
// follows, so that curls out of reach are not flattened. Past its end the curve goes straight on, but its
// reach is counted from the end.
bool edit(EditedStrand& strand, const scene::GroomingOperation& operation, const SignedDistance& cutter = {});

// The most particles that a strand of `rest` can come to have by `operations`, whatever its position, with
// its `spacing` that of `rest`.
std::size_t most_particles(std::span<const Vec3> rest, std::span<const scene::GroomingOperation> operations);

// Does `operation` to every strand of a groom (its `groom` and `frame` aside), widths following. Strands cut
// down to their root are gone. Throws Error{kInput} at operation.pointer where nothing is left: no strand of
// two particles or more. `cutter` is called from several threads at once.
void edit(Strands& strands, const scene::GroomingOperation& operation, const SignedDistance& cutter = {});

// Every strand with `particles` particles, or with segments as near to `step` [m] as divides its length
// evenly: on the smooth curve through its points, equally spaced along it. Root and tip stay exactly. Widths
// are interpolated. One of the two is set.
Strands resample(const Strands& strands, std::optional<int> particles, std::optional<double> step);

}  // namespace ringlet::groom
