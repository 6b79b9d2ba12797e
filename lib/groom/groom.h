// Reads, grows, writes and attaches grooms.
#pragma once
#include <filesystem>
#include <span>

#include "groom/strands.h"
#include "scene/scene_desc.h"

namespace ringlet::groom {

// The head's rest pose as growth and attachment see it. Metres, scene axes.
struct Scalp {
  std::span<const Vec3> vertices;
  std::span<const Triangle> triangles;
  std::span<const std::int32_t> mesh_of_triangle;  // index into mesh_names
  std::span<const std::string> mesh_names;
};

// Reads .hair (Cem Yuksel), .data (USC-HairSalon), .tfx with .tfxskin (TressFX 3 and 4) or Ringlet's .h5
// groom by the file's content. Lengths become metres and axes the scene's. Throws Error{kInput} with file and
// byte offset.
Strands read(const std::filesystem::path& file, const std::optional<std::filesystem::path>& skin,
             const scene::UnitsOverride& units, const scene::Units& scene_units);

// What such a file says of its unit and up axis; only Ringlet's own says anything.
scene::UnitsOverride declared_units(const std::filesystem::path& file);

// Grows strands on the head: physics.md section 9. Deterministic in the seed on every machine.
Strands grow(const scene::Grow& parameters, const Scalp& scalp, scene::Axis up);

// All of one scene groom: its files (each a group) or its growth.
Strands build(const scene::Groom& desc, const scene::Units& scene_units, const Scalp* scalp);

// Ringlet's own groom file (HDF5; schemas/groom.md). Lengths are written in metres.
void write(const std::filesystem::path& file, const Strands& strands, scene::Axis up);

// Strands held by the head: each root at its triangle and barycentrics, its frame turned by that triangle.
class Attachment {
 public:
  // Nearest triangle for each root (never one without area; the lowest index of equals), or the stored one.
  // Stored coordinates that do not lie at the root give way to the stored triangle's nearest point. Throws
  // Error{kInput} naming strand and distance where a root is farther than `desc.attach_distance` from the
  // head, or a stored triangle does not exist.
  // With `desc.root_offset` snap the roots are held on the head itself: place() moves the strands there.
  static Attachment to_head(const Strands& strands, const Scalp& rest, const scene::Groom& desc);

  // Moves whole strands, their shapes as they are, so that their roots are where they are held in the rest
  // pose.
  void place(Strands& strands) const;

  // Of the strands that are marked alone.
  Attachment select(std::span<const unsigned char> marks) const;

  const std::vector<RootSite>& sites() const { return sites_; }

  // Root poses for the head's vertices now: rotation from the rest pose's triangle frame to now's (exactly
  // identity for unmoved vertices), position of the strand's first particle. `out` holds one pose per strand.
  void pose(std::span<const Vec3> vertices, std::span<Pose> out) const;

 private:
  std::vector<RootSite> sites_;
  std::vector<Triangle> triangles_;  // vertex indices of each site's triangle
  std::vector<Mat3> rest_frame_;     // of each site's triangle in the rest pose
  std::vector<Vec3> rest_point_;     // each site's point on the head, rest pose
  std::vector<Vec3> rest_root_;      // each strand's first particle, rest pose
};

}  // namespace ringlet::groom
