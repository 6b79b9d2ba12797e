// USC-HairSalon's .data: i32 strands; per strand i32 n and n x 3 float32, root first.
//
// In that collection a strand of one vertex means that no hair grows from this root of the scalp: such
// strands are dropped, with a logged count, and the strands behind them move up.
#include <fmt/format.h>

#include "core/log.h"
#include "groom/formats.h"

namespace ringlet::groom {

namespace {
constexpr std::uint64_t kPointBytes = 3 * sizeof(float);

// Positive count at `offset`. Anything else is a broken file, or not this format at all.
std::uint64_t read_count(const InputFile& file, std::uint64_t offset, const std::string& what) {
  const auto count = file.value<std::int32_t>(offset, what);
  if (count > 0) return static_cast<std::uint64_t>(count);
  file.fail(offset, fmt::format("{} is {}, expected at least 1", what, count),
            "the groom is empty or damaged, or this is no USC-HairSalon file");
}
}  // namespace

FileGroom read_hairsalon(const InputFile& file) {
  const std::uint64_t strands = read_count(file, 0, "strand count");
  file.require(4, strands, 4 + kPointBytes, "strands");  // each has at least one vertex
  FileGroom groom;
  groom.strands.offsets.reserve(strands + 1);
  std::uint64_t offset = 4, bald = 0;
  for (std::uint64_t strand = 0; strand < strands; ++strand) {
    const std::uint64_t count = read_count(file, offset, fmt::format("vertex count of strand {}", strand));
    offset += 4;
    file.require(offset, count, kPointBytes, fmt::format("vertices of strand {}", strand));
    if (count > 1) {
      file.append_strand(offset, count, kPointBytes, strand, groom.strands);
    } else {
      ++bald;
    }
    offset += count * kPointBytes;
  }
  if (bald > 0) {
    log_info(fmt::format("{}: {} of {} strands have one vertex, where this format means no hair: dropped",
                         file.path().string(), bald, strands));
  }
  if (groom.strands.size() == 0) {
    file.fail(0, fmt::format("the groom is empty: none of its {} strands has two vertices", strands));
  }
  return groom;
}

}  // namespace ringlet::groom
