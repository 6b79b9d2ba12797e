// Cem Yuksel's HAIR format, by its specification (cemyuksel.com/research/hairmodels).
//
// Header, 128 bytes: "HAIR", u32 strands, u32 points, u32 flags, u32 default segments, f32 default thickness,
// f32 default transparency, 3 x f32 default colour, 88 characters. Then, each where its flag is set: u16
// segments a strand, 3 x f32 a point, f32 thickness a point, f32 transparency a point, 3 x f32 colour a
// point.
#include <fmt/format.h>

#include <cmath>

#include "groom/formats.h"

namespace ringlet::groom {

namespace {
constexpr std::uint64_t kHeaderBytes = 128;
constexpr std::uint64_t kPointBytes = 3 * sizeof(float);
enum Flag : std::uint32_t { kSegments = 1, kPoints = 2, kThickness = 4 };

struct Header {
  std::uint32_t strands, points, flags, default_segments;
  float default_thickness;
  std::uint64_t segments_at() const { return kHeaderBytes; }
  std::uint64_t points_at() const { return kHeaderBytes + (flags & kSegments ? 2ull * strands : 0); }
  std::uint64_t thickness_at() const { return points_at() + kPointBytes * points; }
};

Header read_header(const InputFile& file) {
  file.require(0, 1, kHeaderBytes, "HAIR header");
  const Header header{file.value<std::uint32_t>(4, "strand count"),
                      file.value<std::uint32_t>(8, "point count"), file.value<std::uint32_t>(12, "flags"),
                      file.value<std::uint32_t>(16, "default segments"),
                      file.value<float>(20, "default thickness")};
  if (header.strands == 0) file.fail(4, "the groom is empty: 0 strands", "export at least one strand");
  if (!(header.flags & kPoints)) {
    file.fail(12, fmt::format("flags {} lack the points array (bit 1)", header.flags), "export with points");
  }
  if (header.flags & kSegments) file.require(header.segments_at(), header.strands, 2, "segment counts");
  file.require(header.points_at(), header.points, kPointBytes, "points");
  if (header.flags & kThickness) file.require(header.thickness_at(), header.points, 4, "thickness");
  return header;
}

std::uint64_t count_of(const InputFile& file, const Header& header, std::uint64_t strand) {
  const std::uint64_t segments =
      header.flags & kSegments ? file.value<std::uint16_t>(header.segments_at() + 2 * strand, "segment count")
                               : header.default_segments;
  return segments + 1;
}

// The header's point count must be that of its strands, before any point is read.
void check_counts(const InputFile& file, const Header& header) {
  std::uint64_t points = 0;
  for (std::uint64_t strand = 0; strand < header.strands; ++strand) {
    points += count_of(file, header, strand);
    if (points > header.points) break;
  }
  if (points == header.points) return;
  file.fail(8,
            fmt::format("the header says {} points, the strands' segments need {}{}", header.points,
                        points > header.points ? "at least " : "", points),
            "the file is truncated, or its header is wrong");
}

std::vector<float> read_widths(const InputFile& file, const Header& header) {
  std::vector<float> widths;
  if (header.flags & kThickness) {
    widths.resize(header.points);
    for (std::uint64_t i = 0; i < header.points; ++i) {
      widths[i] = file.value<float>(header.thickness_at() + 4 * i, "thickness");
      if (std::isfinite(widths[i]) && widths[i] >= 0) continue;
      file.fail(
          header.thickness_at() + 4 * i,
          fmt::format("point {}: thickness is {}, expected a finite number of at least 0", i, widths[i]));
    }
  } else if (std::isfinite(header.default_thickness) && header.default_thickness > 0) {
    widths.assign(header.points, header.default_thickness);
  }
  return widths;
}
}  // namespace

// A strand of 0 segments is a single particle and kept. Thickness is taken as the diameter in the file's
// length unit.
FileGroom read_hair(const InputFile& file) {
  const Header header = read_header(file);
  check_counts(file, header);
  FileGroom groom;
  groom.strands.points.reserve(header.points);
  groom.strands.offsets.reserve(header.strands + 1ull);
  for (std::uint64_t strand = 0; strand < header.strands; ++strand) {
    const std::uint64_t offset = header.points_at() + kPointBytes * groom.strands.points.size();
    file.append_strand(offset, count_of(file, header, strand), kPointBytes, strand, groom.strands);
  }
  groom.strands.widths = read_widths(file, header);
  return groom;
}

}  // namespace ringlet::groom
