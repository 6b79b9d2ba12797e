// Two caches, frame by frame.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "cache/reader.h"

namespace ringlet::cache {

struct CompareOptions {
  double tolerance = 0;  // largest distance that is still the same, in A's unit of length
  bool exact = false;    // every stored field must be the same bit for bit; distances are told all the same
};

// Distances between the same particle in A and B, in A's unit of length. A particle with a non-finite
// coordinate in either cache is infinitely far.
struct Distances {
  double max = 0;
  double rms = 0;
  double p99 = 0;               // 99 % of the particles are no farther (nearest rank)
  std::int64_t strand = -1;     // of the farthest particle; -1: no particle moved
  std::int64_t particle = -1;   // along that strand
  std::int64_t non_finite = 0;  // particles
};

struct FrameComparison {
  int frame = 0;
  Distances distances;
  bool identical = false;  // every field bit for bit
};

// A value that differs, as text; empty: not there.
struct Difference {
  std::string where;  // a header field, or a JSON pointer into the scene
  std::string a, b;
};

struct Comparison {
  std::string topology;             // how the strands differ; empty: they do not, and frames were compared
  std::vector<int> only_a, only_b;  // frames that the other lacks
  std::vector<FrameComparison> frames;
  std::vector<int> living;  // frames in which strands have other numbers of living particles
  int worst_frame = 0;      // with the largest distance; meaningful when `frames` is not empty
  Distances overall;        // max, strand, particle, p99 of the worst frames; RMS over all
  std::vector<Difference> provenance;
  bool same = false;  // within the tolerance (exact: identical), of the same frames, one at least, and living
                      // particles
};

// Throws Error{kInput} where a file cannot be read. Frames are read one at a time.
Comparison compare(const CacheReader& a, const CacheReader& b, const CompareOptions& options = {});

}  // namespace ringlet::cache
