// What lies where in a cache's files (schemas/cache.md); private to the room.
#pragma once
#include <cstdint>
#include <map>
#include <vector>

#include "cache/cache.h"
#include "cache/files.h"
#include "cache/hdf5.h"
#include "state/frame.h"

namespace ringlet::cache {

inline constexpr const char* kFormat = "ringlet-cache";
inline constexpr std::int32_t kFormatVersion = 1;

// How a frame's floats are stored.
struct Storage {
  Compression compression = Compression::kDefault;
  double error = 0;  // quantised: the most a particle may move, scene units
};

// What the master tells about a frame without its arrays.
struct FrameRecord {
  double time = 0;
  state::Figures figures;
  bool velocity = false, elongation = false, living = false;
  std::size_t guide_particles = 0;
  std::vector<std::size_t> vertices;  // of each surface
};
FrameRecord record_of(const state::Frame& frame);

// Every file: what it is. `check_identity` throws Error{kInput} for files of others and for newer formats.
void write_identity(const h5::Object& root, Content content);
Content check_identity(const h5::Object& root);

// Master and failed state: everything constant.
void write_header(const h5::Object& root, const state::RunHeader& header);
state::RunHeader read_header(const h5::Object& root);
void write_storage(const h5::Object& root, const Storage& storage);
Storage read_storage(const h5::Object& root);

// Frame file: one frame. The shapes are those of the header where one is given.
void write_frame(const h5::Object& root, const state::Frame& frame, const Storage& storage);
state::Frame read_frame(const h5::Object& root, const state::RunHeader* header);
FrameRecord read_record(const h5::Object& root);

// Master: the frames as one sequence, taken from the frame files.
void write_sequence(const h5::Object& root, const std::map<int, FrameRecord>& frames,
                    const state::RunHeader& header, const Files& files);

// Failed state: one frame as a sequence of length one, and what failed.
void write_single(const h5::Object& root, const state::Frame& frame);
state::Frame read_single(const h5::Object& root, const state::RunHeader& header);
void write_failure(const h5::Object& root, const Failure& failure);
Failure read_failure(const h5::Object& root);

// State: named arrays of bytes.
void write_snapshot(const h5::Object& root, const state::Snapshot& snapshot, std::uint64_t header_hash);
state::Snapshot read_snapshot(const h5::Object& root);

// Of everything that a state depends on: strands, rest shape, precision, backend. Not of the scene's text.
std::uint64_t hash_of(const state::RunHeader& header);

}  // namespace ringlet::cache
