// ringlet compare A B
#pragma once
#include <filesystem>

namespace ringlet::app {

struct CompareOptions {
  std::filesystem::path a, b;  // directories, masters or failed states
  double tolerance = 0;        // [A's unit of length]
  bool exact = false;
  bool json = false;
};

// Prints the comparison. 0: the same within the tolerance; 1: not, or of other frames or topology. Throws
// Error.
int run_compare(const CompareOptions& options);

}  // namespace ringlet::app
