// What the tests of the pipeline share.
#pragma once
#include <cstdint>
#include <filesystem>

namespace ringlet::pipeline_testing {

// By `new` and not deleted since, of plain alignment [bytes].
std::int64_t allocated();

// A `.data` groom of crooked strands in a row, 2 cm a segment.
void write_hair(const std::filesystem::path& file, std::int32_t strands, std::int32_t particles);

}  // namespace ringlet::pipeline_testing
