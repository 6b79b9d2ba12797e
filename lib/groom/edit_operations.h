// The operations one by one; edit.h is the way in. Private to the room.
#pragma once
#include <cstddef>
#include <optional>
#include <vector>

#include "groom/edit.h"

namespace ringlet::groom {

// Where a strand ends: on the segment from particle `segment` to the next, at this fraction of it.
struct Cut {
  std::size_t segment;
  double fraction;
};

// Where a trim ends the strand; nothing where it leaves it whole.
std::optional<Cut> find_cut(const EditedStrand& strand, const scene::Trim& trim,
                            const SignedDistance& cutter);

// A stub under this fraction of its segment is not worth a particle: its angles would be noise.
inline constexpr double kStub = 0.1;

// Ends what the particles of a strand have, points or numbers, at the cut.
template <class T>
void end_at(const Cut& cut, std::vector<T>& values) {
  const bool is_stub = cut.fraction < kStub;
  if (!is_stub) {
    const T &from = values[cut.segment], &to = values[cut.segment + 1];
    values[cut.segment + 1] = static_cast<T>(from + cut.fraction * (to - from));
  }
  values.resize(cut.segment + (is_stub ? 1 : 2));
}

// True where the strand changed.
bool lengthen(EditedStrand& strand, const scene::Lengthen& by);
bool comb(EditedStrand& strand, const scene::Comb& by);

}  // namespace ringlet::groom
