// Writes caches, from a thread of its own.
#pragma once
#include <filesystem>
#include <memory>
#include <optional>

#include "cache/cache.h"

namespace ringlet::cache {

struct WriterOptions {
  Compression compression = Compression::kDefault;
  double error = 0;  // quantised: the most a particle may move [scene units], above 0
  Existing existing = Existing::kRefuse;
  std::size_t queue = 2;  // frames that wait for the disk before `write` does
};

// The cache header.name in `directory`. Frame files appear under their names complete or not at all; the
// state and the master follow at least once a second (or as seldom as keeps them to a twentieth of the time),
// so that a run that is killed leaves a valid cache and a state from which every frame after it is computed
// again, to the same bytes.
//
// Velocities and surfaces are stored where frames carry them. Errors of the disk are Error{kIo} with the path
// and the reason, thrown by the next `write` or `finish` and by every one after it; frames that were written
// before stay.
class CacheWriter : public state::FrameSink {
 public:
  // Makes the directory and the master. Throws Error{kUsage}: a cache is there and `existing` refuses it, or
  // resuming another scene, groom, backend or precision; Error{kIo}.
  CacheWriter(const std::filesystem::path& directory, state::RunHeader header,
              const WriterOptions& options = {});
  ~CacheWriter() override;  // what `finish` does, but errors are only logged

  // What a resumed run goes on from, once; nothing: from the beginning.
  std::optional<state::Snapshot> take_resume_point();

  // A snapshot without arrays is not stored.
  void write(state::Frame frame, state::Snapshot snapshot, double seconds) override;
  void finish() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ringlet::cache
