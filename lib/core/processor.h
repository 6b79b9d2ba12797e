// What timings were taken on.
#pragma once
#include <string>

namespace ringlet {

// The CPU's model as the system names it.
std::string processor_name();

}  // namespace ringlet
