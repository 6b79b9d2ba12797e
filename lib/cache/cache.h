// The strand cache: one directory a run, a master file and one file a frame (schemas/cache.md).
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "state/frame.h"

namespace ringlet::cache {

// none: plain arrays. default: lossless, shuffle and deflate. quantised: positions rounded within a stated
// error, then as default. Every one is readable by plain h5py.
enum class Compression { kNone, kDefault, kQuantised };

// What a file of the cache is.
enum class Content { kMaster, kFrame, kState, kFailed };

// Where a run diverged.
struct Failure {
  std::string message;
  std::string stage;           // that was running
  std::int64_t strand = -1;    // -1: unknown
  std::int64_t particle = -1;  // of all particles
};

// What to do with a cache that is already there.
enum class Existing { kRefuse, kResume, kOverwrite };

// Throws Error{kUsage} where the cache `name` exists in `directory` and `existing` refuses it; Error{kIo}
// where the directory cannot be made or written. Changes nothing: meant to be called before the work of
// building a scene.
void check_destination(const std::filesystem::path& directory, const std::string& name, Existing existing);

// NAME.failed.h5 at `path`: a cache of one frame in one file, with what failed. Throws Error{kIo}.
void write_failed_state(const std::filesystem::path& path, const state::RunHeader& header,
                        const state::Frame& frame, const Failure& failure);

// Words for messages and files: none, default, quantised; master, frame, state, failed.
const char* to_string(Compression compression);
const char* to_string(Content content);

}  // namespace ringlet::cache
