// What the tests of the pipeline share.
#pragma once
#include <cstdint>

namespace ringlet::pipeline_testing {

// By `new` and not deleted since, of plain alignment [bytes].
std::int64_t allocated();

}  // namespace ringlet::pipeline_testing
