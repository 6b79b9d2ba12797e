#include "groom/edit.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <atomic>

#include "core/error.h"
#include "core/log.h"
#include "groom/assemble.h"
#include "groom/edit_operations.h"

namespace ringlet::groom {
namespace {

bool rest_here(EditedStrand& strand) {
  std::vector<Vec3> rest;
  for (const Vec3& point : strand.position)
    rest.push_back(strand.rotation.transpose() * (point - strand.position.front()) + strand.rest.front());
  std::swap(rest, strand.rest);
  return rest != strand.rest;
}

bool trim(EditedStrand& strand, const scene::Trim& by, const SignedDistance& cutter,
          std::vector<float>* widths) {
  const std::optional<Cut> cut = find_cut(strand, by, cutter);
  if (!cut) return false;
  end_at(*cut, strand.rest);
  end_at(*cut, strand.position);
  end_at(*cut, strand.velocity);
  if (widths != nullptr) end_at(*cut, *widths);
  return true;
}

// `widths` of the particles, or null: they follow a cut, and the last goes on.
bool edit(EditedStrand& strand, const scene::GroomingOperation& operation, const SignedDistance& cutter,
          std::vector<float>* widths) {
  struct Visitor {
    EditedStrand& strand;
    const SignedDistance& cutter;
    std::vector<float>* widths;
    bool operator()(const scene::Trim& by) const { return trim(strand, by, cutter, widths); }
    bool operator()(const scene::Lengthen& by) const { return lengthen(strand, by); }
    bool operator()(const scene::Comb& by) const { return comb(strand, by); }
    bool operator()(const scene::Rest&) const { return rest_here(strand); }
  };
  const bool changed = std::visit(Visitor{strand, cutter, widths}, operation.what);
  if (widths != nullptr) widths->resize(strand.rest.size(), widths->back());
  return changed;
}

// ---- Whole grooms ------------------------------------------------------------------------------------

// Does it to a strand of a file; a strand cut down to its root is no point at all.
bool edit(StrandShape& shape, const scene::GroomingOperation& operation, const SignedDistance& cutter) {
  const std::size_t particles = shape.points.size();
  EditedStrand strand{shape.points, shape.points, std::vector<Vec3>(particles, Vec3::Zero()),
                      Mat3::Identity()};
  const bool changed = edit(strand, operation, cutter, shape.widths.empty() ? nullptr : &shape.widths);
  shape.points = std::move(strand.rest);
  if (shape.points.size() == 1 && particles > 1) shape = {};
  return changed;
}

void check_something_is_left(const Strands& strands, std::size_t before, const std::string& pointer) {
  for (std::size_t s = 0; s < strands.size(); ++s)
    if (strands.count(s) > 1) return;
  throw Error(
      ErrorKind::kInput, pointer,
      fmt::format("leaves nothing of any of {} strands, expected one of two particles or more", before),
      "look at its place, its unit and which side it keeps");
}

}  // namespace

bool edit(EditedStrand& strand, const scene::GroomingOperation& operation, const SignedDistance& cutter) {
  return edit(strand, operation, cutter, nullptr);
}

void edit(Strands& strands, const scene::GroomingOperation& operation, const SignedDistance& cutter) {
  std::vector<StrandShape> shapes(strands.size());
  std::atomic<std::size_t> changed = 0;
  tbb::parallel_for(std::size_t{0}, shapes.size(), [&](std::size_t s) {
    shapes[s] = shape_of(strands, s);
    changed += edit(shapes[s], operation, cutter);
  });
  Strands all = assemble(strands, shapes);
  if (std::holds_alternative<scene::Trim>(operation.what))
    check_something_is_left(all, strands.size(), operation.pointer);
  log_info(fmt::format("{}: {} of {} strands changed, {} are gone", operation.pointer, changed.load(),
                       strands.size(), strands.size() - all.size()));
  strands = std::move(all);
}

}  // namespace ringlet::groom
