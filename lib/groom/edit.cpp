#include "groom/edit.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <atomic>

#include "core/error.h"
#include "core/log.h"
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

struct FileStrand {
  EditedStrand strand;
  std::vector<float> widths;
};

FileStrand take(const Strands& strands, std::size_t number) {
  const auto first = strands.offsets[number], end = strands.offsets[number + 1];
  FileStrand one;
  one.strand.rest.assign(strands.points.begin() + first, strands.points.begin() + end);
  one.strand.position = one.strand.rest;
  one.strand.velocity.assign(one.strand.rest.size(), Vec3::Zero());
  one.strand.rotation = Mat3::Identity();
  if (!strands.widths.empty())
    one.widths.assign(strands.widths.begin() + first, strands.widths.begin() + end);
  return one;
}

// `edited` in place of the old strands, but for those cut down to their root.
Strands gather(const Strands& old, const std::vector<FileStrand>& edited) {
  Strands all;
  all.group_names = old.group_names;
  for (std::size_t s = 0; s < edited.size(); ++s) {
    const std::vector<Vec3>& points = edited[s].strand.rest;
    if (points.size() == 1 && old.count(s) > 1) continue;
    all.points.insert(all.points.end(), points.begin(), points.end());
    all.widths.insert(all.widths.end(), edited[s].widths.begin(), edited[s].widths.end());
    all.offsets.push_back(static_cast<std::int64_t>(all.points.size()));
    if (!old.groups.empty()) all.groups.push_back(old.groups[s]);
    if (!old.roots.empty()) all.roots.push_back(old.roots[s]);
  }
  return all;
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
  std::vector<FileStrand> edited(strands.size());
  std::atomic<std::size_t> changed = 0;
  tbb::parallel_for(std::size_t{0}, strands.size(), [&](std::size_t s) {
    edited[s] = take(strands, s);
    changed +=
        edit(edited[s].strand, operation, cutter, strands.widths.empty() ? nullptr : &edited[s].widths);
  });
  Strands all = gather(strands, edited);
  check_something_is_left(all, strands.size(), operation.pointer);
  log_info(fmt::format("{}: {} of {} strands changed, {} are gone", operation.pointer, changed.load(),
                       strands.size(), strands.size() - all.size()));
  strands = std::move(all);
}

}  // namespace ringlet::groom
