#include "groom/assemble.h"

namespace ringlet::groom {

StrandShape shape_of(const Strands& strands, std::size_t strand) {
  const auto first = strands.offsets[strand], end = strands.offsets[strand + 1];
  StrandShape shape{{strands.points.begin() + first, strands.points.begin() + end}, {}};
  if (!strands.widths.empty())
    shape.widths.assign(strands.widths.begin() + first, strands.widths.begin() + end);
  return shape;
}

Strands assemble(const Strands& old, std::span<const StrandShape> shapes) {
  Strands all;
  all.group_names = old.group_names;
  for (std::size_t s = 0; s < shapes.size(); ++s) {
    const StrandShape& shape = shapes[s];
    if (shape.points.empty()) continue;
    all.points.insert(all.points.end(), shape.points.begin(), shape.points.end());
    all.widths.insert(all.widths.end(), shape.widths.begin(), shape.widths.end());
    all.offsets.push_back(static_cast<std::int64_t>(all.points.size()));
    if (!old.groups.empty()) all.groups.push_back(old.groups[s]);
    if (!old.roots.empty()) all.roots.push_back(old.roots[s]);
  }
  return all;
}

}  // namespace ringlet::groom
