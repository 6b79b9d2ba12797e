// What a run hands on, frame by frame: to the cache, or to whoever else listens.
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace ringlet::state {

// A surface that is posed per frame (the head and other solids), in the scene's units of length.
struct Surface {
  std::string name;
  std::vector<std::int32_t> triangles;  // [triangles * 3]
};

// How strands follow those that were simulated (groom/interpolation.h). `guides` empty: all strands were.
struct Interpolation {
  std::int32_t neighbours = 0;
  std::vector<std::int32_t> guides;  // [guides] the strands that were simulated, ascending
  std::vector<std::int32_t> guide;   // [strands * neighbours] index into `guides`, -1: none
  std::vector<float> weight;         // [strands * neighbours]
  bool guides_apart = false;         // frames hold the guides' positions by themselves as well
};

// Constant over a run. Strand and particle order are the grooms', in the order the scene lists them.
struct RunHeader {
  std::string name;        // the scene's
  std::string scene_json;  // as run: every default filled in
  std::string scene_hash;
  std::string program_version;
  std::string backend;          // cpu, cuda
  std::string instruction_set;  // avx512, avx2, generic, sm_90, ...
  std::string precision;        // float, double
  std::string length_unit;      // m, cm, ... as in the scene
  double metres_per_unit = 1;
  std::string up;  // x, y, z
  double fps = 24;
  int first_frame = 1, last_frame = 1;      // that this run writes
  std::vector<std::int64_t> offsets;        // [strands + 1]
  std::vector<std::int32_t> root_triangle;  // [strands], -1: none
  std::vector<float> root_barycentric;      // [strands * 3]
  std::vector<float> rest_position;         // [particles * 3] scene units
  std::vector<float> width;                 // [particles] diameter, scene units
  std::vector<std::int32_t> groom_of_strand;
  std::vector<std::string> groom_names;
  Interpolation interpolation;
  std::vector<Surface> surfaces;  // where the cache's fields name `solids`
};

// The solver's figures for a frame: deterministic ones only (no wall-clock value, no thread count).
using Figures = std::vector<std::pair<std::string, double>>;

struct Frame {
  int number = 0;
  double time = 0;                   // [s] after the first frame
  std::vector<float> position;       // [particles * 3] scene units
  std::vector<float> velocity;       // [particles * 3] scene units per second; empty: not asked for
  std::vector<float> elongation;     // [particles] that non-Hookean integrity remembers; empty: not asked for
  std::vector<std::int32_t> living;  // [strands] particles that grooming has left; empty: all
  std::vector<float> guide_position;  // [guides' particles * 3] as position; empty: not asked for
  std::vector<std::vector<float>> surface_vertices;  // as RunHeader::surfaces, [vertices * 3]
  Figures figures;
};

// Enough to go on bit for bit: named arrays of bytes, opaque to the cache.
struct Snapshot {
  int frame = 0;
  std::map<std::string, std::vector<std::byte>> arrays;
};

// Receives the frames in order. `write` may return before the frame is on disk; errors surface at the next
// call.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void write(Frame frame, Snapshot snapshot,
                     double seconds) = 0;  // seconds: wall time, to the timings file
  virtual void finish() = 0;               // waits until everything is on disk
};

}  // namespace ringlet::state
