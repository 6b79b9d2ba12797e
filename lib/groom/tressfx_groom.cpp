// TressFX .tfx, versions 3 and 4, and .tfxskin.
//
// Both versions: f32 version, u32 strands, u32 vertices a strand. Version 3 (74 words of header): u32[36] is
// the byte offset of the positions, float3. Version 4 (40 words): u32[3] is that offset, positions are float4
// with the inverse mass last. Both may hold texture coordinates, colours and thickness, which here is a
// factor, not a length: left.
//
// .tfxskin (67 words of header): u32 version, u32 strands, u32 triangles, u32[34] the byte offset of one
// record a strand: u32 mesh, u32 triangle, 3 x f32 barycentrics, u32 reserved. TressFX itself disregards the
// mesh index: the triangle counts through the whole head.
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "groom/formats.h"

namespace ringlet::groom {

namespace {
struct Layout {
  std::uint64_t header_bytes, offset_at, stride;
};
constexpr Layout kVersion3{74 * 4, 36 * 4, 12}, kVersion4{40 * 4, 3 * 4, 16};

Layout layout_of(const InputFile& file) {
  const auto version = file.value<float>(0, "version");
  if (version >= 3 && version < 4) return kVersion3;
  if (version >= 4 && version < 5) return kVersion4;
  file.fail(0, fmt::format("TressFX version is {}, expected 3 or 4", version),
            "this is no TressFX 3 or 4 file");
}
}  // namespace

FileGroom read_tressfx(const InputFile& file) {
  const Layout layout = layout_of(file);
  file.require(0, 1, layout.header_bytes, "TressFX header");
  const std::uint64_t strands = file.value<std::uint32_t>(4, "strand count");
  const std::uint64_t count = file.value<std::uint32_t>(8, "vertices per strand");
  const std::uint64_t offset = file.value<std::uint32_t>(layout.offset_at, "offset of positions");
  if (strands == 0) file.fail(4, "the groom is empty: 0 strands", "export at least one strand");
  if (count == 0) file.fail(8, "strands have 0 vertices, expected at least 1");
  if (offset < layout.header_bytes) {
    file.fail(layout.offset_at, fmt::format("positions at byte {} lie inside the header of {} bytes", offset,
                                            layout.header_bytes));
  }
  file.require(offset, strands * count, layout.stride, "positions");
  FileGroom groom;
  groom.strands.offsets.reserve(strands + 1);
  groom.strands.points.reserve(strands * count);
  for (std::uint64_t strand = 0; strand < strands; ++strand) {
    file.append_strand(offset + strand * count * layout.stride, count, layout.stride, strand, groom.strands);
  }
  return groom;
}

std::vector<RootSite> read_tressfx_skin(const InputFile& file, std::size_t strands) {
  constexpr std::uint64_t kHeaderBytes = 67 * 4, kOffsetAt = 34 * 4, kRecordBytes = 24;
  file.require(0, 1, kHeaderBytes, "TressFX skin header");
  const auto count = file.value<std::uint32_t>(4, "strand count");
  if (count != strands) {
    file.fail(4, fmt::format("the skin is for {} strands, the groom has {}", count, strands),
              "pair each .tfx with its own .tfxskin");
  }
  const std::uint64_t offset = file.value<std::uint32_t>(kOffsetAt, "offset of roots");
  file.require(offset, count, kRecordBytes, "roots");
  std::vector<RootSite> roots(count);
  for (std::uint64_t strand = 0; strand < count; ++strand) {
    const std::uint64_t record = offset + strand * kRecordBytes;
    const auto triangle = file.value<std::uint32_t>(record + 4, "triangle");
    if (triangle > std::numeric_limits<std::int32_t>::max()) {
      file.fail(record + 4, fmt::format("strand {}: root triangle {} does not exist", strand, triangle));
    }
    roots[strand].triangle = static_cast<std::int32_t>(triangle);
    for (int k = 0; k < 3; ++k) {
      const auto weight = file.value<float>(record + 8 + 4 * k, "barycentrics");
      if (!std::isfinite(weight)) {
        file.fail(record + 8 + 4 * k,
                  fmt::format("strand {}: barycentric coordinate {} is {}, expected a finite number", strand,
                              k, weight));
      }
      roots[strand].barycentric[k] = weight;
    }
  }
  return roots;
}

}  // namespace ringlet::groom
