// What is left of an earlier run; private to the room.
#pragma once
#include <map>
#include <optional>

#include "cache/layout.h"

namespace ringlet::cache {

struct Remains {
  std::map<int, FrameRecord> frames;        // complete on disk
  std::optional<state::Snapshot> snapshot;  // only if every frame from the first up to it is there
};

// Throws Error{kUsage} where the cache on disk is of another scene (but for its last frame), groom, backend
// or precision. A damaged state or frame is logged and counts as missing.
Remains find_remains(const Files& files, const state::RunHeader& header);

}  // namespace ringlet::cache
