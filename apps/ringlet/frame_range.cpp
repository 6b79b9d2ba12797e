#include "frame_range.h"

#include <fmt/format.h>

#include <charconv>

#include "core/error.h"

namespace ringlet::app {

pipeline::FrameRange parse_range(const std::string& text, const scene::Frames& frames) {
  pipeline::FrameRange range{frames.first, frames.last};
  if (text.empty()) return range;
  const auto number = [&](std::string_view part, int& out) {
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), out);
    return error == std::errc() && end == part.data() + part.size();
  };
  const std::size_t dash = text.find('-', 1);
  const bool read =
      number(std::string_view(text).substr(0, dash), range.first) &&
      number(dash == std::string::npos ? text : std::string_view(text).substr(dash + 1), range.last);
  if (!read || range.first > range.last || range.first < frames.first || range.last > frames.last)
    throw Error(ErrorKind::kUsage, "--frames", fmt::format("`{}` is no range of frames", text),
                fmt::format("give A-B within the scene's {}-{}", frames.first, frames.last));
  return range;
}

}  // namespace ringlet::app
